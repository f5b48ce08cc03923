"""How fast functions of a scene that depend on two parameters at once change along the steps of a locus.

Of a function of one parameter it is known beforehand where steps are to be short (:mod:`rodfem.problem.fast_load`).
One of both, as a ridge along an oblique line of their plane, is looked at on the chord of each step: a cubic has to
tell it there.  Expressions of UFL are bounded by interval arithmetic between the places that are looked at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodfem.problem.fast_load import CLOSE, NOISE, told
from rodfem.problem.parameter_functions import ParameterFunction, parameter_functions

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

SEEN = np.linspace(0.0, 1.0, 65)
"""Where on a chord a function is looked at, at least."""


class FastPlane:
    """Functions of a ``scene`` that depend on both parameters of a plane."""

    def __init__(self, scene: Scene, names: tuple[str, str]) -> None:
        """List them; the parameters have these ``names``."""
        self.functions = [each for each in parameter_functions(scene, names) if each[1].joint]

    def unfollowed(self, a: np.ndarray, b: np.ndarray) -> str:
        """Words for what no cubic tells between two points (2,) of the plane; empty where there is nothing."""
        for what, numbers in self.functions:
            if not self._told(numbers, a, b, SEEN) or not self._told(numbers, a, b, numbers.places(SEEN, a, b)):
                return what
        return ""

    def _told(self, numbers: ParameterFunction, a: np.ndarray, b: np.ndarray, there: np.ndarray) -> bool:
        """Whether a cubic tells numbers on a chord, as far as places of it ``there`` show."""

        def on_chord(t: np.ndarray) -> np.ndarray:
            return numbers(a + t[:, None] * (b - a))

        seen = on_chord(there)
        off, _, size = told(on_chord, np.zeros(1), np.ones(1), (there, seen))
        return not np.any(off > np.maximum(CLOSE * size, np.maximum(numbers.least, NOISE * numbers.sizes(seen))))

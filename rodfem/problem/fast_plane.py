"""How fast functions of a scene that depend on two parameters at once change along the steps of a locus.

Of a function of one parameter it is known beforehand where steps are to be short (:mod:`rodfem.problem.fast_load`).
One of both, as a ridge along an oblique line of their plane, is looked at on the chord of each step: a cubic has to
tell it there.  Expressions of UFL are bounded by interval arithmetic between the places that are looked at.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rodfem.problem.enclosure import refined
from rodfem.problem.fast_load import CLOSE, NOISE, told
from rodfem.problem.parameter_functions import ParameterFunction, parameter_functions
from rodfem.problem.values import Symbol

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
            on_chord = lambda t, f=numbers: f(a + t[:, None] * (b - a))  # noqa: E731
            there = _places(numbers, a, b)
            seen = on_chord(there)
            off, size = told(on_chord, 0.0, 1.0, (there, seen))
            largest = float(abs(seen[np.isfinite(seen)]).max(initial=0.0))
            if np.any(off > np.maximum(CLOSE * size, max(numbers.least, NOISE * largest))):
                return what
        return ""


def _places(numbers: ParameterFunction, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Where on the chord from ``a`` to ``b`` numbers have to be looked at."""
    places, t = SEEN, Symbol()
    for expression in numbers.narrow:
        at = dict(zip(numbers.symbols, (a + places[:, None] * (b - a)).T, strict=True))
        values = expression(at | {x: np.full(len(places), value) for x, value in numbers.fixed.items()})
        size = float(abs(values[np.isfinite(values)]).max(initial=0.0))
        lines = {x: (float(p), float(q - p)) for x, p, q in zip(numbers.symbols, a, b, strict=True)}
        lines |= {x: (value, 0.0) for x, value in numbers.fixed.items()}
        places = refined(expression.expression, t, places, max(size, numbers.least), lines)
    return places

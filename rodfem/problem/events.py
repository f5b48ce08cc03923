"""What a plan may seek along a branch: zeros of a number of the state, and eigenvalues that equal a number."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite
from types import SimpleNamespace
from typing import Any

import numpy as np

from rodfem.errors import InputError, SceneError
from rodfem.problem.arguments import finite, function, plain, text
from rodfem.problem.functions import Role, guarded

ROLE = Role(
    "event {}",
    "of(state)",
    hint="it receives a state with arrays s (m,), r (m, 3) and q (m, 4), and returns a number",
    returns=plain,
)


@dataclass(frozen=True)
class Event:
    """A number of the state, whose zeros along a branch are special points.

    ``name`` is what happens there, ``of(state)`` a number that changes its sign or touches zero: ``state.s`` (m,),
    ``state.r`` (m, 3) and ``state.q`` (m, 4) are arclength, centreline and unit quaternions from left to right,
    nondimensional or in the units of the scene; multipliers, the load and further fields have their names in
    ``states.h5``.

    Between two rows of a branch it is a cubic, by its values there and its derivatives along the branch, for which the
    function receives states between the rows, too.  Where the cubic vanishes, or turns near zero, equilibria decide.
    What else it does within a step is not seen: ``StepControl(largest=...)`` bounds the steps.

    The function receives the nodes, the ends of the rod among them: ``state.r[:, 0].max()`` is that of the highest
    node, and ``numpy.interp`` or a sum is taken over nodes.  The error bar is by nodes that are twice as close: that of
    a sum over nodes holds, that of a largest value among nodes, or of a line between two, may by accident not.
    """

    name: str
    of: Callable[[Any], float]

    def __post_init__(self) -> None:
        """Check name and function; raises :class:`InputError`."""
        if not text("ends meet")("name", self.name):
            raise InputError("An event has no name: give one, as in Event('ends meet', of=f).")
        function("lambda state: state.r[-1, 0]")("of", self.of)

    def __call__(self, state: Mapping[str, Any]) -> float:
        """Value at a state, given by its arrays; raises :class:`SceneError` for what the function raises."""
        value = guarded(ROLE.words.format(repr(self.name)), self.of, ROLE)(SimpleNamespace(**state))
        if not isfinite(value):
            raise SceneError(f"The event {self.name!r} is {value}: return a finite number at every state.")
        return float(value)

    def check(self, length: float) -> None:
        """Call the function at an undeformed rod of a length; raises :class:`SceneError` where it fails at any."""
        s = np.linspace(0.0, length, 5)
        r, q = np.outer(s, (0.0, 0.0, 1.0)), np.tile((1.0, 0.0, 0.0, 0.0), (5, 1))
        try:
            self({"s": s, "r": r, "q": q})
        except SceneError as trouble:
            if isinstance(trouble.__cause__, (TypeError, NameError)):
                raise


@dataclass(frozen=True)
class Level:
    """A ``value`` of an eigenvalue ``mu = omega^2`` of the second variation, in units of the scene.

    A special point is where the number of smaller eigenvalues changes from row to row, by one or more.
    """

    value: float

    def __post_init__(self) -> None:
        finite(0.5)("value", self.value)

    @property
    def name(self) -> str:
        """Name of its special points."""
        return f"eigenvalue {self.value:g}"

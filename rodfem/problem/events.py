"""Events: the user's own test functions, numbers of the state whose zeros along a branch are special points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from rodfem.problem.roles import Role, guarded

ROLE = Role(
    "event {}",
    "of(state)",
    hint="it receives a state with arrays s (m,), r (m, 3) and q (m, 4), and returns a number",
    returns=float,
)


@dataclass(frozen=True)
class Event:
    """A number of the state, whose zeros along a branch are special points.

    Attributes
    ----------
    name
        What happens there, as tables show it.
    of
        ``of(state)``, a number that changes its sign: ``state.s`` (m,), ``state.r`` (m, 3) and ``state.q`` (m, 4) are
        arclength, centreline and unit quaternions from left to right, nondimensional or in the units of the scene;
        multipliers, the load and further fields have their names in ``states.h5``.
    """

    name: str
    of: Callable[[Any], float]

    def __call__(self, state: Mapping[str, Any]) -> float:
        """Value at a state, given by its arrays; raises :class:`SceneError` for what the function raises."""
        value = guarded(ROLE.words.format(repr(self.name)), self.of, ROLE)(SimpleNamespace(**state))
        return float(value)

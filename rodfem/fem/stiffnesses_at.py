"""Second derivatives of the energies between successive states of a system that are far from those at the states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from rodfem.fem.parameters import Line
from rodfem.fem.shape import Shape
from rodfem.fem.state_along import StateAlong
from rodfem.problem.pointwise import Places
from rodfem.problem.stiffnesses import stiffnesses

PLACES = np.array([0.0, 0.5, 1.0])
"""Places of an element at which the states are compared."""
AT_ONCE = 20_000
"""About so many places are looked at at once."""


class StiffnessesAt:
    """Tells which energies change and change back between states of one system; collective over its ranks."""

    def __init__(self, shape: Shape) -> None:
        """Derive the second derivatives of the energies of the scene of a ``shape``."""
        self.shape = shape
        self.symbols, self.stiffnesses = stiffnesses(shape.system.scene)

    def __call__(self, states: Sequence[PETSc.Vec], lines: Sequence[Line] = ()) -> dict[int, str]:
        """Numbers of the states after which second derivatives are others than at that and at the next one.

        With words for the function that has them.  Parameters are those of the system's line, or of one for each of the
        ``states``, on which the system is left then.
        """
        found = dict[int, str]()
        if not self.stiffnesses or len(states) < 2:
            return found
        block = max(1, AT_ONCE // (self.shape.system.fields.discretization.elements * len(PLACES)))
        for first in range(0, len(states) - 1, block):
            some = states[first : first + block + 1]
            places = [self._places(x, lines[first + i] if lines else None) for i, x in enumerate(some)]
            for each in self.stiffnesses:
                here = [self._of(each.s, at) for at in places]
                a, b = _together(here[:-1]), _together(here[1:])
                hidden = each.hidden(a, b).reshape(len(some) - 1, -1).any(axis=1)
                found |= {first + int(i): each.what for i in np.flatnonzero(hidden)}
        return found

    def _places(self, x: PETSc.Vec, line: Line | None) -> Places:
        if line is not None:
            self.shape.system.line = line
        return StateAlong(self.shape, x, self.symbols)(PLACES)

    def _of(self, s: float | None, places: Places) -> Places:
        """All places, or the one at the arclength ``s``."""
        if s is None:
            return places
        nearest = int(np.argmin(abs(places[self.symbols.s] - s)))
        return {symbol: x[nearest : nearest + 1] for symbol, x in places.items()}


def _together(places: Sequence[Places]) -> Places:
    """Places of several states, one after the other."""
    return {symbol: np.concatenate([some[symbol] for some in places]) for symbol in places[0]}

"""Kinks of the energies in a state of a system: along the rod, and where a state is on one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.fem.state_along import StateAlong
from rodfem.problem.kinks import Kink, kinks
from rodfem.problem.pointwise import Places

FINE = 4
"""Places of an element where the state is looked at, over its degree."""
ON = 1e-8
"""Value of a difference, over its derivative, up to which the state is on the kink."""
AT_LEAST = 3
"""So many places along the rod are on a kink where the state is: at a zero of a moment, say, there are two."""
MOST = 5
"""Places along the rod at which a function is examined for a kink."""


class Met(NamedTuple):
    """Words for the functions of which a kink is ``inside`` of the rod, and of which the state is ``on`` one."""

    inside: list[str]
    on: list[str]

    @property
    def kink(self) -> str:
        """Names of the functions of which the state is on a kink; empty where it is on none."""
        return " and the ".join(self.on)


class KinksAt:
    """Tells which kinks the states of one system meet; collective over its ranks."""

    def __init__(self, shape: Shape) -> None:
        """Find the kinks of the scene of a ``shape``."""
        self.shape = shape
        self.symbols, self.kinks = kinks(shape.system.scene)

    def __call__(self, x: PETSc.Vec) -> Met:
        """Return the kinks that a state ``x`` meets."""
        met = Met([], [])
        if not self.kinks:
            return met
        along = StateAlong(self.shape, x, self.symbols)
        places = along(np.linspace(0.0, 1.0, FINE * along.degree + 1))
        for kink in self.kinks:
            if kink.s is None:
                self._along(kink, places, met)
            else:
                nearest = int(np.argmin(abs(places[self.symbols.s] - kink.s)))
                here = _only(places, nearest)
                if _on(kink, here)[0] and kink.order(here) == 2:
                    met.on.append(kink.what)
        return Met(*(list(dict.fromkeys(words)) for words in met))

    def _along(self, kink: Kink, places: Places, met: Met) -> None:
        on = _on(kink, places)
        if np.count_nonzero(on) >= AT_LEAST:
            some = np.flatnonzero(on)[:: max(1, np.count_nonzero(on) // MOST)]
            orders = [kink.order(_only(places, int(i))) for i in some]
            if 2 in orders:
                met.on.append(kink.what)
            if any(orders):
                met.inside.append(kink.what)
        off = np.flatnonzero(~on)
        y = kink.value(places)[off]
        size, steps, sign = abs(y), abs(np.diff(y)), np.sign(y)
        crossed = np.flatnonzero(sign[1:] != sign[:-1])
        least = (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:]) & (size[1:-1] <= steps[1:] + steps[:-1])
        touched = 1 + np.flatnonzero(least & (sign[:-2] == sign[1:-1]) & (sign[2:] == sign[1:-1]))
        for group in (crossed, touched):
            if any(kink.order(_only(places, int(off[i]))) for i in group[:: max(1, len(group) // MOST)]):
                met.inside.append(kink.what)


def _only(places: Places, i: int) -> Places:
    return {symbol: x[i : i + 1] for symbol, x in places.items()}


def _on(kink: Kink, places: Places) -> np.ndarray:
    """Where the state is on a kink, to round-off."""
    return np.asarray(abs(kink.value(places)) <= ON * abs(kink.slopes(places)).sum(axis=0))

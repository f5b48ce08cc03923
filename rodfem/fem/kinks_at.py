"""Kinks of the energies in a state of a system: along the rod, and where a state is on one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.fields import LOAD
from rodfem.fem.shape import Shape
from rodfem.problem.kinks import Kink, Places, kinks

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
        places = self._places(x)
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

    def _places(self, x: PETSc.Vec) -> Places:
        """The state at places from left to right, ends of elements included."""
        sample, at = self.shape.sample(x), self.symbols
        elements = sample["elements"]
        degree = (len(sample["s"]) - 1) // elements
        t = np.linspace(0.0, 1.0, FINE * degree + 1)
        cells = np.arange(elements)[:, None] * degree + np.arange(degree + 1)
        ends = sample["s"][::degree]
        size = np.diff(ends)[:, None]
        values, slopes = _basis(degree, t)
        q = np.asarray(sample["q"])[cells]
        out = {at.s: (ends[:-1, None] + size * t).ravel()}
        out[at.load] = np.full(len(out[at.s]), float(sample[LOAD]))
        out |= dict(zip(at.q, np.einsum("tn,eni->iet", values, q).reshape(4, -1), strict=True))
        out |= dict(zip(at.dq, (np.einsum("tn,eni->iet", slopes, q) / size).reshape(4, -1), strict=True))
        r = np.asarray(sample["r"])[cells]
        out |= dict(zip(at.r, np.einsum("tn,eni->iet", values, r).reshape(3, -1), strict=True))
        if at.v:
            v = np.asarray(sample["v"])
            strains, _ = _basis(degree - 1, t)
            out |= dict(zip(at.v, np.einsum("tn,eni->iet", strains, v).reshape(len(at.v), -1), strict=True))
        return out


def _basis(degree: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values and slopes of the polynomials of the nodes, from left to right, at places of an element: (t, nodes)."""
    powers = np.linalg.inv(legendre.legvander(2 * np.sort(compat.nodes(degree)) - 1, degree))
    slopes = 2 * legendre.legder(powers, axis=0) if degree else np.zeros_like(powers)
    return legendre.legval(2 * t - 1, powers).T, legendre.legval(2 * t - 1, slopes).T


def _only(places: Places, i: int) -> Places:
    return {symbol: x[i : i + 1] for symbol, x in places.items()}


def _on(kink: Kink, places: Places) -> np.ndarray:
    """Where the state is on a kink, to round-off."""
    return np.asarray(abs(kink.value(places)) <= ON * abs(kink.slopes(places)).sum(axis=0))

r"""Frequencies beyond those that a sweep follows which meet, and part again, between two looks at all of them.

At each look all eigenvalues ``nu`` and right and left vectors ``Y``, ``Z`` of a matrix ``T``, smooth in the load, are
known (:mod:`rodfem.stability.census`).  With ``Z^t Y = 1`` and a parabola through ``Z^t T Y`` at three looks,

    Z^t T(t) Y = diag(nu) + E(t),        E(0) = 0,

two eigenvalues ``i``, ``j`` have to first order the discriminant

    D(t) = ((nu_i + E_ii - nu_j - E_jj) / 2)^2 + E_ij E_ji .

It becomes negative only where the product is: motions that the load does not couple, or couples by a potential, cross
or turn away from one another.  Equal eigenvalues are one group: ``D`` has the means of two groups, and the trace of the
product of their blocks, over its size.  Where the lowest ``D`` is near zero or below, that of the invariant subspace
is sought by equilibria (:mod:`rodfem.diagram.hidden_events`).  It is sought, too, wherever vectors have nearly become
one: the two are about to meet, or have just parted, and no parabola through looks is so sharp.

The upper half of a mesh's eigenvalues is left out: it tells of the mesh rather than of the rod.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rodfem.continuation.branch import Point
from rodfem.diagram.hidden_events import Approach, HiddenEvents, Lowest
from rodfem.diagram.side import Side
from rodfem.errors import ConvergenceError
from rodfem.stability.census import Census
from rodfem.stability.frequencies import ALIKE, REAL, Frequencies, groups
from rodfem.stability.nonsymmetric import NonsymmetricPencil

FOUND = 1e-4
"""Relative distance within which an eigenvalue is found again."""
EDGE = 0.1
"""Part of the way from one look to the next, at either end, in which no search begins."""
ASIDE = 0.1
"""Distance of a shift from the mean of eigenvalues, over their standard deviation: it is none of them."""
LOWER = 0.7
"""Part of the discriminants at both looks below which a lowest one is near zero: a parabola is not what loads do."""
ONE = 0.9
"""Square of the cosine of two vectors, of two groups the mean of its sums, from which on they are nearly one."""
CLEAR = 100.0
"""Products of the changes of two eigenvalues above this, over their doubts, are none of round-off."""
SMALL = 0.3
"""Part of an eigenvalue up to which its change is one of first order: near a double one, with one vector, it is not."""
PLACES = np.linspace(0.0, 1.0, 21)
"""Parts of the way from one look to the next at which the discriminants are evaluated."""


class Look(NamedTuple):
    """A ``point`` and the ``census`` of its state."""

    point: Point
    census: Census


class Meeting(NamedTuple):
    """Eigenvalues (k,), ``mu = omega^2`` at a look, that may meet this part of the way ``along`` to the next one."""

    values: np.ndarray
    along: float


class FarMeetings:
    """Compares looks of a sweep at all eigenvalues of its mesh."""

    def __init__(self, hidden: HiddenEvents) -> None:
        """Measure, and seek lowest values, as the search among eigenvalues that are followed does (``hidden``)."""
        self.hidden = hidden
        self._looks: list[Look] = []

    def look(self, point: Point, census: Census) -> list[Lowest]:
        """What may meet, and part again, between the last looks and the one at a ``point``, whose ``census`` is given.

        Raises :class:`ConvergenceError` where eigenvalues are not found again.
        """
        self._looks = [*self._looks[-2:], Look(point, census)]
        if len(self._looks) < 3:
            return []
        out: list[Lowest] = []
        for i, meeting in point.x.comm.tompi4py().bcast(_meetings(self._looks)):
            lowest = self._lowest(self._looks[1], self._looks[i], meeting)
            out += [lowest] if lowest.open else []
        return out

    def _lowest(self, a: Look, b: Look, meeting: Meeting) -> Lowest:
        """Where on the way from one look to another eigenvalues are nearest."""
        pencil = self.hidden.measured(a.point.x).pencil(a.point.load)
        found, chosen = _again(pencil, meeting.values, a.census.motions.values)
        first, second = (Side(look.point.load, look.point.x, found) for look in (a, b))
        approach = Approach(chosen, 1, float(meeting.values.var()))
        return self.hidden.lowest(approach, first, second, meeting.along)


def _meetings(looks: list[Look]) -> list[tuple[int, Meeting]]:
    """What may meet on the way from the second of three looks to each of the others, with the place of that."""
    of, T = looks[1].census.motions, [look.census.motions.operator for look in looks]
    places = np.setdiff1d(np.arange(len(of.nu) // 2), looks[1].census.nearer)  # the half nearest to zero
    if not len(places) or not T[0].shape == T[1].shape == T[2].shape:  # sections have mass at some loads only
        return []
    Y, Z = of.vectors(places)
    back, on = (Z @ ((T[i] - T[1]) @ Y) for i in (0, 2))
    # E(t) = t first + t^2 second is the difference to the third look at t = 1, and to the first one at t = s
    loads = [look.point.load for look in looks]
    s = (loads[0] - loads[1]) / (loads[2] - loads[1])
    second = (back - s * on) / (s * (s - 1.0))
    pairs = Pairs(of.nu[places].real, on - second, second, of.doubt[places], of.right[:, places])
    mu, followed = of.values[places].real, (np.arange(len(of.nu)) < len(looks[1].point.omega2))[places]
    found = ((i, pair) for i, way in ((0, s), (2, 1.0)) for pair in pairs.near(way))
    return [(i, Meeting(mu[both], along)) for i, (both, along) in found if not followed[both].all()]


class Pairs:
    """Discriminants of all pairs of eigenvalues ``nu`` (k,), or of groups of equal ones, as functions of a parameter.

    The matrix changes by ``t first + t^2 second`` (k, k); the eigenvalues are in ``doubt`` (k,) by round-off, and have
    the ``vectors`` (n, k) of norm one.
    """

    def __init__(
        self, nu: np.ndarray, first: np.ndarray, second: np.ndarray, doubt: np.ndarray, vectors: np.ndarray
    ) -> None:
        """Find the groups, and the products of their blocks."""
        self.groups = groups(nu, float(abs(nu).max()), ALIKE)
        member = np.zeros((len(nu), len(self.groups)))
        for g, group in enumerate(self.groups):
            member[group, g] = 1.0
        sizes = member.sum(axis=0)
        changes = (np.diag(first).real, np.diag(second).real)
        self.mean, *self._changes = ((part @ member) / sizes for part in (nu, *changes))
        self._round_off = np.array([max(REAL * abs(nu[g]).max(), CLEAR * doubt[g].max()) for g in self.groups])
        self._one = member.T @ abs(vectors.conj().T @ vectors) ** 2 @ member / np.minimum.outer(sizes, sizes)
        products = first * first.T, first * second.T + second * first.T, second * second.T
        self._products = [member.T @ part.real @ member / (np.add.outer(sizes, sizes) / 2.0) for part in products]

    def near(self, way: float) -> list[tuple[list[int], float]]:
        """Places of eigenvalues whose discriminant comes near zero, or below, for ``t`` from 0 to ``way``.

        Part of the way at which it is lowest.
        """
        (of1, of2), (by1, by2, by3), t = self._changes, self._products, way * PLACES[:, None]
        mean, t2 = self.mean + t * (of1 + t * of2), (t**2)[:, :, None]
        product = t2 * (by1 + t[:, :, None] * (by2 + t[:, :, None] * by3))
        D = (mean[:, :, None] - mean[:, None, :]) ** 2 / 4.0 + product
        i, j = np.triu_indices(len(self.groups), 1)
        k = D.argmin(axis=0)[i, j]
        chosen = D[k, i, j] < LOWER * np.minimum(D[0, i, j], D[-1, i, j])
        chosen &= product[k, i, j] < -self._round_off[i] * self._round_off[j]
        for own in (i, j):
            size = SMALL * abs(self.mean[own])
            chosen &= (abs(mean[k, own] - self.mean[own]) < size) & (-product[k, i, j] < size**2)
        chosen |= self._one[i, j] > ONE
        along = np.clip(PLACES[k], EDGE, 1.0 - EDGE)
        return [(self.groups[i[n]] + self.groups[j[n]], float(along[n])) for n in np.flatnonzero(chosen)]


def _again(pencil: NonsymmetricPencil, values: np.ndarray, known: np.ndarray) -> tuple[Frequencies, list[int]]:
    """Eigenvalues near some ``values`` (k,) of those ``known``, with vectors, and the places of the ``values``."""
    shift = float(values.mean() + ASIDE * values.std())
    between = int((abs(known - shift) < abs(values - shift).max()).sum())
    found = pencil.near(max(between, len(values)) + 2, shift)
    left, chosen = list(range(len(found.values))), list[int]()
    for value in values.tolist():
        place = min(left, key=lambda i: abs(found.values[i] - value))
        if abs(found.values[place] - value) > FOUND * abs(value):
            raise ConvergenceError(f"the eigenvalue {value:.6g} is not found again")
        left.remove(place)
        chosen.append(place)
    return found, chosen

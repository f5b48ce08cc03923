"""The eigenvalues near zero at a state: their values, and what round-off leaves open of each.

The factors of ``S`` are those of a matrix that differs by about ``eps |S|``: within the *band* ``10 eps |S| / m``, for
the smallest mass m, a count decides nothing.  That is the bound for the roughest vector.  For one smooth vector y of
metric norm 1 independent errors of the entries of S change the quotient ``y.Sy`` by about

    eps (sum_ij (S_ij y_i y_j)^2)^(1/2),

smaller by some powers of an element's size.  Eigenvalues inside the band are decided by their quotients, and count as
zero if ten times this exceeds their magnitude.

Those nearer to zero than a part of the lowest bending eigenvalue are *soft*.  Their uncertainty on one mesh is at least
what Newton's method leaves of the state, :data:`~rodfem.fem.newton.TOLERANCE`.  A richer mesh decides what the mesh
adds (:mod:`rodfem.adaptivity.soft_states`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE
from rodfem.stability.inertia import NULL, ROUGH, SPARE, ZERO_BAND, Factored, Index, Inertia, Quotients
from rodfem.stability.soft_mode import SoftMode

MANY = 100
"""Most eigenvalues near zero that are decided one by one."""
SOFT = 1e-4
"""Eigenvalues nearer to zero than this, over the lowest bending one, are soft; and are solved for to this change."""
CLEAR = 10.0
"""Times that limit beyond which a rough estimate of the nearest eigenvalue says that none is soft."""


@dataclass(frozen=True)
class Decision:
    """An ``index``, the half width of the count's ``band``, and quotients ``inside`` it with their ``uncertainty``."""

    index: Index
    band: float
    inside: np.ndarray
    uncertainty: np.ndarray


@dataclass(frozen=True)
class NearZero(Quotients):
    """Soft eigenvalues in ascending order; ``firm`` others are negative, and the ``rest`` is zero."""

    firm: int
    rest: int

    def at(self, places: list[int], rest: int) -> NearZero:
        """Those at some places, and another number of other zeros."""
        vectors = [self.vectors[i] for i in places]
        return NearZero(self.values[places], vectors, self.uncertainty[places], self.firm, rest)

    def counts(self, modes: Sequence[SoftMode], tolerance: float) -> tuple[int, int, int]:
        """Numbers of negative, zero and undecided eigenvalues of a state, by its ``modes``, which are these.

        Those that are decided have a sign; others are undecided, and zero, too, within the ``tolerance`` of a count.
        """
        undecided = [abs(v) for m, v in zip(modes, self.values.tolist(), strict=True) if not m.decided]
        negative = self.firm + sum(m.decided and m.value < 0 for m in modes)
        return negative, self.rest + sum(v <= tolerance for v in undecided), len(undecided)


def decide(found: Factored) -> Decision:
    """Count at a state, and decide eigenvalues within the band by their Rayleigh quotients."""
    index, inertia = found.count(), found.inertia
    inside, least = index.zero - found.drifts, ZERO_BAND * inertia.scale
    if inside == 0 or inertia.resolution <= least:
        return Decision(index, inertia.tolerance, np.zeros(0), np.zeros(0))
    if inertia.resolution > 1e6 * inertia.scale:
        raise ConvergenceError(
            f"Eigenvalues up to {inertia.resolution:.2g} are within round-off of the count, {inertia.scale:.2g} is the "
            "lowest of bending: the state, or a stiffness, is out of all proportion to it."
        )
    if inside > MANY:
        raise ConvergenceError(
            f"{inside} eigenvalues are within round-off of the count, {inertia.resolution:.2g} in the metric: the mesh "
            "is too fine for this rod; use fewer elements of a higher degree."
        )
    q = found.inside_band(inside, least=least)
    index = replace(index, negative=index.negative + q.negative, zero=q.zero + found.drifts)
    return Decision(index, inertia.tolerance, q.values, q.uncertainty)


def resolve(found: Factored) -> tuple[int, int]:
    """Least and greatest index of a state: between the two is what is zero to working accuracy."""
    index = found.count()
    if (near := index.zero - found.drifts) <= 0:
        return index.negative, index.negative
    q = found.inside_band(near, NULL)
    return index.negative + q.negative, index.negative + q.negative + q.zero


def soft_limit(inertia: Inertia) -> float:
    """Distance from zero within which an eigenvalue may be soft: in the band of round-off its quotient decides."""
    return max(SOFT * inertia.scale, inertia.tolerance)


def near_zero(found: Factored, least: int = 0) -> NearZero:
    """Soft eigenvalues at a state, and the ``least`` number nearest zero whatever their size, without symmetries."""
    inertia, index = found.inertia, found.count()
    inside = index.zero - found.drifts
    members = _candidates(found, soft_limit(inertia), inside, least)
    if members is None:
        return NearZero(np.zeros(0), [], np.zeros(0), index.negative, index.zero)
    q = found.quotients(members, TOLERANCE * inertia.scale)
    # the count has the nearest ones as zero: next to its tolerance a quotient and the count need not agree
    counted = np.argsort(abs(q.values))[inside:]
    firm = index.negative - int((q.values[counted] < 0).sum())
    order = np.argsort(q.values)
    values, uncertainty = q.values[order], q.uncertainty[order]
    # in a wide band of round-off most eigenvalues are distinct from zero by their quotients
    away = abs(values)
    soft = (away < SOFT * inertia.scale) | (away <= uncertainty) | (np.argsort(np.argsort(away)) < least)
    vectors = [members[i] for i in order[soft]]
    firm += int((values[~soft] < 0).sum())
    return NearZero(values[soft], vectors, uncertainty[soft], firm, found.drifts + int((values[~soft] == 0).sum()))


def _candidates(found: Factored, limit: float, inside: int, least: int) -> list[PETSc.Vec] | None:
    """Vectors of eigenvalues within the ``limit``, ``inside`` in a count, or ``least``; None if all are far off."""
    inertia, number = found.inertia, max(inside, least) + SPARE
    with inertia.afresh():  # whatever was computed before, the same result
        if not inside + least and abs(found.nearest(1, ROUGH)[0][0]) > CLEAR * limit:
            return None
        values, vectors = found.nearest(number, SOFT)
        while len(values) == number < MANY and (abs(values) < limit).all():
            number *= 2
            values, vectors = found.nearest(number, SOFT)
        # what is far from zero need not be as sharp: the values there lie dense on coarse meshes, and converge slowly
        if close := int((abs(values) < CLEAR * SOFT * inertia.scale).sum()):
            sharp = found.nearest(close, NULL, spare=number - close)
            values, vectors = np.append(sharp[0], values[close:]), [*sharp[1], *vectors[close:]]
    chosen = np.flatnonzero((abs(values) < limit) | (np.arange(len(values)) < least))
    if len(chosen) < inside or len(chosen) == number:
        raise ConvergenceError(
            f"{inside} or more eigenvalues are within {limit:.2g} of zero and are not distinct: use fewer elements of "
            "a higher degree."
        )
    return [vectors[i] for i in chosen]

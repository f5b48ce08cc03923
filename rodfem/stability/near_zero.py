r"""The eigenvalues near zero at a state, and what round-off leaves open of each.

The uncertainty on one mesh is the larger of two numbers: the round-off of the Rayleigh quotient
(:func:`~rodfem.stability.round_off.quotient_error`), and that of the state itself, which Newton's method solves for to
:data:`~rodfem.fem.newton.TOLERANCE`.  What the mesh adds to that a richer one tells
(:mod:`rodfem.adaptivity.soft_states`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE
from rodfem.stability.inertia import NULL, ROUGH, Factored, Index, Inertia
from rodfem.stability.round_off import MANY, SPARE, quotient_error
from rodfem.stability.soft_mode import Judgement, SoftMode

SOFT = 1e-4
"""Eigenvalues nearer to zero than this, over the lowest bending eigenvalue, are soft."""
FIRM = 1e-4
"""Relative change at which eigenvalues have converged that are not soft."""
CLEAR = 10.0
"""Times that limit beyond which a rough estimate of the nearest eigenvalue says that none is soft."""


@dataclass(frozen=True)
class NearZero:
    """Soft eigenvalues of a state, their ``values`` in ascending order, ``vectors``, and ``uncertainty`` on the mesh.

    ``firm`` is the number of negative eigenvalues that are not among them, ``zero`` that of zeros that are not.
    """

    values: np.ndarray
    vectors: list[PETSc.Vec]
    uncertainty: np.ndarray
    firm: int
    zero: int


def soft_limit(inertia: Inertia) -> float:
    """Distance from zero within which an eigenvalue may be soft: in the band of round-off its quotient decides."""
    return max(SOFT * inertia.scale, inertia.tolerance)


def near_zero(found: Factored, index: Index | None = None, least: int = 0) -> NearZero:
    """Soft eigenvalues at a state, symmetries left out; the vectors that the next state starts from stay.

    ``index`` is the count that made the factors, None before it; the ``least`` number of eigenvalues nearest zero are
    soft whatever their size.  Raises :class:`ConvergenceError` where there are too many of them.
    """
    inertia = found.inertia
    index, limit = index or found.count(), soft_limit(inertia)
    inside = index.zero - found.drifts
    number = max(inside, least) + SPARE
    with inertia.afresh():  # whatever was computed before, the same result
        if not inside + least and abs(found.nearest(1, ROUGH)[0][0]) > CLEAR * limit:
            return NearZero(np.zeros(0), [], np.zeros(0), index.negative, index.zero)
        values, vectors = found.nearest(number, FIRM)
        while (abs(values) < limit).all() and number < MANY:
            number *= 2
            values, vectors = found.nearest(number, FIRM)
        # what is far from zero need not be as sharp: the values there lie dense on coarse meshes, and converge slowly
        close = int((abs(values) < CLEAR * SOFT * inertia.scale).sum())
        if close:
            sharp = found.nearest(close, NULL, spare=number - close)
            values, vectors = np.append(sharp[0], values[close:]), [*sharp[1], *vectors[close:]]
    chosen = np.flatnonzero((abs(values) < limit) | (np.arange(number) < least))
    if len(chosen) < inside or len(chosen) == number:
        raise ConvergenceError(
            f"{inside} or more eigenvalues are within {limit:.2g} of zero and are not told apart: use fewer elements "
            "of a higher degree."
        )
    members = [vectors[i] for i in chosen]
    quotients = np.array([v.dot(found.matrix * v).real for v in members]) + found.shift
    floor = TOLERANCE * inertia.scale
    uncertainty = np.array([max(quotient_error(found.matrix, v), floor) for v in members])
    # the count has the nearest ones as zero: beside its tolerance a quotient and the count need not agree
    counted = np.argsort(abs(quotients))[inside:]
    firm = index.negative - int((quotients[counted] < 0).sum())
    order = np.argsort(quotients)
    values, uncertainty = quotients[order], uncertainty[order]
    # in a wide band of round-off most eigenvalues are told from zero by their quotients
    away = abs(values)
    soft = (away < SOFT * inertia.scale) | (away <= uncertainty) | (np.argsort(np.argsort(away)) < least)
    vectors = [members[i] for i, is_soft in zip(order, soft, strict=True) if is_soft]
    firm += int((values[~soft] < 0).sum())
    return NearZero(values[soft], vectors, uncertainty[soft], firm, found.drifts + int((values[~soft] == 0).sum()))


def judge(found: NearZero, modes: Sequence[SoftMode], tolerance: float) -> Judgement:
    """Numbers of eigenvalues of a state with its ``modes``, decided or not.

    ``found`` are these modes as the mesh has them.  Those that are decided have a sign; others are undecided, and zero,
    too, within the ``tolerance`` of a count, as in every count.
    """
    told = [m for m in modes if m.decided]
    negative = found.firm + sum(m.value < 0 for m in told)
    zero = sum(not m.decided and abs(v) <= tolerance for m, v in zip(modes, found.values.tolist(), strict=True))
    return Judgement(negative, found.zero + zero, len(modes) - len(told), tuple(modes))

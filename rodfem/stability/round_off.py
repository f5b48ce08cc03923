r"""Round-off of an inertia count, and the decision on eigenvalues within it.

The factors of ``S`` are the exact ones of a matrix that differs by about ``eps |S|``.  An eigenvalue relative to the
metric is then uncertain by that over the smallest mass: ``|S| ~ 1/h``, ``m ~ h`` for linear elements of size h, so that
a count decides nothing within the *band* ``10 eps |S| / m ~ eps/h^2``.  That is the bound for the roughest vector.
For one smooth vector y of metric norm 1 independent errors of the entries of S change the quotient ``y.Sy`` by about

    eps (sum_ij (S_ij y_i y_j)^2)^(1/2),

smaller by some powers of h.  Eigenvalues inside the band are therefore decided by their vectors, and count as zero only
where ten times this exceeds their magnitude.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import rounding
from rodfem.stability.inertia import NULL, ZERO_BAND, Factored, Index

MANY = 100
"""Most eigenvalues in the band that are decided one by one."""
WILD = 1e6
"""Half width of the band, over the lowest bending eigenvalue, above which nothing is decided."""
DECIDED = 1e-3
"""Relative accuracy of eigenvalues that decide a sign."""
FAR = 1e-2
"""Eigenvalue, over the lowest bending one, above which a relative accuracy of 1e-3 tells it from zero."""
SPARE = 2
"""Vectors more than there are eigenvalues in the band."""


@dataclass(frozen=True)
class Decision:
    """An ``index``, the half width of what counted as zero, and the eigenvalues inside the band of the count.

    Attributes
    ----------
    band
        Half width of the band in which the inertia alone decides nothing, relative to the system's metric.
    inside
        Rayleigh quotients of the eigenvalues inside the band, symmetry modes left out.
    uncertainty
        What round-off in the matrix may make of each of them: those smaller than theirs are counted as zero.
    """

    index: Index
    band: float
    inside: np.ndarray
    uncertainty: np.ndarray


def decide(found: Factored) -> Decision:
    """Count at a state; eigenvalues within the band are decided by their Rayleigh quotients.

    Raises :class:`ConvergenceError` where there are too many of those.

    Factorisations are those of the count alone, the last of which serves :meth:`~Factored.nearest` here and afterwards.
    """
    index, inertia = found.count(), found.inertia
    known = found.drifts
    inside = index.zero - known
    least = ZERO_BAND * inertia.scale
    if inside == 0 or inertia.resolution <= least:
        return Decision(index, inertia.tolerance, np.zeros(0), np.zeros(0))
    if inertia.resolution > WILD * inertia.scale:
        raise ConvergenceError(
            f"Eigenvalues up to {inertia.resolution:.2g} are within round-off of the count, {inertia.scale:.2g} is the "
            "lowest of bending: the state, or a stiffness, is out of all proportion to it."
        )
    if inside > MANY:
        raise ConvergenceError(
            f"{inside} eigenvalues are within round-off of the count, {inertia.resolution:.2g} in the metric: the mesh "
            "is too fine for this rod; use fewer elements of a higher degree."
        )
    theta, vectors = inside_band(found, inside)
    doubt = np.array([max(quotient_error(found.matrix, v), least) for v in vectors])
    negative = int((theta < -doubt).sum())
    zero = int((abs(theta) <= doubt).sum())
    index = replace(index, negative=index.negative + negative, zero=zero + known)
    return Decision(index, inertia.tolerance, theta, doubt)


def inside_band(found: Factored, number: int, accuracy: float = DECIDED) -> tuple[np.ndarray, list[PETSc.Vec]]:
    """Rayleigh quotients and vectors of the ``number`` eigenvalues inside the band of the count, which were ``found``.

    Those near zero have the relative ``accuracy``, the others are accurate enough for their signs.  Raises
    :class:`ConvergenceError` where others are found than were counted.
    """
    inertia = found.inertia
    theta, vectors = found.nearest(number + SPARE, DECIDED)
    vectors = [vectors[i] for i in np.argsort(abs(theta))]
    small = int((abs(theta) < FAR * inertia.scale).sum())
    if accuracy < DECIDED and small:  # the signs of all others are known
        vectors[:small] = found.nearest(small, accuracy)[1]
        inertia.vectors = list(vectors)
    vectors = vectors[:number]
    theta = np.array([v.dot(found.matrix * v) for v in vectors]) + found.shift
    if (abs(theta) > 2 * inertia.tolerance).any():
        raise ConvergenceError(
            f"{number} eigenvalues are within round-off of the count, {inertia.tolerance:.2g} in the metric, and are "
            "not told apart: take larger elements, or a lower degree."
        )
    return theta, vectors


def resolve(found: Factored) -> tuple[int, int]:
    """Least and greatest index of a state, small eigenvalues judged by their Rayleigh quotients.

    Those within the tolerance of zero are told from zero down to their round-off; what is left open between the two
    numbers is zero to working accuracy.  Modes of symmetries are left out.
    """
    index = found.count()
    near = index.zero - found.drifts
    if near <= 0:
        return index.negative, index.negative
    theta, vectors = inside_band(found, near, NULL)
    doubt = np.array([quotient_error(found.matrix, v) for v in vectors])
    return index.negative + int((theta < -doubt).sum()), index.negative + int((theta <= doubt).sum())


def quotient_error(matrix: PETSc.Mat, y: PETSc.Vec) -> float:
    """Ten times the change of ``y.Sy`` by independent relative errors eps of all entries of S."""
    return 10 * rounding(matrix, y, y)

"""The two ways along a null vector: whether the branches that leave there are mirror images of each other.

Two sides of a pitchfork may be mirror images in their plane, at the same loads, energies and stretches, and differ in
what they do across it: then no symmetry of the rod carries one into the other.  The eigenvalues nearest zero tell, and
determinants what is beyond.  Beside a branch point one eigenvalue is so small that the round-off of factors is a
visible part of it, and of the determinant: that is taken at a shift clear of all eigenvalues, ``det(S - sigma M)``,
which mirror images share as well.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.switching import between
from rodfem.diagram.equivalence import equivalent
from rodfem.stability.inertia import NULL, Factored
from rodfem.tolerances import LOCATED, SAME_STATE

SAME_DETERMINANT = 1e-3
"""Logarithm of the ratio of two determinants, or of two eigenvalues, that are one: of the last iterates of Newton's
method, and of meshes that are not symmetric."""
LOOKED_AT = 3
"""Eigenvalues nearest zero, beyond those that count as zero, between which the shift lies."""


def are_images(
    solver: BranchSolver, special: SpecialPoint, a: Point, b: Point, alike: Callable[[Point, Point, float], bool]
) -> bool:
    """Whether the first points ``a``, ``b`` of branches that leave ``special`` in opposite ways are of mirror images.

    They are compared at one load, by ``alike`` where the ``solver`` moves one to that of the other.  The metric need
    not share the symmetry: points at one distance in it need not be mirror images themselves.
    """
    if not equivalent(a, b, solver.units):
        # one that turns at a fold just beside the branch point is there as near to the other side as round-off
        load, width = special.point.load, LOCATED * special.located_to
        if min(a.load, b.load) < load - width and max(a.load, b.load) > load + width:
            return False
        a, b = sorted((a, b), key=lambda p: abs(p.load - special.point.load))
        there = between(solver, special, b, a.load)
        if there is None or not alike(a, there, SAME_STATE):
            return False
        b = there
    if (a.negative, a.zero) != (b.negative, b.zero):
        return False
    if a.mesh == b.mesh and not _as_stable(solver.inertia.at, a, b):
        return False
    return solver.space is None or _as_stable(solver.space.at, a, b)


def _as_stable(at: Callable[[PETSc.Vec], Factored], a: Point, b: Point) -> bool:
    """Whether two states, whose second variations are those ``at`` them, have the same index and determinant."""
    indices = [at(point.x).count() for point in (a, b)]
    if indices[0] != indices[1]:
        return False
    first, second = (_nearest(at(point.x), indices[0].zero) for point in (a, b))
    differ = abs(first.values - second.values) > SAME_DETERMINANT * abs(first.values) + first.noise
    # of a zero the mesh makes a value as it lies to the elements: two of one sign are alike
    if (differ & ~(first.zero & second.zero & (first.values * second.values > 0))).any():
        return False
    widest = int(np.argmax(np.diff(first.values)))
    shift = float(first.values[widest : widest + 2].mean())
    shifted = [_shifted(at(point.x), shift) for point in (a, b)]
    (below, size), (other, another) = shifted
    return below == other and abs(size - another) <= SAME_DETERMINANT


class _Nearest(NamedTuple):
    """Eigenvalues nearest zero, ascending, whether each counts as zero, and the round-off of those; 0 for others."""

    values: np.ndarray
    zero: np.ndarray
    noise: np.ndarray


def _nearest(found: Factored, zero: int) -> _Nearest:
    """Those that count as ``zero``, and a few more."""
    found.count()
    values, vectors = found.nearest(zero + LOOKED_AT, NULL)
    order = np.argsort(values)
    near = abs(values) <= found.inertia.tolerance
    noise = np.array([found.noise(v) for v in vectors]) * near
    return _Nearest(values[order], near[order], noise[order])


def _shifted(found: Factored, shift: float) -> tuple[int, float]:
    """Number of eigenvalues below a ``shift``, and the logarithm of the size of the determinant there."""
    return found.below(shift), found.factors.determinant()

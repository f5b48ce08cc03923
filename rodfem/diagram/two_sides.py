"""The two ways along a null vector: whether the branches that leave there are mirror images of each other.

Two sides of a pitchfork may be mirror images in their plane, at the same loads, energies and stretches, and differ in
what they do across it: then no symmetry of the rod carries one into the other.  Determinants tell.  Beside a branch
point one eigenvalue is so small that round-off is a visible part of it, and of the determinant: that is taken at a
shift clear of all eigenvalues, ``det(S - sigma M)``, which the mirror images share as well.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.switching import between
from rodfem.diagram.equivalence import equivalent
from rodfem.stability.inertia import Factored
from rodfem.tolerances import SAME_STATE

SAME_DETERMINANT = 1e-3
"""Logarithm of the ratio of two determinants that are one: of the last iterates of Newton's method, and of meshes that
are not symmetric."""
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
        a, b = sorted((a, b), key=lambda p: abs(p.load - special.point.load))
        there = between(solver, special, b, a.load)
        if there is None or not alike(a, there, SAME_STATE):
            return False
        b = there
    if (a.negative, a.zero) != (b.negative, b.zero):
        return False
    apart = abs(a.determinant - b.determinant) if a.mesh == b.mesh else 0.0  # nan where it is not known
    if apart > SAME_DETERMINANT and not _as_stable(solver.inertia.at, a, b):
        return False
    space = solver.space
    return space is None or _as_stable(space.at, a, b)


def _as_stable(at: Callable[[PETSc.Vec], Factored], a: Point, b: Point) -> bool:
    """Whether two states, whose second variations are those ``at`` them, have the same index and determinant."""
    first = at(a.x)
    index = first.count()
    values = np.sort(first.nearest(index.zero + LOOKED_AT)[0])
    widest = int(np.argmax(np.diff(values)))
    shift = float(values[widest : widest + 2].mean())
    below, determinant = first.below(shift), first.factors.determinant()
    second = at(b.x)
    return (
        second.count() == index
        and second.below(shift) == below
        and abs(second.factors.determinant() - determinant) <= SAME_DETERMINANT
    )

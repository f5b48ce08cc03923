"""Mirror images of branches: of the two sides of a symmetric pitchfork only one is traced, and here is the other.

A discrete symmetry of the equations (:mod:`rodfem.deflation.discrete_symmetries`) carries a branch to another one, of
the same energies and indices, at the same loads.  A diagram shows that image where its ordinate has the opposite sign.
"""

from __future__ import annotations

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.discrete_symmetries import candidates, mirrors
from rodfem.tolerances import NEGLIGIBLE

CARRIED = 1e-3
"""Distance of a state's image from another state, over the distance of the two, below which the one is the other."""
OTHER = 1e-6
"""Difference of two ordinates, relative to the greatest one, above which they are two; one below it has no side."""
SHARES = (0.5, 1.0)
"""Places along a branch, as shares of its rows, at whose states an image is asked for."""


def image_of(branch: Branch, solver: BranchSolver) -> str:
    """The symmetry, in words, that carries a branch to one with the opposite ordinate; empty where there is none.

    It is one of the equations at the loads of two states, one within the ``branch`` and its last one, and takes the
    ordinates of both to their opposites, to round-off.  States of other meshes than that of ``solver`` are left out.
    """
    points = [point for point in branch.points if point.mesh == solver.mesh]
    chosen = [points[round(share * (len(points) - 1))] for share in SHARES] if points else []
    size = max([solver.units.ordinate, *(abs(point.ordinate) for point in points)])
    if any(abs(point.ordinate) <= OTHER * size for point in chosen) or not chosen:
        return ""
    system, phase = solver.system, solver.system.phase
    found = candidates(system)
    for point in chosen:  # the ordinate, which few of them take to its opposite, costs less than the equations
        opposite = [
            mirror
            for mirror in found
            if abs(solver.shape.ordinate(mirror(system, point.x)) + point.ordinate) <= NEGLIGIBLE * size
        ]
        found = mirrors(system, point.x, opposite) if opposite else []
    system.phase = phase
    found.sort(key=lambda mirror: (mirror.reversal, -sum(mirror.signs), mirror.signs))
    return found[0].in_words() if found else ""


def other_ordinates(branch: Branch, first: Point, image: Point, solver: BranchSolver) -> str:
    """Words for the symmetry that carries a ``branch`` to one of other ordinates; empty where it keeps them, or signs.

    It carries the ``first`` state after the branch point to the state ``image`` on the other side.  States of other
    meshes than that of ``solver`` are left out.
    """
    system, points = solver.system, [point for point in branch.points if point.mesh == solver.mesh]
    near = CARRIED * system.norm(first.x - image.x)
    found, phase = [m for m in candidates(system) if system.norm(m(system, first.x) - image.x) <= near], system.phase
    found = mirrors(system, first.x, found) if found else []  # a small imperfection carries the one near the other, too
    system.phase = phase
    size = max([solver.units.ordinate, *(abs(point.ordinate) for point in points)])
    chosen = [points[round(share * (len(points) - 1))] for share in SHARES] if points else []
    for mirror in found:
        there = [abs(solver.shape.ordinate(mirror(system, point.x))) for point in chosen]
        if all(abs(value - abs(point.ordinate)) <= OTHER * size for value, point in zip(there, chosen, strict=True)):
            return ""
    return found[0].in_words() if found else ""

"""Branch switching: the directions in which branches leave a branch point, and their first points (Keller 1977)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import PITCHFORK, TRANSCRITICAL, VERTICAL_BRANCH, Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.first_equilibrium import STILL
from rodfem.continuation.singular_points import LEVEL
from rodfem.fem.newton import correct
from rodfem.linalg.orthogonal import project_out
from rodfem.tolerances import TINY

NEAREST = 1e-3
"""Least distance of the first point of a branch: nearer to the branch point eigenvalues are zero to round-off."""
FIRST = 0.05
"""Distance of the first point of a branch from the branch point that it leaves."""
SHORTEST = 1e-4
"""Amplitude, in the metric, below which no further one is tried from a branch point."""
CLOSE, STEEP = 2.0, 50.0
"""How far from its prediction the first point of a branch may lie, in amplitudes: usually, and at most."""
FIXED = 1e-6
"""Norm of a unit direction's image by a symmetry below which it moves nothing."""


def directions(solver: BranchSolver, special: SpecialPoint) -> list[PETSc.Vec]:
    """Unit directions in which branches may leave a branch point, one for each circle of equivalent ones.

    In the plane of the null vectors and the branch's own tangent, what is orthogonal to the tangent; of the null
    vectors that a continuous symmetry carries into each other one is kept.
    """
    system, tangent = solver.system, special.point.tangent
    known = [] if tangent is None else [tangent.copy()]
    out: list[PETSc.Vec] = []
    candidates = list(special.null_vectors)
    if abs(special.point.slope) < LEVEL * abs(system.scene.span[1] - system.scene.span[0]):
        candidates.append(_load_response(solver, special))
    for candidate in candidates:
        d = candidate.copy()
        project_out(d, known, system.metric, times=2)
        size = system.norm(d)
        if size < 0.1 * max(system.norm(candidate), TINY):
            continue
        d.scale(1.0 / size)
        out.append(d)
        known.append(d)
        for image in system.equivalent_directions(special.point.x, d):
            if (size := system.norm(image)) > FIXED:
                known.append(image / size)
    return out


def _load_response(solver: BranchSolver, special: SpecialPoint) -> PETSc.Vec:
    """Change of state with the load off the null vectors: the other branch where a side branch ends.

    The Jacobian is singular there, and the load is orthogonal to its null vectors up to an error that its inverse would
    blow up: it is shifted, which changes the answer by about as much as the shift, :data:`STILL`, relative to it.
    """
    system = solver.system
    out = system.new_vector()
    x = special.point.x
    system.set_phase(x)
    system.at(x).factor(solver.axis, STILL * system.stiffness_scale)
    system.solve(solver.axis, out)
    project_out(out, special.null_vectors, system.metric)
    return out


def leave(solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec, first: float) -> Point | None:
    """First point of the branch that leaves ``special`` along ``direction``, about ``first`` away, or None.

    The amplitude is halved until the point lies where the direction says, within half of its distance.  Where that
    fails, a family of equilibria may leave at once, at each of which the Jacobian is singular (an elastica whose ends
    meet turns as a rigid body about any axis): then Newton's method is damped along the family.  ``solver`` has the
    mesh, ``first`` is a length in the metric.  A transcritical branch whose load changes much faster than its state is
    farther away: it is tried last.
    """
    system = solver.system
    row, before = solver.row(direction), system.damping
    dampings = dict.fromkeys((before, before or solver.inertia.tolerance))
    for damping, reach in (*((damping, CLOSE) for damping in dampings), (before, STEEP)):
        system.damping, amplitude = damping, first
        while amplitude > SHORTEST:
            x = special.point.x + direction * amplitude
            outcome = correct(system, x, row, reach=reach * amplitude)
            if outcome.converged:
                apart = system.distance(special.point.x, x)
                return solver.point(x, apart, solver.tangent(row, at=x), outcome)
            amplitude /= 2
    system.damping = before
    return None


def start_branch(
    solver: BranchSolver,
    special: SpecialPoint,
    direction: PETSc.Vec,
    ways: int,
    bounds: tuple[float, float],
    depth: int,
) -> tuple[list[Point], int | None] | None:
    """First two points, and first index, of the branch that leaves ``special`` along ``direction``, one of ``ways``.

    The first one is the special point, and the index that right after it, None where it is not known: eigenvalues that
    stay zero on the trunk without a symmetry need not on the branch.  The second one is nearer where the load has
    turned back before it, or its index is not that with which the branch begins: the fold, or the branch point, that
    says why is on the branch.  So it is where its load is out of the ``bounds``.  Nor is it farther away than the
    branch that it leaves began, from a ``depth`` of 2 on: next to a nearly double point branches are short.  ``solver``
    has the mesh.  None where no point is found.
    """
    amplitude = FIRST if depth < 2 else max(min(FIRST, special.point.arclength), NEAREST)
    first, load = leave(solver, special, direction, amplitude), special.point.load
    if first is None:
        return None
    side = _side(solver, special, direction)
    still = special.point.zero - special.multiplicity - solver.system.active_drifts(special.point.x)

    def begins(at: float) -> int | None:
        return None if still else neighbouring_index(special, at, ways)

    while amplitude > NEAREST and _early(special, side, begins(first.load), first, bounds):
        amplitude /= 4
        first = leave(solver, special, direction, amplitude) or first
    if (first.load - load) * side < 0:
        words = f"a branch that leaves here turns back in a fold, less than {abs(first.load - load):.0e} away in load"
        special.note = special.note or words
    origin = replace(special.point, tangent=None, arclength=0.0, slope=solver.system.scalar(direction))
    span = solver.system.scene.span
    vertical = abs(first.slope) < VERTICAL * abs(span[1] - span[0])  # the load changes by round-off
    return [origin, first], None if vertical else begins(first.load)


def neighbouring_index(special: SpecialPoint, load: float, ways: int) -> int | None:
    """Index with which a branch begins that leaves towards ``load``; None where the trunk's does not determine it.

    By exchange of stability the eigenvalue that crosses zero has the sign opposite to that on the trunk at the same
    load.  Of one way to leave the eigenvalues of the other null vectors belong to a symmetry, and stay zero.
    """
    low, high = sorted((special.negative_before, special.negative_after))
    if special.test_function != "mu" or ways != 1 or high - low != special.multiplicity or not special.point.slope:
        return None
    ahead = (load - special.point.load) * special.point.slope > 0
    there = special.negative_after if ahead else special.negative_before
    return low if there == high else low + 1


def _side(solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec) -> float:
    """Sign of the load's change along a branch right after it leaves; zero where that is not asked for."""
    if special.test_function != "mu":
        return 0.0
    if special.law is not None and special.law.kind != TRANSCRITICAL:
        return special.law.side if PITCHFORK in special.law.kind else 0.0
    # of a transcritical branch one side may turn back at once, in a fold: the slope is that right at the point
    near = leave(solver, special, direction, FIRST / 4 if special.law is None else NEAREST)
    return 0.0 if near is None else float(np.sign(near.load - special.point.load))


def _early(special: SpecialPoint, side: float, begins: int | None, first: Point, bounds: tuple[float, float]) -> bool:
    """Whether something happens on a branch before its point ``first``.

    Its load is out of ``bounds``, has turned back to another ``side``, or its index is not the one that it ``begins``
    with.
    """
    if not bounds[0] <= first.load <= bounds[1]:
        return True
    if special.law is not None and special.law.kind == VERTICAL_BRANCH:
        return False
    if begins is not None and not first.negative <= begins <= first.negative + first.zero:
        return True
    return min((first.load - special.point.load) * side, first.slope * side) < 0

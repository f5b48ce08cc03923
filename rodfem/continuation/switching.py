"""Branch switching: the directions in which branches leave a branch point, and their first points (Keller 1977)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import VERTICAL_BRANCH, Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.first_equilibrium import STILL
from rodfem.continuation.normal_form import SEEN
from rodfem.continuation.singular import SingularSystem
from rodfem.continuation.singular_points import LEVEL, Change, singular_point
from rodfem.continuation.states_between import solve_at_load
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import correct
from rodfem.linalg.orthogonal import across, project_out
from rodfem.stability.round_off import decide
from rodfem.tolerances import TINY

NEAREST = 1e-3
"""Distance of a fold from the branch point that its branch leaves, within which eigenvalues are zero to round-off."""
FIRST = 0.05
"""Distance of the first point of a branch from the branch point that it leaves; at least it is :data:`NEAREST`."""
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


def leave(
    solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec, first: float, shortest: float = SHORTEST
) -> Point | None:
    """First point of the branch that leaves ``special`` along ``direction``, about ``first`` away, or None.

    The amplitude is halved until the point lies where the direction says, within half of its distance.  Where that
    fails, a family of equilibria may leave at once, at each of which the Jacobian is singular (an elastica whose ends
    meet turns as a rigid body about any axis): then Newton's method is damped along the family.  ``solver`` has the
    mesh, ``first`` is a length in the metric.  A transcritical branch whose load changes much faster than its state is
    farther away: it is tried last.  No amplitude is tried below the ``shortest``.
    """
    system = solver.system
    row, before = solver.row(direction), system.damping
    dampings = dict.fromkeys((before, before or solver.inertia.tolerance))
    for damping, reach in (*((damping, CLOSE) for damping in dampings), (before, STEEP)):
        system.damping, amplitude = damping, first
        while amplitude > shortest:
            x = special.point.x + direction * amplitude
            outcome = correct(system, x, row, reach=reach * amplitude)
            if outcome.converged:
                apart = system.distance(special.point.x, x)
                return solver.point(x, apart, solver.tangent(row, at=x), outcome)
            amplitude /= 2
    system.damping = before
    return None


def between(solver: BranchSolver, special: SpecialPoint, outer: Point, load: float) -> Point | None:
    """State at ``load`` of a branch between ``special``, which it leaves, and its point ``outer``; None without one.

    ``solver`` has the mesh.  The state is on the side of ``outer``: what leaves in the opposite way is another one.
    """
    chord = outer.x - special.point.x
    ends = replace(special.point, arclength=0.0), replace(outer, arclength=1.0)

    def along(part: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        return special.point.x + chord * part, chord

    try:
        x, part, outcome = solve_at_load(solver, along, *ends, load)
    except ConvergenceError:  # the load is none of those between
        return None
    return solver.point(x, part * outer.arclength, solver.load_tangent(x, True), outcome)


def start_branch(
    special: SpecialPoint,
    direction: PETSc.Vec,
    name: str,
    parent: tuple[str, int],
    depth: int,
    solver: BranchSolver,
    ways: int,
    bounds: tuple[float, float],
) -> Branch | None:
    """Branch that leaves ``special`` along ``direction``, one of ``ways``: its first two points, the special one first.

    The second is nearer where the load has turned back before it, or its index is not that with which the branch
    begins: the fold, or the branch point, that says why is on the branch.  So it is where its load is out of bounds.
    Nor is it farther away than the branch that it leaves began: beside a nearly double point branches are short.
    Eigenvalues that stay zero on the trunk without a symmetry need not on the branch: its index is not known then.
    ``name``, ``parent`` and ``depth`` are recorded in the branch; ``solver`` has the mesh, and ``bounds`` are the least
    and the greatest load.
    """
    amplitude = FIRST if depth < 2 else max(min(FIRST, special.point.arclength), NEAREST)
    first = leave(solver, special, direction, amplitude)
    if first is None:
        return None
    origin = replace(special.point, tangent=direction, arclength=0.0, slope=solver.system.scalar(direction))
    fold = fold_beside(solver, special, direction) if ways == 1 else None
    if fold is not None and (beyond := leave(solver, special, direction, NEAREST)) is not None:
        return _through(special, fold, Branch(name, parent, depth, [origin, beyond]))
    side = _side(solver, special, direction)
    still = special.point.zero - special.multiplicity - solver.system.active_drifts(special.point.x)

    def known(load: float) -> int | None:
        return None if still else index_beside(special, load, ways)

    while amplitude > NEAREST and (
        not bounds[0] <= first.load <= bounds[1] or _changed(special, side, known(first.load), first)
    ):
        amplitude /= 4
        first = leave(solver, special, direction, amplitude) or first
    if special.law is not None and "pitchfork" in special.law.kind and (first.load - special.point.load) * side < 0:
        apart = abs(first.load - special.point.load)
        words = f"a branch that leaves here turns back in a fold, less than {apart:.0e} away in load"
        special.note = special.note or words
    span = solver.system.scene.span
    vertical = abs(first.slope) < VERTICAL * abs(span[1] - span[0])  # the load changes by round-off
    begins = None if vertical else known(first.load)
    return Branch(name, parent, depth, [origin, first], begins=begins)


def _through(special: SpecialPoint, fold: SpecialPoint, branch: Branch) -> Branch:
    """The ``branch`` that leaves ``special`` with the ``fold`` before its second point."""
    branch.begins = index_beside(special, fold.point.load, 1)
    fold.negative_after = branch.points[1].negative
    fold.negative_before = fold.negative_after if branch.begins is None else branch.begins
    branch.insert(fold)
    return branch


def index_beside(special: SpecialPoint, load: float, ways: int) -> int | None:
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
    if special.law is not None and special.law.kind != "transcritical":
        return special.law.side if "pitchfork" in special.law.kind else 0.0
    # of a transcritical branch one side may turn back at once, in a fold: the slope is that right at the point
    near = leave(solver, special, direction, FIRST / 4 if special.law is None else NEAREST)
    return 0.0 if near is None else float(np.sign(near.load - special.point.load))


def fold_beside(solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec) -> SpecialPoint | None:
    """Fold of the branch that leaves ``special`` along ``direction``, nearer than :data:`NEAREST`; None without one.

    With ``load = load_b + b a + c a^2`` in the amplitude a there is one at ``a = -b/(2 c)``, and ``b^2/(4 |c|)`` from
    the branch point: eigenvalues and loads there are round-off next to each other.  The load as a function of the
    amplitude is regular at the branch point, and is interpolated about it.  Where the two loads differ by less than
    :data:`SEEN` times their uncertainty a note says so, and by less than that they are one.  ``solver`` has the mesh.
    """
    if special.test_function != "mu" or (special.law is not None and special.law.kind == VERTICAL_BRANCH):
        return None
    loads = []
    for amplitude in (NEAREST, -NEAREST):
        x = special.point.x + direction * amplitude
        if not correct(solver.system, x, solver.row(direction), reach=CLOSE * NEAREST).converged:
            return None
        loads.append(solver.system.scalar(x) - special.point.load)
    odd, even = (loads[0] - loads[1]) / 2, (loads[0] + loads[1]) / 2
    if odd * even >= 0 or abs(odd) >= 2 * abs(even):
        return None
    apart = odd * odd / (4 * abs(even))
    if apart <= SEEN * special.located_to:
        if apart > special.located_to:
            special.note = f"a branch that leaves here turns back in a fold that is {apart:.0e} away in load"
        return None
    guess = special.point.x + direction * (-NEAREST * odd / (2 * even))
    mode = special.null_vectors[0].copy()
    modes = [mode, *across(solver.inertia.metric, special.nearby, [mode])]
    found = SingularSystem(solver, modes, np.eye(len(modes))[:, :1], fold=True).solve(guess)
    if found is None:
        return None
    index = decide(solver.inertia.at(found.x)).index.negative
    place, change = solver.system.distance(special.point.x, found.x), Change(index, index, index)
    return singular_point(solver, found, place, direction, change, fold=True)


def _changed(special: SpecialPoint, side: float, begins: int | None, first: Point) -> bool:
    """Whether the load has turned back before the point ``first`` of a branch, or its index is another one there."""
    if special.law is not None and special.law.kind == VERTICAL_BRANCH:
        return False
    if begins is not None and not first.negative <= begins <= first.negative + first.zero:
        return True
    return min((first.load - special.point.load) * side, first.slope * side) < 0

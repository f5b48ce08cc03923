r"""Branch switching: the directions in which branches leave a branch point, and their first points (Keller 1977).

With null vectors ``a_1 ... a_n`` the reduced equations of Lyapunov and Schmidt select a few lines, and a null vector of
the eigensolver is on one by chance only.  At a distance ``A`` in the direction ``d(t) = cos t a_1 + sin t a_2`` of two
of them the state ``x`` and the load of ::

    F(x) + g M d'(t) = 0,        <d(t), x - x_0> = A,        <d'(t), x - x_0> = 0

are those of the rod held in that direction by a force ``g(t)`` across it: branches leave where it is zero, stable or
not.  Its zeros are bracketed around the circle, and each is a state on a branch, seen from the branch point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import PITCHFORK, TRANSCRITICAL, VERTICAL_BRANCH, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import VERTICAL, zero_between
from rodfem.continuation.first_equilibrium import STILL
from rodfem.continuation.singular_points import LEVEL
from rodfem.fem.newton import TOLERANCE, Correction, Limits, correct, linear_step, newton
from rodfem.linalg.orthogonal import combine, project_out
from rodfem.tolerances import TINY

NEAREST, FIRST = 1e-3, 0.05
"""Least distance of the first point of a branch from the branch point that it leaves, and the usual one: nearer to that
eigenvalues are zero to round-off."""
CLOSE, STEEP = 2.0, 50.0
"""How far from its prediction the first point of a branch may lie, in amplitudes: usually, and at most."""


def directions(solver: BranchSolver, special: SpecialPoint) -> list[PETSc.Vec]:
    """Unit directions in which branches may leave a branch point, orthogonal to the branch's own tangent.

    Of the null vectors that a continuous symmetry carries into each other one is kept.
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
            if (size := system.norm(image)) > 1e-6:  # else the symmetry leaves it where it is
                known.append(image / size)
    return out


def _load_response(solver: BranchSolver, special: SpecialPoint) -> PETSc.Vec:
    """Change of state with the load off the null vectors: the other branch where a side branch ends.

    The Jacobian is singular there, and its inverse would blow up the error of the load along them: it is shifted.
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

    The amplitude is halved until the point lies where the direction says.  Where that fails, a family of equilibria may
    leave at once, at each of which the Jacobian is singular (an elastica whose ends meet turns as a rigid body about
    any axis): then Newton's method is damped along the family.  A transcritical branch whose load changes much faster
    than its state is farther away: it is tried last.
    """
    system = solver.system
    row, before = solver.row(direction), system.damping
    dampings = dict.fromkeys((before, before or solver.inertia.tolerance))
    for damping, reach in (*((damping, CLOSE) for damping in dampings), (before, STEEP)):
        system.damping, amplitude = damping, first
        while amplitude > 1e-4:  # in the metric
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
    stay zero on the trunk without a symmetry need not on the branch.  The second one is before what happens early on
    the branch, and from a ``depth`` of 2 on no farther away than the branch that it leaves began: next to a nearly
    double point branches are short.  None where no point is found.
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
    load.
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
    """Whether a branch leaves the ``bounds``, turns back to another ``side``, or changes its index before ``first``."""
    if not bounds[0] <= first.load <= bounds[1]:
        return True
    if special.law is not None and special.law.kind == VERTICAL_BRANCH:
        return False
    if begins is not None and not first.negative <= begins <= first.negative + first.zero:
        return True
    return min((first.load - special.point.load) * side, first.slope * side) < 0


def lines(solver: BranchSolver, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Unit directions in which branches do leave a branch point with several null vectors of different motions.

    Of two null vectors they are the zeros of the force that holds the rod in a direction; or any one, of a circle of
    states, if all forces are what Newton's method leaves.  Of more, Newton's method is started in random directions.
    Each is taken once more as that in which what it finds is seen from the branch point.  The orthonormal null vectors,
    ``ways``, are returned where nothing is found.
    """
    for reach in (CLOSE, STEEP):  # a load may change much faster than the state
        if found := _weights(solver, special.point.x, ways, reach):
            return [combine(list(ways), weights) for weights in found]
    return list(ways)


def _weights(solver: BranchSolver, origin: PETSc.Vec, ways: Sequence[PETSc.Vec], reach: float) -> list[np.ndarray]:
    """Weights (n,) of the directions; states are a ``reach`` from their predictions at most, in amplitudes."""
    n, found = len(ways), list[np.ndarray]()
    if n == 2:
        least = TOLERANCE * FIRST * solver.system.stiffness_scale
        zeros = np.array(_zeros(lambda angle: _force(solver, origin, ways, angle, reach), least))
        tried = np.stack([np.cos(zeros), np.sin(zeros)], axis=1)
    else:
        tried = np.concatenate([np.eye(n), np.random.default_rng(n).normal(size=(12 * (n - 1), n))])
    for weights in tried:
        seen = _direction(solver, origin, ways, weights / np.linalg.norm(weights), reach)
        seen = seen if seen is None else _direction(solver, origin, ways, seen, reach)
        if seen is not None and all(abs(seen @ known) < 0.999 for known in found):
            found.append(seen)
    return found


def _direction(
    solver: BranchSolver, origin: PETSc.Vec, ways: Sequence[PETSc.Vec], weights: np.ndarray, reach: float
) -> np.ndarray | None:
    """Weights (n,) of the direction in which an equilibrium is, that is found in that of others; None without one."""
    direction = combine(list(ways), weights)
    x = origin + direction * FIRST
    if not correct(solver.system, x, solver.row(direction), reach=reach * FIRST).converged:
        return None
    away = solver.system.metric * (x - origin)
    seen = np.array([away.dot(way) for way in ways])
    return np.asarray(seen / np.linalg.norm(seen))


def _force(solver: BranchSolver, origin: PETSc.Vec, ways: Sequence[PETSc.Vec], angle: float, reach: float) -> float:
    """Force that holds the rod at an ``angle`` from the first of two ``ways``; nan where there is no such state."""
    system = solver.system
    along, across = (combine(list(ways), np.array([np.cos(t), np.sin(t)])) for t in (angle, angle + np.pi / 2))
    row, held, answer = solver.row(along), system.metric * across, system.new_vector()
    begin, force = origin + along * FIRST, 0.0
    x = begin.copy()

    def iteration(fresh: bool) -> Correction | None:
        nonlocal force
        system.set_phase(x)
        step = linear_step(system, x, row)
        if step is None or not system.solve(held, answer):
            return None
        # (J  M d'; d'^t M  0) by its Schur complement, of one row
        force = held.dot(x - origin - step) / held.dot(answer)
        step.axpy(force, answer)
        x.axpy(-1.0, step)
        return Correction(system.distance(x, begin), system.norm(step))

    return force if newton(iteration, Limits(reach=reach * FIRST)).converged else float("nan")


def _zeros(force: Callable[[float], float], least: float) -> list[float]:
    """Angles in half a circle at which a force is zero; one of them if all forces are below the ``least``."""
    angles = np.pi * (np.arange(49) + (np.sqrt(5) - 1) / 2) / 48  # on no axis of a symmetry
    values = np.array([force(angle) for angle in angles])
    if (abs(values) <= least).all():
        return [0.0]
    felt = 1e-6 * np.nanmax(abs(values), initial=0.0)  # round-off: a symmetry turns the direction
    return [
        zero_between(force, float(angles[i]), float(angles[i + 1]), 1e-4)  # in radian
        for i in np.flatnonzero(values[1:] * values[:-1] < 0)
        if max(abs(values[i : i + 2])) > felt
    ]

"""Equilibria between two neighbouring points of a branch: on a plane across it, or at a load."""

from __future__ import annotations

from collections.abc import Callable

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import hermite
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.newton import NewtonResult, correct
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE

EXACT = 1e-15
"""Arclength, in the metric, to which a load is located before it is set."""
CORRECTIONS = 3
"""Newton steps on the interpolated load that improve the arclength at which a state is expected."""
ON_THE_WAY = 0.5
"""Distance of a state from where it is expected, over that from the nearer neighbour, below which it is on the way."""
INTERPOLATED = 1e-7
"""Distance of a state from where it is expected, in the metric, that is the error of the interpolation."""
Curve = Callable[[float], tuple[PETSc.Vec, PETSc.Vec]]


def solve_at(solver: BranchSolver, curve: Curve, s: float) -> PETSc.Vec:
    """Equilibrium on the plane through ``curve(s)`` across its direction; raises :class:`ConvergenceError`."""
    start, direction = curve(s)
    system, row, before = solver.system, solver.row(direction), solver.system.damping
    try:  # beside a state that may move freely, where Newton's method slides away: with damping
        for system.damping in dict.fromkeys((before, before or solver.inertia.tolerance)):
            x = start.copy()
            if correct(system, x, row).converged:
                return x
    finally:
        system.damping = before
    raise ConvergenceError(
        f"No equilibrium near load {system.scalar(start):.8g} while locating a special point", SMALLER_STEPS
    )


def solve_at_load(
    solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float
) -> tuple[PETSc.Vec, float, NewtonResult]:
    """State at exactly ``load`` between two neighbours ``p``, ``q`` of a branch, its arclength, and the last iteration.

    Close to a branch point Newton's method at a fixed load fails, or ends on the other branch: far from where the
    ``curve`` that interpolates the branch is.  On planes across the branch it does not, and the load is a function of
    arclength there, whose zero is found.  ``solver`` has the mesh.  Raises :class:`ConvergenceError` where there is no
    such state.
    """
    system, s = solver.system, _expected(solver, curve, p, q, load)
    guess = curve(s)[0]
    x, outcome = solver.at_load(guess, load, reach=1.0)
    if outcome.converged:
        near = min(system.distance(p.x, x), system.distance(q.x, x))
        if load in (p.load, q.load) or system.distance(guess, x) < max(ON_THE_WAY * near, INTERPOLATED):
            return x, s, outcome
    if (p.load - load) * (q.load - load) >= 0:
        raise ConvergenceError(
            f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another load."
        )

    known = {p.arclength: p.load, q.arclength: q.load}  # there the equations may be singular

    def beyond(s: float) -> float:
        return (known[s] if s in known else system.scalar(solve_at(solver, curve, s))) - load

    margin = INSIDE * (q.arclength - p.arclength)
    s = zero_between(beyond, p.arclength, q.arclength, EXACT)
    s = min(max(s, p.arclength + margin), q.arclength - margin)
    x = solve_at(solver, curve, s)
    system.set_load(x, load)
    return x, s, outcome


def _expected(solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float) -> float:
    """Arclength between ``p`` and ``q`` at which the interpolated branch has a ``load``."""
    s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
    for _ in range(CORRECTIONS):
        x, direction = curve(s)
        slope = solver.system.scalar(direction)
        if slope:
            there = s + (load - solver.system.scalar(x)) / slope
            # never onto an end, at another load: beside a branch point that is a state of the other branch
            s = min(max(there, (p.arclength + s) / 2), (s + q.arclength) / 2)
    return s


def solve_beside(solver: BranchSolver, curve: Curve, s: float, aside: float) -> tuple[PETSc.Vec, float]:
    """Solve at ``s``, or at ``s + aside`` if the bordered matrix is singular there; returns state and parameter.

    ``solver`` has the mesh, and ``curve(s)`` returns a predicted state and the direction of the branch there.
    """
    try:
        return solve_at(solver, curve, s), s
    except ConvergenceError:
        return solve_at(solver, curve, s + aside), s + aside


def midpoint(solver: BranchSolver, a: Point, b: Point) -> Point | None:
    """Point half-way between two points of a branch; None where it is not between them."""
    return point_between(solver, a, b, (a.arclength + b.arclength) / 2)


def point_between(solver: BranchSolver, a: Point, b: Point, s: float) -> Point | None:
    """Point at arclength ``s`` between the points ``a`` and ``b`` of a branch of ``solver``; None where it is not."""
    try:
        x = solve_at(solver, lambda t: hermite(a, b, t), s)
    except ConvergenceError:
        return None
    whole = solver.system.distance(a.x, b.x)
    if max(solver.system.distance(a.x, x), solver.system.distance(x, b.x)) > whole:
        return None
    return solver.point(x, s, solver.tangent(solver.row(hermite(a, b, s)[1]), at=x))

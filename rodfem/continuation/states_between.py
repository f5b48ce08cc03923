"""Equilibria between two neighbouring points of a branch: on a plane across it, or at a load."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable
from typing import NamedTuple

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import ALIGNED, Knot, between
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
ASIDE = 1e-6
"""Distance beside a singular point at which the equations are solved, relative to the curve."""
APART = 1e-9
"""Least distance of two states of the curve, relative to it: two that are nearer tell no direction."""
STEADY = 3.0
"""Uncertainty of a result, in units of its change by one more step of Newton's method."""
SETTLES = 1e-2
"""Distance, in the metric, that a state which was solved for with damping may move without it."""
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


def point_between(solver: BranchSolver, a: Point, b: Point, s: float) -> Point | None:
    """Point at arclength ``s`` between the points ``a`` and ``b`` of a branch of ``solver``; None where it is not."""
    try:
        x = solve_at(solver, lambda t: between(a, b, t), s)
    except ConvergenceError:
        return None
    whole = solver.system.distance(a.x, b.x)
    if max(solver.system.distance(a.x, x), solver.system.distance(x, b.x)) > whole:
        return None
    return solver.point(x, s, solver.tangent(solver.row(between(a, b, s)[1]), at=x))


class Solved(NamedTuple):
    """An equilibrium ``x`` on the plane across the curve at ``s``: it is at ``arclength``, ``s`` or beside it.

    The ``tangent`` is the derivative of a curve through it.  One more step of Newton's method has ``left`` that much:
    the round-off of the state, by which equilibria that are solved for in another way differ.
    """

    s: float
    arclength: float
    x: PETSc.Vec
    tangent: PETSc.Vec
    left: PETSc.Vec


class EventCurve:
    """A curve from one state to another, through all that have been ``solved`` for between them, in order.

    Near a state that is solved for its error is that of the square of the distance from there: a few such states leave
    nothing of it but round-off where it matters.
    """

    def __init__(self, solver: BranchSolver, first: Knot, last: Knot) -> None:
        """The curve from the ``first`` to the ``last`` state; ``solver`` has the mesh."""
        self.solver, self.ends, self.length = solver, (first, last), last.arclength - first.arclength
        self.solved: list[Solved] = []
        self._knots: list[Knot] = [first, last]

    def __call__(self, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and direction at ``s``."""
        i = bisect(self._knots, s, 1, len(self._knots) - 1, key=lambda knot: knot.arclength)
        return between(self._knots[i - 1], self._knots[i], s)

    def solve(self, s: float) -> None:
        """Lead the curve through the equilibrium at ``s``; raises :class:`ConvergenceError`."""
        knot = solved_on(self.solver, self, s, ASIDE * self.length)
        others = (other for other in self.solved if abs(other.arclength - knot.arclength) > APART * self.length)
        self.solved = sorted([*others, knot], key=lambda knot: knot.arclength)
        self._knots = [self.ends[0], *self.solved, self.ends[1]]

    def nearest(self, s: float) -> Solved:
        """The equilibrium that was solved for nearest to ``s``."""
        return min(self.solved, key=lambda knot: abs(knot.s - s))


def stepped(solver: BranchSolver, x: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """The equilibrium ``x`` of a mesh after more steps of Newton's method, one where that makes no difference.

    They are made on the plane across ``row``, with factors of that state, and without damping: where an equilibrium was
    solved for with it, its factors see little of what a soft mode has left.  A state that slides away along a family
    makes one step with damping.  ``solver`` has the mesh.
    """
    system, settled = solver.system, x.copy()
    given = system.damping
    try:
        system.damping = 0.0
        if correct(system, settled, row, reach=SETTLES).converged:
            return settled
    finally:
        system.damping = given
    equations, step, state = system.new_vector(), system.new_vector(), system.at(x)
    system.set_phase(x)
    state.residual(equations)
    state.factor(row, damping=given or solver.inertia.tolerance)
    return x - step if system.solve(equations, step) else x


def solved_on(solver: BranchSolver, curve: Curve, s: float, aside: float) -> Solved:
    """The equilibrium across a ``curve`` at ``s``, or ``aside`` of it; raises :class:`ConvergenceError`.

    ``solver`` has the mesh.
    """
    x, there = solve_beside(solver, curve, s, aside)
    direction = curve(there)[1]
    row = solver.row(direction)
    left = x - stepped(solver, x, row)
    try:
        tangent = solver.tangent(row, at=x)
        slope = float(row.dot(tangent))
    except ConvergenceError:  # a singular state
        slope = 0.0
    if slope < ALIGNED:  # the curve knows the direction better
        return Solved(s, there, x, direction, left)
    tangent.scale(solver.system.norm(direction) / slope)
    return Solved(s, there, x, tangent, left)

"""The loads that a plan asks for: the states of a branch at exactly these."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.kinds import USER
from rodfem.continuation.locate import solve_at
from rodfem.continuation.prediction import hermite
from rodfem.continuation.solvers import distance
from rodfem.diagram.step import Step
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE

if TYPE_CHECKING:
    from rodfem.diagram.plan import Plan

EXACT = 1e-15
"""Arclength, in the metric, to which a load is located before it is set."""
CORRECTIONS = 3
"""Newton steps on the interpolated load that improve the arclength at which a state is expected."""


class RequestedLoads:
    """Finds the states at the loads asked for, which are the same for all branches."""

    at_start = True

    def __init__(self, plan: Plan) -> None:
        """Take the loads from the ``plan``."""
        self.loads = tuple(plan.at)

    def between(self, step: Step) -> list[SpecialPoint]:
        """Points at these loads in a step; at its first point, too, where a branch begins there."""
        solver, a, b = step.solver, step.a, step.b
        return [
            solver.given(USER, _point_at(load, step, p, q))
            for p, q in step.pieces()
            for load in self.loads
            if (p.load - load) * (q.load - load) < 0
            or (load == p.load and p is a and step.begins)
            or (load == q.load and q is b and not step.closed)
        ]


def _point_at(load: float, step: Step, p: Point, q: Point) -> Point:
    """Point at exactly ``load`` between two neighbours ``p``, ``q`` in a step.

    Close to a branch point Newton's method at a fixed load fails, or ends on the other branch.  On planes across
    the branch it does not, and the load is a function of arclength there, whose zero is found.
    """
    solver, a, b = step.solver, step.a, step.b
    system, s = solver.system, _expected(load, step, p, q)
    guess = hermite(a, b, s)[0]
    x, outcome = solver.at_load(guess, load, reach=1.0)
    on_branch = outcome.converged and (
        a.x is not p.x or distance(system, guess, x) < 0.5 * distance(system, a.x, x) or p.load == load
    )
    if not on_branch:
        if (p.load - load) * (q.load - load) >= 0:
            raise ConvergenceError(
                f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another load."
            )

        def beyond(s: float) -> float:
            return system.scalar(solve_at(solver, lambda t: hermite(a, b, t), s)) - load

        margin = INSIDE * (q.arclength - p.arclength)
        s = zero_between(beyond, p.arclength + margin, q.arclength - margin, EXACT)
        x = solve_at(solver, lambda t: hermite(a, b, t), s)
        system.set_load(x, load)
    return solver.point(x, s, solver.load_tangent(x, q.load > p.load), outcome)


def _expected(load: float, step: Step, p: Point, q: Point) -> float:
    """Arclength between ``p`` and ``q`` in a step at which the interpolated branch has a ``load``."""
    s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
    for _ in range(CORRECTIONS):
        x, direction = hermite(step.a, step.b, s)
        slope = step.solver.system.scalar(direction)
        if slope:
            s = min(max(s + (load - step.solver.system.scalar(x)) / slope, p.arclength), q.arclength)
    return s

"""The loads that a plan asks for: the states of a branch at exactly these."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.kinds import USER
from rodfem.continuation.observer import Observer
from rodfem.diagram.step import Step

if TYPE_CHECKING:
    from rodfem.diagram.plan import Plan


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
            solver.given(USER, step.at_load(load, p, q))
            for p, q in step.pieces()
            for load in self.loads
            if (p.load - load) * (q.load - load) < 0
            or (load == p.load and p is a and step.begins)
            or (load == q.load and q is b and not step.closed)
        ]

    def finish(self, observer: Observer) -> None:
        """Nothing is left open: an equilibrium that is not found ends its branch."""

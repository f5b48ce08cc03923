"""The events that a plan asks for, step by step along a branch."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_location import event_at, locate_event
from rodfem.continuation.kinds import EVENT
from rodfem.continuation.prediction import hermite
from rodfem.diagram.step import Step
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE, round_off

if TYPE_CHECKING:
    from rodfem.diagram.plan import Plan


class Events:
    """The events of one branch: their values at the last row."""

    at_start = False

    def __init__(self, plan: Plan) -> None:
        """Nothing is known yet."""
        self.events = tuple(plan.events)
        self._row: Point | None = None
        self._values: list[float] = []

    def between(self, step: Step) -> list[SpecialPoint]:
        """Special points of the events that happen in a step."""
        if not self.events:
            return []
        solver, a, b = step.solver, step.a, step.b
        before = self._values if self._row is a else [event_at(solver, event, a.x) for event in self.events]
        self._row, self._values = b, [event_at(solver, event, b.x) for event in self.events]
        changes = zip(self.events, before, self._values, strict=True)
        return [_special(solver, event, a, b) for event, p, q in changes if p * q < 0]


def _special(solver: BranchSolver, event: Event, a: Point, b: Point) -> SpecialPoint:
    curve = partial(hermite, a, b)
    margin = INSIDE * (b.arclength - a.arclength)
    s, x, along = locate_event(solver, event, curve, a.arclength + margin, b.arclength - margin)
    tangent = solver.tangent(solver.row(curve(s)[1]), at=x)
    point = solver.point(x, s, tangent)
    left = abs(point.slope) * along + round_off(point.load, solver.units.load)
    return SpecialPoint(EVENT, point, point.negative, point.negative, left, note=event.name, event=event)

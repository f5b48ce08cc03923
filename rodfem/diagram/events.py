"""The events that a plan asks for, step by step along a branch: zeros of the cubic of a number of the state.

An event at a row is a special point of the step that ends there, or of the first one of a branch that begins there:
unless that is a branch point of another one, or the state at which a closed branch began.  A number that is zero at
both ends of a step is zero along it, and has no special points there.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import between
from rodfem.continuation.event_piece import End, EventPiece, end
from rodfem.continuation.kinds import EVENT
from rodfem.continuation.observer import Remark
from rodfem.diagram.finders import Step
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.tolerances import round_off

if TYPE_CHECKING:
    from rodfem.continuation.crossings import Node
    from rodfem.continuation.observer import Observer
    from rodfem.diagram.plan import Plan


class Events:
    """The events of one branch, and what is to be said of each.

    By the name of an event, ``_open`` has the loads at the ends of steps in which it was not located, ``_still`` those
    of steps on which it is zero.
    """

    def __init__(self, plan: Plan) -> None:
        """Nothing is known yet."""
        self.events = tuple(plan.events)
        self._open: dict[str, list[float]] = {}
        self._still: dict[str, list[float]] = {}
        self._last: tuple[Point, End] | None = None

    def between(self, step: Step) -> list[SpecialPoint]:
        """Special points of the events that happen in a step."""
        if not self.events:
            return []
        ends = [self._end(step, row) for row in (step.a, step.b)]
        return [s for event in self.events for s in self._in_step(step, EventPiece(step.solver, event, *ends))]

    def finish(self, observer: Observer) -> None:
        """Say where an event was not located, and where it is zero all along."""
        for name, loads in self._open.items():
            where = f"between loads {min(loads):.8g} and {max(loads):.8g}"
            observer.warn(Remark(f"The event {name!r} was not located {where}: {SMALLER_STEPS}.", *loads))
        for name, loads in self._still.items():
            where = f"between loads {min(loads):.8g} and {max(loads):.8g}"
            observer.note(Remark(f"  the event {name!r} is zero all along {where}: no special points", *loads))
        self._open, self._still, self._last = {}, {}, None

    def _end(self, step: Step, row: Point) -> End:
        """The end of a step at a row, which may be that of the step before."""
        if self._last is None or self._last[0] is not row:
            direction = between(step.a, step.b, row.arclength)[1]
            self._last = row, end(step.solver, row.arclength, row.x, direction)
        return self._last[1]

    def _in_step(self, step: Step, piece: EventPiece) -> list[SpecialPoint]:
        """Special points of the event of a piece, which is a step."""
        name, loads = piece.event.name, [step.a.load, step.b.load]
        if piece.is_zero(piece.first) and piece.is_zero(piece.last):
            self._still.setdefault(name, []).extend(loads)
            return []
        try:
            zeros = piece.zeros()
        except ConvergenceError:
            self._open.setdefault(name, []).extend(loads)
            return []
        # a branch that leaves another one begins with a state of that one, at which an eigenvalue vanishes
        known = [] if step.begins and step.a.zero <= step.b.zero else [piece.first]
        known += [piece.last] if step.closed else []
        return [_special(step, piece, node) for node in zeros if node not in known]


def _special(step: Step, piece: EventPiece, node: Node) -> SpecialPoint:
    """The special point of an event at a node, which may be a row."""
    solver, knot = step.solver, node.kept
    if node in (piece.first, piece.last):
        point = replace(step.a if node is piece.first else step.b)
    else:
        point = solver.point(knot.x, piece.begin + node.s, knot.slope * knot.speed)
    slope = solver.system.scalar(knot.slope)
    left = abs(slope) * piece.uncertainty(node) + round_off(point.load, solver.units.load)
    return SpecialPoint(EVENT, point, point.negative, point.negative, left, note=piece.event.name, event=piece.event)

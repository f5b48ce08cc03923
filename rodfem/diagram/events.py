"""What a plan asks for in a step of a branch: loads, levels of eigenvalues, events: zeros of the cubic of a number.

An event at a row is a special point of the step that ends there, or of the first one of a branch that begins there:
unless that is a branch point of another one, or the state at which a closed branch began.  A number that is zero at
both ends of a step is zero along it, and has no special points there.

Folds and branch points are zeros of eigenvalues, whose number the index tells
(:mod:`rodfem.diagram.special_search`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

from rodfem.continuation.arc import Arc, End, SoughtPiece, end, piece_with
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node
from rodfem.continuation.curves import interpolant
from rodfem.continuation.kinds import USER
from rodfem.continuation.observer import Observer, Remark
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.problem.events import Event, Level
from rodfem.tolerances import round_off


class Step(NamedTuple):
    """From a point ``a`` of a branch to the next, ``b``, both on the mesh of a ``solver``."""

    solver: BranchSolver
    a: Point
    b: Point
    singular: Sequence[SpecialPoint] = ()  # folds and branch points between them
    begins: bool = False  # whether the branch begins at a: else it has come there
    closed: bool = False  # whether b is the state at which the branch began, which has been examined

    def pieces(self) -> Iterator[Arc]:
        """Arcs between ``a``, the folds and branch points, and ``b``: the load is monotone along each."""
        between = (s.point for s in self.singular if s.point.arclength > self.a.arclength)
        return (Arc(self.solver, p, q) for p, q in pairwise([self.a, *between, self.b]))

    def up_to(self, bounds: tuple[float, float]) -> Step:
        """The step up to where its load leaves the ``bounds`` for the first time, at one of the singular points."""
        low, high = bounds
        arc = next(arc for arc in self.pieces() if not low <= arc.b.load <= high)
        last = arc.at_load(low if arc.b.load < low else high)
        before = [s for s in self.singular if self.a.arclength < s.point.arclength < last.arclength]
        return self._replace(b=last, singular=before, closed=False)


def at_loads(step: Step, loads: Sequence[float]) -> list[SpecialPoint]:
    """Points at these loads in a step; at its first point, too, where a branch begins there."""
    found = [
        step.a if step.a.zero <= step.b.zero else replace(step.a)
        for load in loads
        if step.begins and load == step.a.load
    ]
    found += [point for arc in step.pieces() for load in loads for point in _arc_point(step, arc, load)]
    return [step.solver.request(USER, point) for point in found]


def _arc_point(step: Step, arc: Arc, load: float) -> Iterator[Point]:
    """The point at a load on an arc of the step, if there is one, without its beginning."""
    if (arc.a.load - load) * (arc.b.load - load) < 0:
        yield arc.at_load(load)
    elif load == arc.b.load and arc.b is not step.b:
        yield replace(arc.b)
    elif load == arc.b.load and not step.closed:
        yield arc.b


class Events:
    """The events of one branch, and what is to be said of each."""

    def __init__(self, events: Sequence[Event | Level]) -> None:
        self.events = events
        self._open: dict[str, list[float]] = {}
        self._flat: dict[str, list[float]] = {}
        self._last: tuple[Point, End] | None = None

    def special_points(self, step: Step) -> list[SpecialPoint]:
        """Special points of the events that happen in a step."""
        if not self.events:
            return []
        ends = [self._end(step, row) for row in (step.a, step.b)]
        return [s for event in self.events for s in self._in_step(step, piece_with(event, step.solver, *ends))]

    def finish(self, observer: Observer) -> None:
        """Say where an event was not located, and where it is zero all along."""
        lost = "The event {!r} was not located between loads {:.8g} and {:.8g}: {}."
        flat = "  the event {!r} is zero all along between loads {:.8g} and {:.8g}: no special points"
        for found, say, sentence in ((self._open, observer.warn, lost), (self._flat, observer.note, flat)):
            for name, loads in found.items():
                say(Remark(sentence.format(name, min(loads), max(loads), SMALLER_STEPS), *loads))
        self._open, self._flat, self._last = {}, {}, None

    def _end(self, step: Step, row: Point) -> End:
        """The end of a step at a row, which may be that of the step before."""
        if self._last is None or self._last[0] is not row:
            direction = interpolant(step.a, step.b, row.arclength)[1]
            self._last = row, end(step.solver, row.arclength, row.x, direction)
        return self._last[1]

    def _in_step(self, step: Step, piece: SoughtPiece) -> list[SpecialPoint]:
        """Special points of the event of a piece, which is a step."""
        name, loads = piece.event.name, [step.a.load, step.b.load]
        if piece.is_zero(piece.first) and piece.is_zero(piece.last):
            self._flat.setdefault(name, []).extend(loads)
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


def _special(step: Step, piece: SoughtPiece, node: Node) -> SpecialPoint:
    """The special point of an event at a node, which may be a row."""
    solver, knot, event = step.solver, node.kept, piece.event
    if node in (piece.first, piece.last):
        point = replace(step.a if node is piece.first else step.b)
    else:
        point = solver.point(knot.x, piece.begin + node.s, knot.slope * knot.speed)
    slope = solver.system.scalar(knot.slope)
    left = abs(slope) * piece.uncertainty(node) + round_off(point.load, solver.units.load)
    return SpecialPoint(piece.kind, point, point.negative, point.negative, left, note=event.name, event=event)

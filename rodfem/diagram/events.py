"""The events that a plan asks for, step by step along a branch: all zeros of a number of the state, pairs of them, too.

The number is a function of the place on a curve that is interpolated between the rows, which costs no solves; its zeros
are located there (:mod:`rodfem.continuation.event_zeros`).  Where it is zero, or comes near it, equilibria are solved
for, and the curve is led through them, until its zeros are those of equilibria.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_location import Found, OnCurve, event_at
from rodfem.continuation.event_samples import NODES, WIDEST, Piece
from rodfem.continuation.kinds import EVENT
from rodfem.continuation.prediction import between
from rodfem.continuation.states_between import EventCurve
from rodfem.diagram.step import Step
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE, round_off

if TYPE_CHECKING:
    from rodfem.continuation.observer import Observer
    from rodfem.diagram.plan import Plan

KEPT = 16
"""States of a step that are kept for further events."""
MOST = 3
"""Ranges of loads that are named one by one."""
Range = tuple[float, float]


class Events:
    """The events of one branch: their values at the last row, and what is to be said of each.

    ``_row`` is that row, ``_values`` are the values there, and ``_last`` the arclengths of the last zeros.  ``_open``
    has the loads at the ends of steps in which zeros of an event may be missing, ``_still`` those of steps on which it
    is zero, by its name.  ``_apart`` is how far apart in the load, ``_load``, the samples of a step are at most.
    """

    at_start = True

    def __init__(self, plan: Plan) -> None:
        """Nothing is known yet."""
        self.events = tuple(plan.events)
        self._row: Point | None = None
        self._values: list[float] = []
        self._last: list[float] = []
        self._open: dict[str, list[Range]] = defaultdict(list)
        self._still: dict[str, list[Range]] = defaultdict(list)
        self._apart, self._load = 0.0, ""

    def between(self, step: Step) -> list[SpecialPoint]:
        """Special points of the events that happen in a step."""
        if not self.events:
            return []
        solver, a, b = step.solver, step.a, step.b
        self._apart, self._load = max(self._apart, WIDEST * abs(b.load - a.load)), solver.system.scene.load
        follows = self._row is a
        before = self._values if follows else [event_at(solver, event, a.x) for event in self.events]
        before_it = self._last if follows else [-inf] * len(self.events)
        after = [event_at(solver, event, b.x) for event in self.events]
        # a branch that leaves another one begins with a state of that one, at which an eigenvalue vanishes
        begins = follows or (step.begins and a.zero <= b.zero)
        states, out, self._last = _States(solver, a, b), list[SpecialPoint](), []
        for event, ends, last in zip(self.events, zip(before, after, strict=True), before_it, strict=True):
            happens = self._in_step(step, event, states, ends, last)
            out += [_special(solver, event, a, b, found) for found in happens.found]
            rows = (a, happens.first if begins else None), (b, None if step.closed else happens.last)
            out += [_at_row(solver, event, row, along) for row, along in rows if along is not None]
            self._last.append(max([last, *happens.places]))
        self._row, self._values = b, after
        return out

    def finish(self, observer: Observer) -> None:
        """Say how finely a branch that is complete was sampled, where zeros may be missing, and where all are zero."""
        if self._apart:
            observer.note(
                f"  events were looked at in {len(NODES)} states of each step, or more: one that comes and goes "
                f"between two of them, here up to {self._apart:.2g} in {self._load} apart, is not seen"
            )
        self._apart = 0.0
        for name, ranges in self._open.items():
            observer.warn(
                f"Zeros of the event {name!r} may be missing between loads {_words(ranges)}, where it varies too fast "
                f"from state to state, or equilibria were not found: {SMALLER_STEPS}, or a smoother function."
            )
        for name, ranges in self._still.items():
            observer.note(f"  the event {name!r} is zero all along between loads {_words(ranges)}: no special points")
        self._row = None
        self._open.clear()
        self._still.clear()

    def _in_step(self, step: Step, event: Event, states: _States, ends: Range, last: float) -> Happens:
        """What an event does in a step, the last zero before at arclength ``last``; what is left open is kept."""
        solver, a, b = step.solver, step.a, step.b
        try:
            happens = search(solver, event, (a, b), lambda s: event(states(s)), ends, last)
        except ConvergenceError:
            self._open[event.name].append((a.load, b.load))
            return Happens([], [])
        if happens.unresolved:
            self._open[event.name].append((a.load, b.load))
        for piece in happens.still:
            low, high = (solver.system.scalar(between(a, b, s)[0]) for s in piece)
            self._still[event.name].append((low, high))
        return happens


class _States:
    """States interpolated in a step, of which all events have those that they have in common."""

    def __init__(self, solver: BranchSolver, a: Point, b: Point) -> None:
        """No state yet."""
        self.solver, self.a, self.b = solver, a, b
        self.known: dict[float, dict[str, Any]] = {}

    def __call__(self, s: float) -> dict[str, Any]:
        """The arrays of the state at arclength ``s``."""
        if s in self.known:
            return self.known[s]
        state = self.solver.shape.sample(between(self.a, self.b, s)[0])
        if len(self.known) < KEPT:
            self.known[s] = state
        return state


def _words(ranges: list[Range]) -> str:
    """Loads at the ends of some ranges, those that meet as one."""
    whole: list[list[float]] = []
    for low, high in sorted((min(r), max(r)) for r in ranges):
        if whole and low <= whole[-1][1]:
            whole[-1][1] = max(high, whole[-1][1])
        else:
            whole.append([low, high])
    if len(whole) > MOST:
        whole = [[whole[0][0], whole[-1][1]]]
    return ", ".join(f"{low:.8g} and {high:.8g}" for low, high in whole)


def _special(solver: BranchSolver, event: Event, a: Point, b: Point, found: Found) -> SpecialPoint:
    """The special point of an event that was found in a step."""
    tangent = solver.tangent(solver.row(between(a, b, found.s)[1]), at=found.x)
    return _named(solver, event, solver.point(found.x, found.s, tangent), found.along)


def _at_row(solver: BranchSolver, event: Event, row: Point, along: float) -> SpecialPoint:
    """The special point of an event that happens at a row, or within the arclength ``along`` of it."""
    return _named(solver, event, replace(row), along if row.tangent is not None else 0.0)


def _named(solver: BranchSolver, event: Event, point: Point, along: float) -> SpecialPoint:
    """A special point that has the name of its event, at a point whose arclength is known up to ``along``."""
    left = (abs(point.slope) * along if along else 0.0) + round_off(point.load, solver.units.load)
    return SpecialPoint(EVENT, point, point.negative, point.negative, left, note=event.name, event=event)


class Happens(NamedTuple):
    """What an event does in a step: where it is ``found``, and pieces on which it is ``unresolved``.

    At the ``first`` and at the ``last`` row it may be zero, to these distances; on pieces it may be ``still`` zero.
    The zeros have ``places``, arclengths, those at rows and known ones, too.
    """

    found: list[Found]
    unresolved: list[Piece]
    first: float | None = None
    last: float | None = None
    still: Sequence[Piece] = ()
    places: Sequence[float] = ()


def search(
    solver: BranchSolver,
    event: Event,
    rows: tuple[Point, Point],
    f: Callable[[float], float],
    ends: tuple[float, float],
    last: float,
) -> Happens:
    """Find what an ``event`` does between two ``rows``, at which it has the values ``ends``.

    ``f(s)`` is its value at the state interpolated at arclength ``s``; the ``last`` zero before was at this one.
    ``solver`` has the mesh.  Raises :class:`ConvergenceError` where an equilibrium is not found.
    """
    value = OnCurve(event, EventCurve(solver, *rows))
    (a, b), margin = value.places, INSIDE * value.curve.length
    zeros = value.zeros(f, ends, known=a - last <= margin)
    if zeros is None:
        return Happens([], [], still=[(a, b)])
    found, still, along = list[Found](), list[Piece](), dict[float, float]()
    unresolved = list(zeros.samples.unresolved)
    for zero in zeros.found:
        if value.still(zero):
            piece = max(zero.low, a), min(zero.high, b)
            (still if value.zero_on(piece) else unresolved).append(piece)
        elif value.inside(zero):
            found.append(value.found(zero))
        else:
            along[a if zero.s - a < b - zero.s else b] = max(margin, zero.high - zero.low)
    if a - last <= max(margin, along.get(a, 0.0)):
        along.pop(a, None)
    places = [zero.s for zero in zeros.found]
    return Happens(found, unresolved, along.get(a), along.get(b), still, places)

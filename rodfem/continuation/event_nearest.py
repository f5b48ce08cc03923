"""The zero of an event nearest to a state, on another discretisation: what its error is estimated from."""

from __future__ import annotations

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_curve import ASIDE, EventCurve, solved_on
from rodfem.continuation.event_location import Found, OnCurve, event_at
from rodfem.continuation.states_between import Curve
from rodfem.errors import ConvergenceError
from rodfem.problem.events import Event

NEAREST, WIDER = 1e-2, 10.0
"""Half length of the first piece on which an event is sought, relative to the last one; and the ratio of two that
follow."""
TOUCHES = 1e-7
"""Least distance, relative to the last piece, at which it is tried whether a function rises by its lowest value."""


def nearest_event(solver: BranchSolver, event: Event, curve: Curve, reach: float) -> Found:
    """Where an ``event`` happens nearest to the beginning of a ``curve``, within ``reach`` on either side.

    Raises :class:`ConvergenceError` where it does not happen.  Its function may only come near zero, as beside where it
    touches zero on another mesh: then it is known to the distance at which it has twice its lowest value.  ``solver``
    has the mesh.
    """
    width = NEAREST * reach
    while True:
        first, last = (solved_on(solver, curve, s, 2 * ASIDE * width) for s in (-width, width))
        value = OnCurve(event, EventCurve(solver, first, last))
        value.curve.solve(0.0)
        ends = event_at(solver, event, first.x), event_at(solver, event, last.x)
        zeros = value.zeros(value, ends, known=False)
        found = [zero for zero in zeros.found if value.inside(zero)] if zeros else []
        if found:
            return value.found(min(found, key=lambda zero: abs(zero.s)))
        if width >= reach:
            break
        width = min(WIDER * width, reach)
    places = [] if zeros is None else [s for s in zeros.above if s not in value.places]
    if places:
        lowest = min(places, key=lambda s: abs(value(s)))
        along, x = TOUCHES * reach, value.curve.nearest(lowest).x
        while along <= reach:
            if max(abs(value(lowest - along)), abs(value(lowest + along))) >= 2 * abs(value(lowest)):
                return Found(lowest, x, along)
            along *= WIDER
    raise ConvergenceError(f"The event {event.name!r} does not happen near there.")

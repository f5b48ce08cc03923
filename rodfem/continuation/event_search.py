"""Search for events between two rows of a branch: for every zero of a number of the state, also for pairs of them.

The number is a function of the place on a curve that is interpolated between the rows, which costs no solves; its zeros
are located there (:mod:`rodfem.continuation.event_zeros`).  Where it is zero, or comes near it, equilibria are solved
for, and the curve is led through them, until its zeros are those of equilibria.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_location import Found, OnCurve
from rodfem.continuation.event_samples import Piece
from rodfem.continuation.states_between import EventCurve
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE


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

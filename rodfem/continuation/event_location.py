"""Location of events: zeros of a number of the state on a piece of a branch."""

from __future__ import annotations

from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.states_between import Curve, solve_beside
from rodfem.errors import ConvergenceError
from rodfem.problem.events import Event
from rodfem.roots import zero_between

ASIDE = 1e-6
"""Distance beside a singular point at which an event's equations are solved, relative to the piece."""
ALONG = 1e-13
"""Arclength to which an event is located, in the metric."""


def event_at(solver: BranchSolver, event: Event, x: PETSc.Vec) -> float:
    """Value of an event at a state; collective."""
    return event(solver.shape.sample(x))


def locate_event(
    solver: BranchSolver, event: Event, curve: Curve, low: float, high: float
) -> tuple[float, PETSc.Vec, float]:
    """Parameter, state and uncertainty of the parameter of an event on a piece of a branch.

    Where it happens at a branch point, at which the equations across the branch are singular, states beside it serve.
    Raises :class:`ConvergenceError` without a change of sign.  The ``event`` changes its sign between the parameters
    ``low`` and ``high`` of the ``curve``, on the mesh of ``solver``.
    """
    aside = ASIDE * (high - low)

    def value(s: float) -> float:
        return event_at(solver, event, solve_beside(solver, curve, s, aside)[0])

    if value(low) * value(high) > 0:
        raise ConvergenceError(f"The event {event.name!r} does not happen between the ends of the piece.")
    s = zero_between(value, low, high, ALONG)
    x, there = solve_beside(solver, curve, s, aside)
    return there, x, ALONG + 2 * abs(there - s)

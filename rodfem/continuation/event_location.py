"""Location of events: zeros of a number of the state on a piece of a branch."""

from __future__ import annotations

from math import copysign
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.states_between import Curve, solve_beside
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import generic
from rodfem.problem.events import Event
from rodfem.roots import lowest_between, zero_between
from rodfem.tolerances import INSIDE, ROUND_OFF

ASIDE = 1e-6
"""Distance beside a singular point at which an event's equations are solved, relative to the piece."""
ALONG = 1e-13
"""Arclength to which an event is located, in the metric."""
TOUCHES = 1e-7
"""Distance to which it is known where a function touches zero, relative to the piece: of its lowest value, which is
quadratic there, the square is round-off."""
TRIED = 4
"""Number of states, each with another round-off, whose values are compared."""
NEAREST, WIDER = 1e-5, 10.0
"""Half length of the first piece on which an event is sought near a state, relative to the last one; and the ratio of
two that follow: of two zeros the nearer one is to be found."""


class Found(NamedTuple):
    """Where an event happens: parameter ``s`` of the curve, state ``x``, uncertainty ``along`` of the parameter.

    ``touches`` says that the number only touches zero there.
    """

    s: float
    x: PETSc.Vec
    along: float
    touches: bool = False


class Solved:
    """The values of an event at equilibria near a curve, each solved for once."""

    def __init__(self, solver: BranchSolver, event: Event, curve: Curve, length: float) -> None:
        """Nothing is solved for yet of the ``event``; the piece of the ``curve`` has this ``length``.

        ``solver`` has the mesh.
        """
        self.solver, self.event, self.curve, self.aside = solver, event, curve, ASIDE * length
        self.known: dict[float, float] = {}

    def __call__(self, s: float) -> float:
        """Value at the equilibrium across the curve at ``s``; raises :class:`ConvergenceError`."""
        if s not in self.known:
            self.known[s] = event_at(self.solver, self.event, self.at(s)[0])
        return self.known[s]

    def at(self, s: float) -> tuple[PETSc.Vec, float]:
        """The equilibrium, and where it is: where the equations are singular one beside it serves."""
        return solve_beside(self.solver, self.curve, s, self.aside)

    def zero(self, low: float, high: float) -> Found:
        """Where the event changes its sign between two parameters; raises :class:`ConvergenceError`."""
        if self(low) * self(high) > 0:
            raise ConvergenceError(f"The event {self.event.name!r} does not happen between the ends of the piece.")
        s = zero_between(self, low, high, ALONG)
        x, there = self.at(s)
        return Found(there, x, ALONG + 2 * abs(there - s))

    def lowest(self, low: float, s: float, high: float, sign: float, width: float) -> tuple[float, float]:
        """Where ``sign`` times the event is lowest, or negative, to ``width``; and its value.

        It is sought between the parameters ``low`` and ``high``, beginning at ``s``.
        """
        return lowest_between(lambda t: sign * self(t), low, s, high, width)

    def touches(self, s: float, sign: float, width: float) -> bool:
        """Whether within ``width`` of a lowest value the event rises by more than that value: it may be zero there."""
        low = sign * self(s)
        return max(sign * self(s - width), sign * self(s + width)) - low >= low


def event_at(solver: BranchSolver, event: Event, x: PETSc.Vec) -> float:
    """Value of an event at a state; collective."""
    return event(solver.shape.sample(x))


def noise_of(solver: BranchSolver, event: Event, x: PETSc.Vec) -> float:
    """How much the value of an event varies with the round-off of a state; collective."""
    first, last = x.getOwnershipRange()
    here, most = event_at(solver, event, x), 0.0
    for which in range(TRIED):
        other = x.copy()
        other.array[:] += ROUND_OFF * generic(np.arange(first, last), which)
        most = max(most, abs(event_at(solver, event, other) - here))
    return most


def nearest_event(solver: BranchSolver, event: Event, curve: Curve, reach: float) -> Found:
    """Where an ``event`` happens nearest to the beginning of a ``curve``, within ``reach`` on either side.

    Raises :class:`ConvergenceError` where it does not happen.  Its function may only touch zero: then it is known to
    the distance at which it has twice its lowest value.  ``solver`` has the mesh.
    """
    width = NEAREST * reach
    while True:
        try:
            return Solved(solver, event, curve, 2 * width).zero(-width, width)
        except ConvergenceError:
            if width >= reach:
                break
        width = min(WIDER * width, reach)
    value = Solved(solver, event, curve, 2 * reach)
    sign = copysign(1.0, value(reach))
    s, low = value.lowest(-reach, 0.0, reach, sign, INSIDE * reach)
    if low < 0:
        return min((value.zero(-reach, s), value.zero(s, reach)), key=lambda found: abs(found.s))
    width = TOUCHES * reach
    while not value.touches(s, sign, width):
        width *= WIDER
        if width > reach:
            raise ConvergenceError(f"The event {event.name!r} does not happen near there.")
    return Found(s, value.at(s)[0], width, touches=True)

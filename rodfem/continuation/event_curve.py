"""A curve of states between two rows, and the equilibria beside it that improve it where an event is.

Between two states with their tangents it is a cubic: near a state that is solved for its error is that of the square of
the distance from there, and a few such states leave nothing of it but round-off where it matters.
"""

from __future__ import annotations

from bisect import bisect
from typing import NamedTuple

from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import Knot, between
from rodfem.continuation.states_between import Curve, solve_beside
from rodfem.errors import ConvergenceError

ASIDE = 1e-6
"""Distance beside a singular point at which the equations are solved, relative to the curve."""
APART = 1e-9
"""Least distance of two states of the curve, relative to it: two that are nearer tell no direction."""
ALONG = 0.9
"""Cosine between the curve and the tangent of a branch below which that is the tangent of another one."""


class Solved(NamedTuple):
    """An equilibrium on the plane across the curve at ``s``: it is at ``arclength``, ``s`` or beside it."""

    s: float
    arclength: float
    x: PETSc.Vec
    tangent: PETSc.Vec


class EventCurve:
    """A curve from one state to another, through all that have been ``solved`` for between them, in order."""

    def __init__(self, solver: BranchSolver, first: Knot, last: Knot) -> None:
        """The curve from the ``first`` to the ``last`` state; ``solver`` has the mesh."""
        self.solver, self.ends, self.length = solver, (first, last), last.arclength - first.arclength
        self.solved: list[Solved] = []
        self._knots: list[Knot] = [first, last]

    def __call__(self, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and direction at ``s``."""
        i = bisect(self._knots, s, 1, len(self._knots) - 1, key=lambda knot: knot.arclength)
        return between(self._knots[i - 1], self._knots[i], s)

    def solve(self, s: float) -> None:
        """Lead the curve through the equilibrium at ``s``; raises :class:`ConvergenceError`."""
        knot = solved_on(self.solver, self, s, ASIDE * self.length)
        others = (other for other in self.solved if abs(other.arclength - knot.arclength) > APART * self.length)
        self.solved = sorted([*others, knot], key=lambda knot: knot.arclength)
        self._knots = [self.ends[0], *self.solved, self.ends[1]]

    def nearest(self, s: float) -> Solved:
        """The equilibrium that was solved for nearest to ``s``."""
        return min(self.solved, key=lambda knot: abs(knot.s - s))


def solved_on(solver: BranchSolver, curve: Curve, s: float, aside: float) -> Solved:
    """The equilibrium across a ``curve`` at ``s``, or ``aside`` of it; raises :class:`ConvergenceError`.

    ``solver`` has the mesh.
    """
    x, there = solve_beside(solver, curve, s, aside)
    direction = curve(there)[1]
    row = solver.row(direction)
    try:
        tangent = solver.tangent(row, at=x)
        slope = float(row.dot(tangent))
    except ConvergenceError:  # a singular state
        slope = 0.0
    if slope < ALONG:  # the curve knows the direction better
        return Solved(s, there, x, direction)
    tangent.scale(solver.system.norm(direction) / slope)
    return Solved(s, there, x, tangent)

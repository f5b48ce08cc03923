"""Loss of convexity of the stored energy between two states: it may be lost and regained within one step.

The least eigenvalue of the second derivative of ``W`` (:mod:`rodfem.fem.convexity`) is a cubic between the states, by
its values and difference quotients at both.  Where that turns, or at the second state, it may not be positive: an
equilibrium decides.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node, places
from rodfem.continuation.prediction import between
from rodfem.continuation.states_between import solve_at
from rodfem.errors import ConvergenceError
from rodfem.fem.convexity import Convexity
from rodfem.roots import zero_between

LOCATED, DIFFERENCE = 1e-10, 1e-5
"""Place to which a loss of convexity is located, and step of the difference quotients, both relative to the step."""
State = Callable[[float], PETSc.Vec]


def lost_between(convexity: Convexity, state: State, holds: Callable[[float], bool]) -> float | None:
    """First ``t`` between 0 and 1 at which ``W`` is not convex along ``state(t)``, as it is along ``state(0)``.

    ``holds(t)`` decides about an interpolated state along which it is not.  None where it stays convex.
    """
    if not convexity.alters:
        return None
    scales = convexity.scales(state(0.0), state(1.0))
    margin = cache(lambda t: convexity.margin(state(t), scales))

    def node(t: float, beside: float) -> Node:
        return Node(t, np.array([[margin(t)]]), np.array([[(margin(beside) - margin(t)) / (beside - t)]]), 0)

    last = 0.0
    for t in [*places(node(0.0, DIFFERENCE), node(1.0, 1.0 - DIFFERENCE), 1), 1.0]:
        if margin(t) > 0.0 or holds(t):
            last = t
            continue
        return zero_between(margin, last, t, LOCATED) if margin(last) > 0.0 else t
    return None


def lost_in_step(solver: BranchSolver, a: Point, b: Point) -> str:
    """Why a branch ends between two rows on the mesh of a ``solver``; empty where ``W`` stays convex."""

    def place(t: float) -> float:
        return a.arclength + t * (b.arclength - a.arclength)

    def state(t: float) -> PETSc.Vec:
        return a.x if t == 0.0 else b.x if t == 1.0 else between(a, b, place(t))[0]

    def holds(t: float) -> bool:
        if t == 1.0:
            return not solver.lost_convexity(b.x)
        try:
            return not solver.lost_convexity(solve_at(solver, lambda s: between(a, b, s), place(t)))
        except ConvergenceError:  # where the energy is not convex the equations may be singular
            return False

    lost = lost_between(solver.convexity, state, holds)
    return "" if lost is None else solver.not_convex(state(lost))

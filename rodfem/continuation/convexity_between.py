"""Loss of convexity of the stored energy between two states: it may be lost and regained within one step.

The least eigenvalue of the second derivative of ``W`` (:mod:`rodfem.fem.convexity`) is sampled between the states, as
events are (:mod:`rodfem.continuation.event_samples`): at states that are interpolated, which costs no solves.  Where a
sample is not positive an equilibrium decides.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_samples import sampled
from rodfem.continuation.prediction import between
from rodfem.continuation.states_between import solve_at
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.convexity import Convexity
from rodfem.roots import zero_between
from rodfem.tolerances import ROUND_OFF

State = Callable[[float], PETSc.Vec]


class Between(NamedTuple):
    """Where between 0 and 1 the energy is not convex any more, None for nowhere; whether samples ``resolve`` that."""

    lost: float | None = None
    resolved: bool = True


def lost_between(convexity: Convexity, state: State, holds: Callable[[float], bool]) -> Between:
    """First ``t`` between 0 and 1 at which ``W`` is not convex along ``state(t)``, as it is along ``state(0)``.

    ``holds(t)`` decides about an interpolated state along which it is not.
    """
    if not convexity.alters:
        return Between()
    scales = convexity.scales(state(0.0), state(1.0))
    margin = cache(lambda t: convexity.margin(state(t), scales))
    last, samples = 0.0, sampled(margin, 0.0, 1.0, (margin(0.0), margin(1.0)), lambda _: ROUND_OFF)
    for t, least in samples.in_order():
        if least > 0.0 or holds(t):
            last = t
            continue
        return Between(zero_between(margin, last, t, ROUND_OFF) if margin(last) > 0.0 else t)
    return Between(None, not samples.unresolved)


def lost_in_step(solver: BranchSolver, a: Point, b: Point, warn: Callable[[str], None]) -> str:
    """Why a branch ends between the rows ``a`` and ``b`` on the mesh of a ``solver``; empty where ``W`` stays convex.

    ``warn`` hears of a step in which it varies too fast for the samples.
    """

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

    found = lost_between(solver.convexity, state, holds)
    if not found.resolved:
        warn(unresolved(solver.system.scene.load, a.load, b.load))
    return "" if found.lost is None else solver.not_convex(state(found.lost))


def unresolved(name: str, a: float, b: float) -> str:
    """Sentence on a step in which the energy varies too fast for the samples."""
    return (
        f"Between {name} = {a:.8g} and {b:.8g} the second derivative of the stored energy varies so fast that it may "
        f"lose convexity unseen: {SMALLER_STEPS}."
    )

"""The loads that a plan asks for: the states of a branch at exactly these."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.kinds import USER
from rodfem.continuation.locate import solve_at
from rodfem.continuation.solvers import BranchSolver, distance, hermite
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE

EXACT = 1e-15
"""Arclength, in the metric, to which a load is located before it is set."""
CORRECTIONS = 3
"""Newton steps on the interpolated load that improve the arclength at which a state is expected."""


class RequestedLoads:
    """The loads asked for of one branch."""

    def __init__(self, loads: Sequence[float]) -> None:
        """They stay the same for all branches."""
        self.loads = tuple(loads)

    def between(
        self, solver: BranchSolver, a: Point, b: Point, specials: Sequence[SpecialPoint], *, begins: bool
    ) -> list[SpecialPoint]:
        """Points at these loads in the step from ``a`` to ``b``, which has ``specials``; ``a`` too where it ``begins``.

        Between two neighbours among those the load is monotone; the ``solver`` is that of their mesh.
        """
        pieces = [a, *(s.point for s in specials if s.point.arclength > a.arclength), b]
        rows = [(p, q, begins and p is a, q is b) for p, q in pairwise(pieces)]
        return [
            solver.given(USER, self._point(solver, (a, b), load, (p, q)))
            for p, q, first, last in rows
            for load in self.loads
            if (p.load - load) * (q.load - load) < 0 or (load == p.load and first) or (load == q.load and last)
        ]

    def _point(self, solver: BranchSolver, step: tuple[Point, Point], load: float, rows: tuple[Point, Point]) -> Point:
        """Point at exactly ``load`` between two ``rows`` of a ``step``.

        Close to a branch point Newton's method at a fixed load fails, or ends on the other branch.  On planes across
        the branch it does not, and the load is a function of arclength there, whose zero is found.
        """
        system, (a, b), (p, q) = solver.system, step, rows
        s = _expected(solver, step, load, rows)
        guess = hermite(a, b, s)[0]
        x, outcome = solver.at_load(guess, load, reach=1.0)
        on_branch = outcome.converged and (
            a.x is not p.x or distance(system, guess, x) < 0.5 * distance(system, a.x, x) or p.load == load
        )
        if not on_branch:
            if (p.load - load) * (q.load - load) >= 0:
                raise ConvergenceError(
                    f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another "
                    "load."
                )

            def beyond(s: float) -> float:
                return system.scalar(solve_at(solver, lambda t: hermite(a, b, t), s)) - load

            margin = INSIDE * (q.arclength - p.arclength)
            s = zero_between(beyond, p.arclength + margin, q.arclength - margin, EXACT)
            x = solve_at(solver, lambda t: hermite(a, b, t), s)
            system.set_load(x, load)
        return solver.point(x, s, solver.load_tangent(x, q.load > p.load), outcome)


def _expected(solver: BranchSolver, step: tuple[Point, Point], load: float, rows: tuple[Point, Point]) -> float:
    """Arclength between two ``rows`` of a ``step`` at which the interpolated branch has a ``load``."""
    (a, b), (p, q) = step, rows
    s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
    for _ in range(CORRECTIONS):
        x, direction = hermite(a, b, s)
        slope = solver.system.scalar(direction)
        if slope:
            s = min(max(s + (load - solver.system.scalar(x)) / slope, p.arclength), q.arclength)
    return s

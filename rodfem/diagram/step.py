"""A step of continuation, as those see it that look for special points in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.prediction import hermite
from rodfem.continuation.states_between import solve_at_load

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver


class Step(NamedTuple):
    """From a point ``a`` of a branch to the next, ``b``, both on the mesh of a ``solver``.

    ``singular`` has the folds and branch points between them; the branch ``begins`` at ``a``, or has come there; it is
    ``closed`` at ``b``, a state that has been examined as its beginning.
    """

    solver: BranchSolver
    a: Point
    b: Point
    singular: Sequence[SpecialPoint] = ()
    begins: bool = False
    closed: bool = False

    def pieces(self) -> Iterator[tuple[Point, Point]]:
        """Yield neighbours among ``a``, the folds and branch points, and ``b``: the load is monotone between them."""
        between = (s.point for s in self.singular if s.point.arclength > self.a.arclength)
        return pairwise([self.a, *between, self.b])

    def at_load(self, load: float, p: Point, q: Point) -> Point:
        """Point at exactly ``load`` between two neighbours ``p``, ``q`` of :meth:`pieces`.

        Raises :class:`~rodfem.errors.ConvergenceError` where there is no such state.
        """
        x, s, outcome = solve_at_load(self.solver, lambda t: hermite(self.a, self.b, t), p, q, load)
        return self.solver.point(x, s, self.solver.load_tangent(x, q.load > p.load), outcome)

    def up_to(self, bounds: tuple[float, float]) -> Step:
        """The step up to where its load leaves the ``bounds`` for the first time, at one of the singular points."""
        low, high = bounds
        p, q = next((p, q) for p, q in self.pieces() if not low <= q.load <= high)
        last = self.at_load(low if q.load < low else high, p, q)
        before = [s for s in self.singular if self.a.arclength < s.point.arclength < last.arclength]
        return self._replace(b=last, singular=before, closed=False)

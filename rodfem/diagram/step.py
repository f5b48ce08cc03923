"""A step of continuation, as those see it that look for special points in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from rodfem.continuation.branch import Point, SpecialPoint

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

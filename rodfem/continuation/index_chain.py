"""Consistency of the indices along a branch: rows and special points.

From row to row the index changes by the sum of the changes at the special points in between, each with its own index
before and after.  A row allows an interval: eigenvalues that are zero within the tolerance of the count may be of
either sign.  If the intervals of two neighbours are disjoint, the chain is broken: an eigenvalue has crossed zero
unseen, or a number is wrong.  A branch keeps the breaks that no smaller step explains in :attr:`Branch.unexplained`.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf

from rodfem.continuation.branch import Branch, Point, SpecialPoint, Unexplained
from rodfem.continuation.kinds import BRANCH_POINT

Interval = tuple[int, int]


def breaks(points: Sequence[Point], specials: Sequence[SpecialPoint], begins: int | None = None) -> list[Unexplained]:
    """Neighbours among rows in order of arclength, some of them special points, whose indices do not agree.

    ``begins`` is the index right after the first row, where it is known although it is none of these special points.
    """
    at = {id(s.point): s for s in specials if s.kind.singular}
    persistent = persistent_zeros(points)
    found = []
    for a, b in pairwise(points):
        left, right = _interval(a, at, persistent, after=True), _interval(b, at, persistent, after=False)
        if a is points[0] and begins is not None:
            left = begins, begins
        if left[1] < right[0] or right[1] < left[0]:
            found.append(Unexplained(a, b, left[0], right[0]))
    return found


def persistent_zeros(points: Sequence[Point]) -> int:
    """Number of eigenvalues that are zero at every row: of symmetries, or of families of equilibria at one load."""
    return min((p.zero for p in points), default=0)


def _interval(point: Point, at: dict[int, SpecialPoint], persistent: int, after: bool) -> Interval:
    """Least and greatest index right before or after a row."""
    special = at.get(id(point))
    if special is not None:
        index = special.negative_after if after else special.negative_before
        return index, index
    return point.negative, point.negative + max(point.zero - persistent, point.undecided)


def explain(branch: Branch) -> None:
    """Check the whole branch, which must be in order, and keep what is not explained."""
    branch.unexplained = breaks(branch.points, branch.special, branch.begins)


def merge_doubles(branch: Branch) -> None:
    """Merge neighbouring branch points that are closer than the error of the discretisation.

    A mesh that lacks a symmetry of the rod splits a multiple eigenvalue: its zeros are apart by no more than the error.
    The rod itself may have them apart, so that the bars of the one point are to hold for each of them.
    """
    bars = {id(s): s.error_estimate for s in branch.special}
    for p, q in list(pairwise(branch.special)):
        if not _double(branch, p, q, bars[id(p)] + bars[id(q)]):
            continue
        apart, ordinates = abs(p.point.load - q.point.load), abs(p.point.ordinate - q.point.ordinate)
        q.error_estimate = max(q.error_estimate, apart + p.error_estimate)
        q.ordinate_error = max(q.ordinate_error, ordinates + p.ordinate_error)
        q.null_vectors = p.null_vectors + q.null_vectors
        q.negative_before = p.negative_before
        q.point.zero += p.multiplicity
        if p.negative_after > p.negative_before:  # those of p are negative at q, and count as zero now
            q.point.negative -= p.multiplicity
        q.note = f"{q.multiplicity} eigenvalues that this mesh does not tell apart vanish within {apart:.0e}"
        branch.special.remove(p)
        branch.points = [point for point in branch.points if point is not p.point]
        branch.renumber()


def _double(branch: Branch, p: SpecialPoint, q: SpecialPoint, bar: float) -> bool:
    """Whether two neighbouring branch points are one within their ``bar``, as all rows between them are.

    The bar of a point that the mesh does not resolve says nothing of its neighbour, and a branch that comes back to the
    load at which it was passes two points there.
    """
    points = all(s.kind == BRANCH_POINT and s.test_function == "mu" and s.resolved is not False for s in (p, q))
    between = [x for x in branch.points if p.point.arclength <= x.arclength < q.point.arclength]
    same = p.point.mesh == q.point.mesh and bar < inf
    return points and same and all(abs(row.load - q.point.load) <= bar for row in between)

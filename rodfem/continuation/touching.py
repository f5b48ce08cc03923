r"""Pairs of crossings inside one step: an eigenvalue that passes zero and comes back leaves the index as it was.

The index of two neighbouring rows does not show them.  The determinant of the saddle matrix does, the product of all
eigenvalues, of which the others change little: on the way to its lowest value it falls before the step and rises after
it.  A simple eigenvalue gives it a parabola near such a pair, a double one the square of one,

    det^(1/m)(s) ~ c ((s - s_m)^2 - r^2),    crossings at s_m -+ r,    m = 1, 2,

which three rows determine.  Where its vertex lies inside a step, well below the values at both ends, the branch is
solved there (:mod:`rodfem.continuation.pair_search`).  Determinants come with the factors that count the index: they
cost nothing.  Where they change so much that the others may hide the one, that of the low modes is looked at too
(:mod:`rodfem.continuation.determinants`).

A row may happen to lie beside such a pair.  Its determinant is then lower than those of its neighbours by orders of
magnitude, and three rows do not show the pair: states nearer and nearer to that row replace its neighbours, on both
sides of it, or on the one side on which the first and the last row of a branch have any.

A crossing that is found later may have hidden a pair before it: the last rows are compared once more, with it divided
out.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.determinants import Crossing, functions
from rodfem.continuation.pair_search import PairSearch, arclength

MOST = 8
"""Rows that are kept, for a crossing that is found later and had hidden a pair between them."""
LASTING = 4.0
"""Steps for which a crossing is known: just before three rows its eigenvalue grows by a factor from row to row."""


class Touching:
    """The last rows of a branch, and the test for pairs of crossings in the steps between them, by determinants.

    Crossings that are ``known`` do not hide pairs beside them.
    """

    def __init__(self) -> None:
        """No row yet."""
        self._rows: list[Point] = []
        self._earlier: list[Point] = []
        self.known: list[Crossing] = []
        self._begun, self._blind, self._looked = True, False, False
        self._seen: set[str] = set()

    def restart(self, rows: Sequence[Point]) -> None:
        """Begin at the last of some rows of one branch; the step before it counts as looked at."""
        same = [row for row in rows[-MOST:] if row.mesh == rows[-1].mesh]  # determinants of two meshes do not compare
        self._earlier = same[:-2]
        self._rows, self._begun, self._blind = same[-2:], len(rows) < 2, False
        self._seen, self._looked = set(), len(rows) > 1
        self.known = [crossing for crossing in self.known if crossing.arclength <= rows[-1].arclength]

    def add(self, row: Point, known: Sequence[Crossing], *, blind: bool) -> None:
        """Go on to the next row; ``known`` are crossings that have been found since.

        In a ``blind`` step the index changes by more than they say: a pair does not show there.
        """
        self._begun = self._begun and len(self._rows) < 2
        self._earlier = [*self._earlier, *self._rows[:-1]][2 - MOST :]
        self._rows, self._blind = [*self._rows[-1:], row], blind
        since = row.arclength - LASTING * (row.arclength - self._rows[0].arclength)
        self.known = [crossing for crossing in self.known if crossing.arclength > since] + [*known]

    def before(self, row: Point) -> Point:
        """Return the row before the last one, ``row``; that one itself if there is none."""
        return self._rows[-2] if len(self._rows) > 1 and self._rows[-1] is row else row

    def clear(self, row: Point, zeros: int) -> Point:
        """Last row up to ``row`` of which no more than so many eigenvalues are near zero: from there one may go again.

        It is ``row`` itself where no such row is kept.
        """
        rows = [*self._earlier, *self._rows]
        there = (other for other in rows if other.arclength <= row.arclength and other.zero <= zeros)
        return max(there, key=arclength, default=row)

    def knows(self, a: Point, b: Point) -> bool:
        """Whether crossings are known between two rows."""
        return any(a.arclength < crossing.arclength < b.arclength for crossing in self.known)

    def between(self, solver: BranchSolver, a: Point, b: Point, found: Sequence[Crossing] = ()) -> list[Point]:
        """Rows to insert, in order of arclength, where an eigenvalue passes zero twice in the step from ``a`` to ``b``.

        That is beside the crossings that have been ``found`` in this step; ``solver`` has the mesh.  Of two steps the
        parabola may have its vertex in the wrong one: where that of the last three rows was not in the step to ``a``,
        or the function still fell towards ``a``, that step is looked at, too, and its row before that step then comes
        first.
        """
        if len(self._rows) < 2 or self._rows[-1] is not a:
            return []
        rows, known = [self._rows[-2], a, b], [*self.known, *found]
        # by names of the test functions: those that had their lowest value in the step before
        before, self._seen, looked, self._looked = self._seen, set(), self._looked, False
        for name, function in functions(solver, rows, known, self._earlier):
            search = PairSearch(solver, function, known)
            new = self._between(search, rows, looked or name in before) or (
                self._again(search, found[0]) if found else []
            )
            if new:
                return new
            if search.dips(rows, a, b) and not search.falling:
                self._seen.add(name)
        return []

    def _again(self, search: PairSearch, crossing: Crossing) -> list[Point]:
        """Rows to insert before the last one, beside a pair that a ``crossing`` after it had hidden.

        It hides those in steps that are not far shorter than its distance from them.
        """
        rows = [*self._earlier, *self._rows]
        for i in range(len(rows) - 3, -1, -1):
            first, middle, last = rows[i : i + 3]
            if crossing.arclength - last.arclength > last.arclength - first.arclength:
                continue
            if not (search.follows(middle, first) and search.follows(last, middle)):
                continue
            three = [first, middle, last]
            near = search.around(three) or search.inside(three, middle, last) or search.inside(three, first, middle)
            if near:
                beside = [first] if near[0].arclength < middle.arclength else []
                return sorted([*beside, *rows[i + 1 :], *near], key=arclength)
        return []

    def _between(self, search: PairSearch, rows: list[Point], seen: bool) -> list[Point]:
        """As :meth:`between`, by one test function, which has ``seen`` what is in the first of two steps."""
        first, a, b = rows
        found: list[Point] = []
        if not (self._blind or seen) and search.follows(a, first):
            early = search.inside(rows, first, a) or (search.beside(first, a) if self._begun else [])
            found += [first, *early, a] if early else []
        if found or self._blind:  # the other side of the row between the steps is known, or shows nothing
            near = search.beside(a, b)
        else:
            near = search.around(rows)
        if near and near[0].arclength < a.arclength:
            found = [first, *near, a]
            near = []
        return found + (near or search.inside(rows, a, b))

    def ending(self, solver: BranchSolver) -> list[Point]:
        """Last step of a branch that has ended, with a row inserted where an eigenvalue passes zero twice; else none.

        No third row follows the last two: the state half-way is one.  The first row of a branch of one step has been
        compared with none.
        """
        if len(self._rows) < 2 or self._blind or self.knows(*self._rows):
            return []
        a, b = self._rows
        for _, function in functions(solver, self._rows, self.known, self._earlier):
            search = PairSearch(solver, function, self.known)
            found = search.beside(b, a) or (search.beside(a, b) if self._begun else []) or search.halved(a, b)
            if found:
                return [a, *found, b]
        return []


def beside_zero(solver: BranchSolver, rows: Sequence[Point], row: Point) -> list[Point]:
    """A state beside a ``row`` with an eigenvalue near zero whose index does not follow from those of its neighbours.

    It is one of two or three neighbouring ``rows`` on the mesh of ``solver``, between which no crossing is known.
    """
    for _, function in functions(solver, rows):
        search = PairSearch(solver, function)
        if row is rows[0] or row is rows[-1]:
            found = search.beside(row, rows[1] if row is rows[0] else rows[-2])
        else:
            found = search.around(rows)
        if found:
            return found
    return []

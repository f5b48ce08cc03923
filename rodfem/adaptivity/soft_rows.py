"""Soft modes along a branch that has been traced: at which of its points the index is not decided, and by what.

Rows that one factorisation decided have none.  A mesh may make an eigenvalue of its own of one that is exponentially
small: it pins what slides along the rod.  With error bars the eigenvalue nearest zero is therefore compared with that
of a richer mesh, at the loads asked for and at the ends of branches; all along a branch if one of these is undecided,
or a special point is not on the richer mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import compress, groupby
from math import inf, isfinite

from rodfem.adaptivity.mesh_sequence import Meshes
from rodfem.adaptivity.soft_states import SoftStates
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL
from rodfem.continuation.kinds import EVENT, FOLD
from rodfem.fem.newton import TOLERANCE
from rodfem.stability.soft_mode import index_range

FINER, EXACT = "use more elements or a higher degree", "no mesh decides that, it is within round-off"
BARS = "richer meshes may decide that, ask for error bars"
CLEARLY = 10.0
"""Times the uncertainty by round-off above which one is that of the mesh."""


class SoftRows:
    """Examines branches of one run; with ``error_bars`` the error of its meshes is part of every uncertainty."""

    def __init__(self, meshes: Meshes, *, error_bars: bool) -> None:
        """Nothing is computed before a branch is given."""
        self.meshes, self.error_bars = meshes, error_bars
        self._states: dict[int, SoftStates] = {}
        self._uncompared: dict[str, tuple[float, str]] = {}

    def examine(self, branch: Branch) -> None:
        """Record soft modes, and undecided eigenvalues, at the points of a branch."""
        special = {id(s.point): s for s in branch.special}
        singular = {id(s.point) for s in branch.special if s.kind.counted or s.test_function == "stretch"}
        given = [s for s in branch.special if (s.kind.given or s.kind == EVENT) and id(s.point) not in singular]
        first = {id(branch.points[0])} if branch.parent else set()  # the branch point that it leaves
        doubtful = any(s.kind.singular and s.error_estimate == inf for s in branch.special)
        family = self._is_family(branch)
        counted = {id(s.point): s.point.negative for s in given}
        for s in {id(s.point): s for s in given}.values():  # a load asked for may be that of the end
            fixed = s.kind.given
            states = self._of(s.point)
            states.examine(s.point, fixed_load=fixed, compare=self.error_bars, family=family)
            if states.uncompared and isfinite(s.error_estimate) and s.resolved:  # else the special point says so
                self._uncompared.setdefault(branch.name, (s.point.load, states.uncompared))
            doubtful |= s.point.undecided > 0
        for s in given:
            if s.negative_before == s.negative_after == counted[id(s.point)]:
                s.negative_before = s.negative_after = s.point.negative
        for point in branch.points:
            if id(point) not in special and id(point) not in first:
                compare = self.error_bars and doubtful
                self._of(point).examine(point, fixed_load=False, compare=compare, family=family)
        if self.error_bars and doubtful:
            self._leave_out_doubtful(branch, family=family)
            _doubt_between(branch)
        for fold in (s for s in branch.special if s.kind == FOLD):
            self._change_at_fold(fold, branch.points)

    def _leave_out_doubtful(self, branch: Branch, *, family: bool) -> None:
        """Make rows of special points that are zeros of the mesh, not of the rod."""
        rows = [p for p in branch.points if not any(p is s.point for s in branch.special)]
        left_out = [_is_of_the_mesh(s, rows) for s in branch.special]
        for s in compress(branch.special, left_out):
            self._of(s.point).examine(s.point, fixed_load=False, compare=True, family=family)
        branch.special[:] = [s for s, out in zip(branch.special, left_out, strict=True) if not out]

    def _is_family(self, branch: Branch) -> bool:
        """Whether a branch is a family of equilibria at one load; the slope is small beside a fold, too."""
        span, singular = self.meshes.solvers[0].system.scene.span, {id(s.point) for s in branch.special}
        begin = 1 if branch.parent else 0  # a pitchfork begins without a slope
        rows = [p for p in branch.points[begin:] if id(p) not in singular]
        return bool(rows) and all(abs(p.slope) < VERTICAL * abs(span[1] - span[0]) for p in rows)

    @staticmethod
    def _change_at_fold(fold: SpecialPoint, rows: Sequence[Point]) -> None:
        """Give a simple fold, where a count has one index on both sides, those of the nearest ``rows`` decided."""
        if fold.multiplicity != 1 or fold.negative_before != fold.negative_after:
            return
        decided = [p for p in rows if not p.undecided and p is not fold.point]
        left = [p.negative for p in decided if p.arclength < fold.point.arclength][-1:]
        right = [p.negative for p in decided if p.arclength > fold.point.arclength][:1]
        if left and right and abs(left[0] - right[0]) == 1:
            fold.negative_before, fold.negative_after = left[0], right[0]

    def undecided(self, branch: Branch) -> Iterator[str]:
        """Yield a sentence on each piece of a branch whose index is not decided, or not compared with a richer mesh."""
        if branch.name in self._uncompared:
            at, why = self._uncompared.pop(branch.name)
            name = self.meshes.solvers[0].system.scene.load
            yield f"{branch.name}: At {name} = {at:.8g} the index is not compared with that of a richer mesh. {why}"
        for words, group in groupby(branch.points, lambda p: p.undecided and index_range(p.negative, p.undecided)):
            if words:
                points = list(group)
                solver = self.meshes.solvers[points[0].mesh]
                worst = max((m for p in points for m in p.soft if not m.decided), key=lambda m: m.uncertainty)
                least = TOLERANCE * solver.inertia.scale
                remedy = FINER if worst.uncertainty > CLEARLY * least else EXACT
                if remedy == FINER and not self.error_bars and worst.uncertainty <= solver.inertia.tolerance:
                    remedy = BARS
                low, high = (f"{p.load:.8g}" for p in (points[0], points[-1]))
                load = solver.system.scene.load
                where = f"At {load} = {low}" if len(points) == 1 else f"From {load} = {low} to {high}"
                yield f"{branch.name}: {where} the index is {words} ({worst}): {remedy}."

    def _of(self, point: Point) -> SoftStates:
        """Soft states of the mesh of a point."""
        if point.mesh not in self._states:
            richer = (lambda mesh=point.mesh: self.meshes.richer(mesh)) if self.error_bars else None
            self._states[point.mesh] = SoftStates(self.meshes.solvers[point.mesh], richer)
        return self._states[point.mesh]


def _doubt_between(branch: Branch) -> None:
    """Let a row be undecided if both its neighbours are, by as much: there two meshes agree on a value by chance."""
    special = {id(s.point) for s in branch.special}
    for before, row, after in zip(branch.points, branch.points[1:], branch.points[2:], strict=False):
        doubt = before.negative, before.undecided
        if not row.undecided and doubt == (after.negative, after.undecided) and doubt[1] and id(row) not in special:
            if row.negative_in_space is not None:
                row.negative_in_space += doubt[0] - row.negative
            row.negative, row.undecided, row.soft = *doubt, before.soft


def _is_of_the_mesh(special: SpecialPoint, rows: Sequence[Point]) -> bool:
    """Whether a ``special`` point is the mesh's, by the ``rows``: on one side the next two are undecided.

    One is enough if the richer mesh has no such point; a single one may be next to a special point by chance.  Not if
    the decided indices on both sides differ by its own change, and as much is undecided: that is another mode.
    """
    first = sum(p.arclength < special.point.arclength for p in rows)
    before, after, number = rows[:first][::-1], rows[first:], 2 if isfinite(special.error_estimate) else 1
    doubtful = any(sum(p.undecided > 0 for p in side[:number]) == number for side in (before, after))
    change = [(q.negative - p.negative, q.undecided - p.undecided) for p, q in zip(before[:1], after[:1], strict=False)]
    return special.kind.singular and doubtful and change != [(special.negative_after - special.negative_before, 0)]

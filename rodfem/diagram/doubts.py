"""What rows of a branch leave open: eigenvalues that stay zero, equations that a mesh does not integrate, kinks.

Eigenvalues that stay zero along a branch, without a symmetry of the scene, are those of a family of states at one load.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import isfinite, nan

from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import VERTICAL
from rodfem.continuation.kinds import END
from rodfem.continuation.observer import Observer, Remark
from rodfem.errors import many
from rodfem.fem.checks import QuadratureCheck
from rodfem.fem.newton import TOLERANCE
from rodfem.stability.motion_names import names_for
from rodfem.stability.near_zero import resolve

SHARE, ROWS = 8, 4
"""Part of the points of a composite rule, where few do; rows in sequence with as many zeros, before these stay."""


class PersistentZeros:
    """Watches the rows of a run for zero eigenvalues; an ``observer`` hears of the first that stay."""

    def __init__(self, observer: Observer, width: float) -> None:
        self.observer, self.width, self.reported = observer, width, False

    def extra(self, solver: BranchSolver, point: Point) -> int:
        """Zero eigenvalues, apart from symmetries' and the branch's own, of a point."""
        vertical = abs(point.slope) < VERTICAL * self.width  # the branch itself is a family at one load
        return point.zero - solver.system.active_drifts(point.x) - vertical

    def damp(self, solver: BranchSolver, point: Point) -> None:
        """Damp Newton's method of a ``solver`` where those of a ``point`` are zero, to round-off."""
        extra = self.extra(solver, point)
        solver.damp(_exact(solver, (point,), extra) if extra > 0 else 0)

    def check(self, solver: BranchSolver, history: Sequence[Point], point: Point, level: int) -> None:
        """Damp Newton's method where eigenvalues stay zero, and say so once; a branch has had ``level`` all along.

        With damping the tangent is one of other equations, by the tolerance of a count over the least eigenvalue: of
        one that is not zero but within that tolerance, next to a fold, the load's part of it has no digit.
        """
        extra = self.extra(solver, point)
        recent = history[-ROWS:]
        if extra <= 0 or {p.zero for p in recent} != {point.zero}:
            solver.damp(0)
            return
        if not solver.system.damping:
            solver.damp(_exact(solver, (point,), extra))
        if len(recent) == ROWS and point.zero <= level and not self.reported:
            self.reported = True
            self._say(solver, recent[0], point, extra)

    def _say(self, solver: BranchSolver, before: Point, point: Point, extra: int) -> None:
        """Report eigenvalues that are zero at two rows: to round-off, or to what Newton's method leaves of a state."""
        found = names_for(solver.system)(before.x, solver.inertia.modes_near_zero(before.x, extra))
        stay = f"  {many(extra, 'eigenvalue stays', 'eigenvalues stay')} zero that no symmetry of the scene explains "
        stay += f"({', '.join(dict.fromkeys(found))})"
        if _exact(solver, (before, point), extra) == extra:
            self.observer.note(f"{stay}: these states may turn or move freely at one and the same load")
        else:
            self.observer.note(f"{stay}, to what a state leaves open ({TOLERANCE:.0e} of bending): signs are open")


def _exact(solver: BranchSolver, points: Sequence[Point], extra: int) -> int:
    """How many ``extra`` eigenvalues, counted as zero at ``points``, are zero to round-off at one of them."""
    exact, last = 0, points[-1]
    own = last.zero - solver.system.active_drifts(last.x) - extra
    for point in points:
        low, high = resolve(solver.inertia.at(point.x))
        exact = min(max(exact, high - low - own), extra)
    return exact


def _bounded(special: SpecialPoint) -> bool:
    """Whether a special point has a bar, or is an end."""
    return isfinite(special.error_estimate) or special.kind == END


class Quadrature:
    """Examines branches on the meshes of several ``solvers``, and tells an ``observer`` what is left open."""

    def __init__(self, solvers: Sequence[BranchSolver], observer: Observer, load: str) -> None:
        self.observer, self.load = observer, load
        self._on = cache(lambda mesh: QuadratureCheck(solvers[mesh].system))

    def examine(self, branch: Branch) -> None:
        """Take the bars of points away where the equations are not integrated, mark rows on a kink, and say so."""
        asked = [special for special in branch.special if _bounded(special)]
        found = [(s.point, self._without_bars(s, branch)) for s in asked if s.resolved is not False]
        self._kinks(branch, [*branch.points[: branch.parent is None], *(special.point for special in asked)])
        self._say(branch, [(point, words) for point, words in found if not point.kink])
        none = "the ordinate is not a finite number, and perhaps at other loads: return one at every state."
        self._say(branch, [(point, "" if isfinite(point.ordinate) else none) for point in branch.points])

    def _say(self, branch: Branch, found: Sequence[tuple[Point, str]]) -> None:
        """Say the first thing that was found."""
        for point, words in [(point, words) for point, words in found if words][:1]:
            self.observer.warn(Remark(f"{branch.name}: at {self.load} = {point.load:.6g} {words}", point.load))

    def _without_bars(self, special: SpecialPoint, branch: Branch) -> str:
        """Take the bars of a special point away where the equations are not integrated, and say why.

        What varies along the rod is felt at the end of a branch that left no other: few points do for all else.
        """
        point = special.point
        if words := self._on(point.mesh)(point.x, 1 if branch.parent is None and special.kind == END else SHARE):
            special.error_estimate = special.ordinate_error = point.estimate = special.omega2_error = nan
            special.resolved = None
            special.note = "; ".join(filter(None, (special.note, "not estimated: see the warnings")))
        return words

    def _kinks(self, branch: Branch, asked: Sequence[Point]) -> None:
        """Leave the stability of rows on a kink undecided, and say so, where one of some points is on a kink."""
        if not any(self._on(point.mesh).kink(point.x) for point in asked):
            return
        for point in branch.points:
            point.kink = self._on(point.mesh).kink(point.x)
        loads = [point.load for point in branch.points if point.kink]
        where = " to ".join(dict.fromkeys((f"{loads[0]:.6g}", f"{loads[-1]:.6g}")))
        words = (
            f"{branch.name}: the equations have a kink at the very state at {self.load} = {where}: the second "
            "derivative depends on the side, the index holds for one side only, and stability is undecided there."
        )
        self.observer.warn(Remark(words, *loads))

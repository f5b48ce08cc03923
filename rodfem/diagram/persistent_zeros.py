"""Eigenvalues that stay zero along a branch without a symmetry of the scene: its states are a family at one load."""

from __future__ import annotations

from collections.abc import Sequence

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.observer import Observer
from rodfem.stability.round_off import resolve

ROWS = 4
"""Rows one after the other that have as many zero eigenvalues, before these are said to stay."""


class PersistentZeros:
    """Watches the rows of a run for zero eigenvalues; an ``observer`` hears of the first that stay."""

    def __init__(self, observer: Observer, width: float) -> None:
        """Nothing is said yet; ``width`` is that of the range of loads."""
        self.observer, self.width = observer, width
        self.said = False

    def extra(self, solver: BranchSolver, point: Point) -> int:
        """Zero eigenvalues, beside symmetries' and the branch's own, of a point."""
        vertical = abs(point.slope) < VERTICAL * self.width  # the branch itself is a family at one load
        return point.zero - solver.system.active_drifts(point.x) - vertical

    def check(self, solver: BranchSolver, history: Sequence[Point], point: Point, level: int) -> None:
        """Damp Newton's method where eigenvalues stay zero, and say so once.

        ``history`` has the rows of a ``solver`` before the ``point``; a branch has had ``level`` zeros all along.
        """
        extra = self.extra(solver, point)
        recent = [p for p in history[-ROWS:] if p.arclength > 0.0]  # a branch point has zeros of its own
        stay = extra > 0 and bool(recent) and all(p.zero == point.zero for p in recent)
        solver.damp(extra if stay else 0)
        if stay and len(recent) == ROWS and point.zero <= level and not self.said:
            self.said = True
            self._say(solver, recent[0], point, extra)

    def _say(self, solver: BranchSolver, before: Point, point: Point, extra: int) -> None:
        """Report eigenvalues that count as zero at two rows: within round-off, or persistently zero."""
        system, inertia, still = solver.system, solver.inertia, 0
        own = point.zero - system.active_drifts(point.x) - extra
        for p in (before, point):
            low, high = resolve(inertia.at(p.x))
            still = min(max(still, high - low - own), extra)
        if still:
            self.observer.note(
                f"  {still} eigenvalue(s) stay zero that no symmetry of the scene explains: these states may turn or "
                "move freely at one and the same load"
            )
        if extra > still:
            self.observer.note(
                f"  {extra - still} eigenvalue(s) are within {inertia.tolerance / inertia.scale:.0e} of zero, relative "
                "to the lowest bending eigenvalue, without being zero: a critical load is close to "
                f"{system.scene.load} = {before.load:.8g}"
            )

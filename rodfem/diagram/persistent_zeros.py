"""Eigenvalues that stay zero along a branch without a symmetry of the scene: its states are a family at one load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.observer import Observer
from rodfem.fem.newton import TOLERANCE
from rodfem.stability.near_zero import resolve
from rodfem.stability.nonsymmetric import Frequencies, NonsymmetricPencil
from rodfem.tolerances import DRIFT

ROWS = 4
"""Rows one after the other that have as many zero eigenvalues, before these are said to stay."""


def family_of(pencil: NonsymmetricPencil, found: Frequencies, least: int) -> str:
    """In words the frequencies of a sweep that stay zero without a symmetry; empty where there are none.

    Frequencies and critical loads are those of one state of a family then: a rod may turn about its axis, between
    springs that are not alike all around it.  Zero eigenvalues of a symmetry's Jordan block are none of these: ``S v =
    -d M g`` with its generator ``g``, and a drift scalar ``d`` that is not zero.  Of a rod that floats, which has many
    of both, nothing is said.

    Parameters
    ----------
    pencil, found
        Pencil of a state, and the eigenvalues ``found`` of it.
    least
        Least number of eigenvalues that are zero at any load of the sweep, those of symmetries left out.
    """
    system, moving = pencil.system, list[str]()
    if found.floating:
        return ""
    for i in np.flatnonzero(abs(found.values) < found.noise).tolist():
        mode = system.new_vector()
        mode.array[:] = found.vectors[:, i].real
        if system.drift(mode) <= DRIFT * system.stiffness_scale * system.norm(mode):
            moving.append(pencil.motion(found.vectors[:, [i]].real))
    number = min(len(moving), least)
    if number == 0:
        return ""
    names = ", ".join(dict.fromkeys(moving))
    return (
        f"{number} frequency(ies) stay zero that no symmetry of the scene explains ({names}): the rod may turn or move "
        "freely, and frequencies and critical loads are those of the state that its start leads to; others differ."
    )


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

    def damp(self, solver: BranchSolver, point: Point) -> None:
        """Damp Newton's method of a ``solver`` where those of a ``point`` are zero, to round-off."""
        extra = self.extra(solver, point)
        solver.damp(_still(solver, (point,), extra) if extra > 0 else 0)

    def check(self, solver: BranchSolver, history: Sequence[Point], point: Point, level: int) -> None:
        """Damp Newton's method where eigenvalues stay zero, and say so once.

        With damping the tangent is one of other equations, by the tolerance of a count over the least eigenvalue: of
        one that is not zero but within that tolerance, beside a fold, the load's part of it has no digit.

        ``history`` has the rows of a ``solver`` before the ``point``; a branch has had ``level`` zeros all along.
        """
        extra = self.extra(solver, point)
        recent = [p for p in history[-ROWS:] if p.arclength > 0.0]  # a branch point has zeros of its own
        stay = extra > 0 and bool(recent) and all(p.zero == point.zero for p in recent)
        if not (stay and solver.system.damping):
            solver.damp(_still(solver, (point,), extra) if stay else 0)
        if stay and len(recent) == ROWS and point.zero <= level and not self.said:
            self.said = True
            self._say(solver, recent[0], point, extra)

    def _say(self, solver: BranchSolver, before: Point, point: Point, extra: int) -> None:
        """Report eigenvalues that are zero at two rows: to round-off, or to what Newton's method leaves of a state."""
        load, still = solver.system.scene.load, _still(solver, (before, point), extra)
        if still:
            self.observer.note(
                f"  {still} eigenvalue(s) stay zero that no symmetry of the scene explains: these states may turn or "
                "move freely at one and the same load"
            )
        if extra > still:
            self.observer.note(
                f"  {extra - still} eigenvalue(s) stay within {TOLERANCE:.0e} of zero, relative to the lowest bending "
                f"eigenvalue, from {load} = {before.load:.8g} to {point.load:.8g} at least, without being zero to "
                "round-off: Newton's method leaves that open of a state, their sign is undecided"
            )


def _still(solver: BranchSolver, points: Sequence[Point], extra: int) -> int:
    """How many ``extra`` eigenvalues, counted as zero at ``points``, are zero to round-off at one of them."""
    still, last = 0, points[-1]
    own = last.zero - solver.system.active_drifts(last.x) - extra
    for point in points:
        low, high = resolve(solver.inertia.at(point.x))
        still = min(max(still, high - low - own), extra)
    return still

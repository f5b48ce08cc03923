"""Whether meshes integrate the equations, asked at the first state, and where a branch has bars, or ends."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import END
from rodfem.continuation.observer import Observer
from rodfem.fem.quadrature_check import QuadratureCheck


class Quadrature:
    """Examines branches on the meshes of several ``solvers``, and tells an ``observer`` what is left open."""

    def __init__(self, solvers: Sequence[BranchSolver], observer: Observer, load: str) -> None:
        """Examine nothing yet; ``load`` is the name of the load."""
        self.solvers, self.observer, self.load = solvers, observer, load
        self._by_mesh: dict[int, QuadratureCheck] = {}

    def examine(self, branch: Branch) -> None:
        """Take the bars of points away where the equations are not integrated, mark rows on a kink, and say so.

        Of a state that the mesh does not resolve its bar says so.
        """
        first = branch.points[:1] if branch.parent is None else []
        found = [(point, self._check(point)(point.x)) for point in first]
        asked = [s for s in branch.special if isfinite(s.error_estimate) or s.kind == END]
        for special in (s for s in asked if s.resolved is not False):
            point = special.point
            if not (words := self._check(point)(point.x)):
                continue
            found.append((point, words))
            special.error_estimate = special.ordinate_error = point.estimate = special.omega2_error = float("nan")
            special.resolved = None
            special.note = "; ".join(filter(None, (special.note, "not estimated: see the warnings")))
        if any(self._check(point).kink(point.x) for point in [*first, *(special.point for special in asked)]):
            self._kinks(branch)
        for point, words in found:
            if words and not point.kink:
                self.observer.warn(f"{branch.name}: at {self.load} = {point.load:.6g} {words}")
                return

    def _kinks(self, branch: Branch) -> None:
        """Leave the stability of rows on a kink undecided, and say so."""
        for point in branch.points:
            point.kink = self._check(point).kink(point.x)
        loads = [f"{point.load:.6g}" for point in branch.points if point.kink]
        where = " to ".join(dict.fromkeys((loads[0], loads[-1])))
        self.observer.warn(
            f"{branch.name}: the equations have a kink at the very state at {self.load} = {where}: the second "
            "derivative depends on the side, the index holds for one side only, and stability is undecided there."
        )

    def _check(self, point: Point) -> QuadratureCheck:
        if point.mesh not in self._by_mesh:
            self._by_mesh[point.mesh] = QuadratureCheck(self.solvers[point.mesh].system)
        return self._by_mesh[point.mesh]

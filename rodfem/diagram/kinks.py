"""Kinks of the energies in the states of a branch: no bar holds where one is, and no index where the state is on one.

Of bars see :mod:`rodfem.fem.nonsmooth`.  A state that is on a kink has a second variation for each side of it,
of which the equations have one.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.observer import Observer
from rodfem.continuation.static_solver import StaticSolver
from rodfem.fem.nonsmooth import Nonsmooth, Reasons, listed


class Kinks:
    """Examines branches on the meshes of several ``solvers``, and tells an ``observer`` what is left open."""

    def __init__(self, solvers: Sequence[StaticSolver], observer: Observer, load: str) -> None:
        """Examine nothing yet; ``load`` is the name of the load."""
        self.solvers, self.observer, self.load = solvers, observer, load
        self._by_mesh: dict[int, Nonsmooth] = {}

    def error_bars(self, branch: Branch) -> None:
        """Take the bars of special points with a kink inside of the rod away, and say so."""
        reasons = Reasons([], [])
        for special in branch.special:
            if here := self._nonsmooth(special.point)(special.point.x):
                special.error_estimate = special.ordinate_error = special.point.estimate = float("nan")
                special.omega2_error = float("nan")
                special.resolved = None
                special.note = "; ".join(filter(None, (special.note, here.remark)))
                reasons += here
        if reasons:
            self.observer.warn(f"{branch.name}: {reasons.sentence}")

    def index(self, branch: Branch) -> None:
        """Leave the stability of rows on a kink undecided, and say so."""
        met = [(point, words) for point in branch.points if (words := self._nonsmooth(point).kinks(point.x).on)]
        if not met:
            return
        for point, words in met:
            point.kink = listed(words)
        loads = [f"{point.load:.6g}" for point, _ in (met[0], met[-1])]
        where = f"at {self.load} = {loads[0]}" + (f" to {loads[1]}" if loads[1] != loads[0] else "")
        functions = listed(word for _, words in met for word in words)
        self.observer.warn(
            f"{branch.name}: the {functions} has a kink at the very state {where}: the second "
            "derivative depends on the side, the index holds for one side only, and stability is undecided there."
        )

    def _nonsmooth(self, point: Point) -> Nonsmooth:
        if point.mesh not in self._by_mesh:
            self._by_mesh[point.mesh] = Nonsmooth(self.solvers[point.mesh].shape)
        return self._by_mesh[point.mesh]

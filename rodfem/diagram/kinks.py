"""Kinks of the energies in the states of a branch: no bar holds where one is, and no index where the state is on one.

Where an energy changes from one side of a kink to the other inside of the rod, states are as smooth as the kink lets
them be: with more elements they converge by a low power of their length, and two meshes may have the kink alike.  A
state that is on a kink has a second variation for each side of it, of which the equations have one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.observer import Observer
from rodfem.continuation.static_solver import StaticSolver
from rodfem.fem.kinks_at import KinksAt, Met

NO_BAR = "not estimated: a kink in the state"
"""Remark at a special point without an error bar."""


class Kinks:
    """Examines branches on the meshes of several ``solvers``, and tells an ``observer`` what is left open."""

    def __init__(self, solvers: Sequence[StaticSolver], observer: Observer, load: str) -> None:
        """Examine nothing yet; ``load`` is the name of the load."""
        self.solvers, self.observer, self.load = solvers, observer, load
        self._by_mesh: dict[int, KinksAt] = {}

    def error_bars(self, branch: Branch) -> None:
        """Take the bars of special points with a kink inside of the rod away, and say so."""
        words: list[str] = []
        for special in branch.special:
            if inside := self._met(special.point).inside:
                special.error_estimate = special.ordinate_error = special.point.estimate = float("nan")
                special.omega2_error = float("nan")
                special.resolved = None
                special.note = "; ".join(filter(None, (special.note, NO_BAR)))
                words += inside
        if words:
            self.observer.warn(no_bars(branch.name, words))

    def index(self, branch: Branch) -> None:
        """Leave the stability of rows on a kink undecided, and say so."""
        met = [(point, words) for point in branch.points if (words := self._met(point).on)]
        if not met:
            return
        if len(met) > 1:
            for point, _ in met:
                point.undecided = max(point.undecided, 1)
        loads = [f"{point.load:.6g}" for point, _ in (met[0], met[-1])]
        where = f"at {self.load} = {loads[0]}" + (f" to {loads[1]}" if loads[1] != loads[0] else "")
        self.observer.warn(
            f"{branch.name}: the {_listed(words for _, words in met)} has a kink at the very state {where}: the second "
            "derivative depends on the side, the index holds for one side only, and stability is undecided there."
        )

    def _met(self, point: Point) -> Met:
        if point.mesh not in self._by_mesh:
            self._by_mesh[point.mesh] = KinksAt(self.solvers[point.mesh].shape)
        return self._by_mesh[point.mesh](point.x)


def no_bars(name: str, words: Sequence[str]) -> str:
    """Sentence on the functions, in ``words``, whose kinks leave special points of a branch ``name`` without bars."""
    return (
        f"{name}: the {_listed([words])} has a kink in the state inside of the rod, with which convergence is "
        "algebraic and two meshes may err alike: no error is estimated where that is, and no accuracy is certain; "
        "compare meshes of many elements."
    )


def _listed(words: Iterable[Sequence[str]]) -> str:
    """Words of several lists, each once."""
    return " and the ".join(dict.fromkeys(word for some in words for word in some))

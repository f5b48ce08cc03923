"""Changes of an energy between two rows of a branch that no row shows: what they lead to may be missing."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from rodfem.continuation.branch import Branch
from rodfem.continuation.observer import Observer
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import SMALLER_STEPS
from rodfem.fem.stiffnesses_at import StiffnessesAt


class HiddenChanges:
    """Examines branches on the meshes of several ``solvers``, and tells an ``observer`` of such changes."""

    def __init__(self, solvers: Sequence[StaticSolver], observer: Observer, load: str) -> None:
        """Examine nothing yet; ``load`` is the name of the load."""
        self.solvers, self.observer, self.load = solvers, observer, load
        self._by_mesh: dict[int, StiffnessesAt] = {}

    def examine(self, branch: Branch) -> None:
        """Say between which rows second derivatives of an energy are far from those at the rows."""
        for mesh, group in groupby(branch.points, key=lambda point: point.mesh):
            rows = list(group)
            if mesh not in self._by_mesh:
                self._by_mesh[mesh] = StiffnessesAt(self.solvers[mesh].shape)
            for i, what in self._by_mesh[mesh]([row.x for row in rows]).items():
                self.observer.warn(
                    f"{branch.name}: between {self.load} = {rows[i].load:.8g} and {rows[i + 1].load:.8g} the {what} "
                    "stiffens or softens, in the state, and changes back: special points may be missing there; "
                    f"{SMALLER_STEPS}."
                )

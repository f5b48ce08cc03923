"""Unstable eigenvalues of a sweep that are not among those that it follows: looked for from time to time, and said.

Of a mesh with many rows only the last row of the sweep is looked at; of one with very many none is, which is said.
"""

from __future__ import annotations

from rodfem.continuation.branch import Point
from rodfem.continuation.observer import Observer
from rodfem.stability.census import MANY, census
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.outside import LARGEST

OFTEN = 5
"""Rows from one look at all eigenvalues of the mesh to the next."""


class Unfollowed:
    """Looks at all eigenvalues of the mesh at some rows that are stable by those that are followed."""

    def __init__(self, eigensolver: NonsymmetricSolver, observer: Observer) -> None:
        """Look with the matrices of the ``eigensolver``; the ``observer`` is warned, once."""
        self.eigensolver, self.observer = eigensolver, observer
        self._rows, self._said = 0, False

    def look(self, point: Point, *, last: bool) -> None:
        """Look at the ``point`` of the next row, if it is the ``last`` or its turn."""
        self._rows += 1
        if self._said or point.negative or not (last or self._rows % OFTEN == 1):
            return
        found = census(self.eigensolver.at(point.x), MANY if last else LARGEST)
        if found is None and last:
            self.observer.note(
                f"  the mesh has too many unknowns to look at all its eigenvalues at {point.load:.6g}: that the rod is "
                "stable there is said of those nearest zero"
            )
        if found is None or not len(found.unstable):
            return
        self._said = True
        value, number = found.unstable[-1], int(found.nearer[-1]) + 1
        self.observer.warn(
            f"At {self.eigensolver.system.scene.load} = {point.load:.6g} an eigenvalue of this mesh, omega^2 = "
            f"{value:.6g}, is unstable and is not among those that are followed, as {number - 1} others "
            "are nearer to zero. The rod may be unstable before and beyond, whatever else is said of it: ask for more "
            f"frequencies, spectrum={number}."
        )

"""Unstable eigenvalues of a sweep that are not among those that it follows: looked for from time to time, and said.

Of a mesh with many rows fewer rows of the sweep are looked at, among them the last one that is stable; of one with very
many none is, which is said.  Between the looks :mod:`rodfem.diagram.far_meetings` tells what may come and go.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodfem.continuation.branch import Point
from rodfem.continuation.observer import Observer
from rodfem.errors import ConvergenceError
from rodfem.stability.census import MANY, Census, census
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.outside import LARGEST

if TYPE_CHECKING:
    from rodfem.diagram.far_meetings import FarMeetings
    from rodfem.diagram.hidden_events import Lowest

OFTEN = 5
"""Rows from one look at all eigenvalues of the mesh to the next."""
RARELY = 25
"""The same of a mesh with many rows, where a look takes up to a second."""


class Unfollowed:
    """Looks at all eigenvalues of the mesh at some rows: more may be unstable than those that are followed."""

    def __init__(self, eigensolver: NonsymmetricSolver, far: FarMeetings, observer: Observer) -> None:
        """Look with the matrices of the ``eigensolver``; the ``observer`` is told, once.

        ``far`` compares what is seen at one look with what is seen at others.
        """
        self.eigensolver, self.observer, self.far = eigensolver, observer, far
        self._rows, self._said = 0, False
        self._stable: Point | None = None

    def look(self, point: Point, *, last: bool) -> None:
        """Look at the ``point`` of the next row, if it is the ``last`` or it is time, or at the last stable one."""
        self._rows += 1
        if self._said:
            return
        if point.negative and self._stable is not None:
            self._examine(self._stable, MANY)
            self._stable = None
        rarely, often = (last or self._rows % every == 1 for every in (RARELY, OFTEN))
        largest = MANY if rarely else LARGEST
        looked = often and not self._said and self._examine(point, largest, said=last)
        self._stable = None if looked or point.negative else point

    def _examine(self, point: Point, largest: int, *, said: bool = True) -> bool:
        """Look at a point of a mesh with up to so many rows; False for one with more, which is ``said`` or not."""
        found = census(self.eigensolver.at(point.x), largest)
        if found is None and said:
            self.observer.note(
                f"  the mesh has too many unknowns to look at all its eigenvalues at {point.load:.6g}: that the rod is "
                "stable there is said of those nearest zero"
            )
        if found is not None and len(found.unstable) > point.negative:
            self._warn(point.load, point.negative, found)
        elif found is not None and not self._said:
            self._meetings(point, found)
        return found is not None

    def _meetings(self, point: Point, found: Census) -> None:
        """Say what may come and go between the last looks and this one."""
        name = self.eigensolver.system.scene.load
        try:
            for lowest in self.far.look(point, found):
                self._meeting(point, lowest)
        except ConvergenceError as trouble:
            self.observer.note(
                f"  whether frequencies that are not followed meet, and part again, before {name} = {point.load:.6g} "
                f"is not known ({trouble})"
            )

    def _meeting(self, point: Point, lowest: Lowest) -> None:
        """Say that eigenvalues meet, or may, and have parted at the ``point``."""
        if self._said:
            return
        found = census(self.far.hidden.measured(point.x).pencil(lowest.load))
        if found is not None and len(found.unstable) > point.negative:
            self._warn(lowest.load, point.negative, found)
            return
        self._said = True
        self.observer.warn(
            f"Two frequencies beyond those that are followed come so near one another at "
            f"{self.eigensolver.system.scene.load} = {lowest.load:.8g}, omega^2 = {lowest.cluster.mean:.6g}, that "
            "whether they meet there, and part again, is not known."
        )

    def _warn(self, load: float, negative: int, found: Census) -> None:
        """Say which eigenvalue is unstable at a ``load``, where so many are known to be (``negative``)."""
        self._said = True
        value, number = found.unstable[-1], int(found.nearer[-1]) + 1
        where = f"{self.eigensolver.system.scene.load} = {load:.6g}"
        if negative:  # unstable all the same
            self.observer.note(
                f"  at {where} {len(found.unstable)} eigenvalues of this mesh are unstable, and {negative} are "
                f"counted, as others are nearer to zero: for the loads of all of them spectrum={number} is needed"
            )
            return
        self.observer.warn(
            f"At {where} an eigenvalue of this mesh, omega^2 = {value:.6g}, is unstable and is not among those that "
            f"are followed, as {number - 1} others are nearer to zero. The rod may be unstable before and beyond, "
            f"whatever else is said of it: ask for more frequencies, spectrum={number}."
        )

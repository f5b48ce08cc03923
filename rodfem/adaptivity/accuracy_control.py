"""Control of the accuracy of a branch while it is traced.

The error of a point is computed on a richer mesh now and then; in between the decay of its Legendre coefficients tells
how it has changed (:mod:`rodfem.adaptivity.grading`).  If it is too large, :class:`TooCoarse` is raised: the explorer
has a mesh made for that state, carries the last points over, and goes on (:mod:`rodfem.adaptivity.mesh_sequence`).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, isnan

import numpy as np

from rodfem.adaptivity.error_estimate import Again, Enriched
from rodfem.adaptivity.mesh_sequence import Meshes, TooCoarse
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.observer import Observer, Remark
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import correct
from rodfem.stability.inertia import ROUGH
from rodfem.tolerances import SAME_LOAD, TINY, unit

SHARP = 1e-9
"""For a better accuracy than this points get one more step of Newton's method, to round-off."""
POLISHED = 1e-3
"""Distance, in the metric, that it may move a point by at most."""
TRIES, MOST = 4, 16
"""Meshes tried at one place, and in a run."""
GROWN, SELDOM = 1.5, 10
"""An error is computed again where the indicator has grown by this factor, and at the latest after so many points."""
NEAR = 0.1
"""Points of a branch nearer to each other than this, in arclength, are at one place."""


@dataclass
class Checked:
    """A point whose error was computed: its indicator, its error, and how many points came since."""

    indicator: float
    error: float
    since: int = 0


class AccuracyControl:
    """Watches over the accuracy of the points of one branch."""

    def __init__(self, meshes: Meshes, bounds: tuple[float, float]) -> None:
        """Begin a branch; its points at the ``bounds`` of the load are judged at that very load."""
        self.meshes, self.bounds = meshes, bounds
        self.units = meshes.solvers[0].units
        self.checked: Checked | None = None
        self.place, self.error, self.tries = -np.inf, np.inf, 0
        self.excused = -np.inf

    @property
    def accuracy(self) -> float:
        """The accuracy asked for, infinite without one."""
        return self.meshes.accuracy or np.inf

    def row(self, point: Point, solver: BranchSolver) -> None:
        """Estimate the error of a point, by computation where need be; raises :class:`TooCoarse`."""
        if self.meshes.accuracy is None:
            return
        if self.accuracy < SHARP:
            self._polish(point, solver)
        indicator = self.meshes.indicator(solver.mesh)(point.x).indicator
        last = self.checked
        if last is not None and last.since < SELDOM and not self._at_bound(point):
            point.estimate = last.error * max(1.0, indicator / last.indicator)
            if indicator < GROWN * last.indicator or 10 * point.estimate < self.accuracy:
                last.since += 1
                return
        with solver.system.clock.scope("error bars"):
            point.estimate = self._computed(point)
        self.checked = Checked(max(indicator, TINY), point.estimate)
        if point.estimate * GROWN > self.accuracy and point.arclength > self.excused:
            raise TooCoarse(point, point.estimate)

    def special(self, special: SpecialPoint) -> None:
        """Estimate the errors of a special point; raises :class:`TooCoarse` where another mesh may help."""
        if self.meshes.accuracy is None:
            return
        with self.meshes.solvers[special.point.mesh].system.clock.scope("error bars"):
            self.meshes.richer(special.point.mesh).estimate(special)
        self.check(special)

    def check(self, special: SpecialPoint) -> None:
        """Raise :class:`TooCoarse` for a special point with too large an error, where another mesh may help."""
        error = self._error_of(special)
        located = special.located_to / unit(special.point.load, one=self.units.load)
        if error > self.accuracy > located and special.point.arclength > self.excused:
            raise TooCoarse(
                special.point, error, special.null_vectors, 2.0 if special.test_function == "stretch" else 1.0
            )

    def _error_of(self, special: SpecialPoint) -> float:
        """Estimated error of a special point; never within the accuracy where the mesh does not resolve its state."""
        error = self.meshes.error_of(special)
        return max(error, GROWN * self.accuracy) if special.resolved is False else error

    def drifting(self, point: Point) -> None:
        """Raise :class:`TooCoarse` for a point at which the mesh breaks a symmetry, where another mesh may help."""
        if self.meshes.accuracy is not None and point.arclength > self.excused:
            raise TooCoarse(point, float("inf"), why="the mesh breaks a symmetry")

    def label(self, special: SpecialPoint) -> None:
        """Say at a special point whether the accuracy was not reached, and why."""
        if self.meshes.accuracy is None:
            return
        special.point.estimate = error = self._error_of(special)
        if error > self.accuracy:
            located = special.located_to / unit(special.point.load, one=self.units.load) > self.accuracy
            why = f"located to {special.located_to:.0e} only" if located else "finer meshes did not lower the error"
            missed = f"accuracy {self.accuracy:g} not reached: {why}"
            special.note = f"{special.note}; {missed}" if special.note else missed

    def summary(self, branch: Branch, observer: Observer) -> None:
        """Say on which meshes a branch was traced, and the largest error of its points."""
        if self.meshes.accuracy is None:
            return
        used = [self.meshes.solvers[number].system for number in sorted({p.mesh for p in branch.points})]
        worst = max(p.estimate for p in branch.points if not isnan(p.estimate))
        observer.accuracy(used, worst, self.meshes.accuracy)

    def another(self, trouble: TooCoarse, observer: Observer) -> BranchSolver | None:
        """Solver on a mesh for the state that was too coarse; None, which is reported, where no mesh helps there."""
        if abs(trouble.point.arclength - self.place) < NEAR:
            self.tries += 1
            helps = not isfinite(trouble.error) or trouble.error < 0.5 * self.error
        else:
            self.tries, helps = 0, True
        self.place, self.error = trouble.point.arclength, trouble.error
        self.checked = None
        if not helps or self.tries >= TRIES or len(self.meshes.solvers) >= MOST:
            self.excused = trouble.point.arclength + NEAR
            why = "finer meshes do not lower the error" if not helps else f"{self.tries + 1} finer meshes did not do"
            if len(self.meshes.solvers) >= MOST:
                why = f"{MOST} meshes are the most"
            load = trouble.point.load
            observer.warn(Remark(f"The accuracy is not reached near load {load:.6g} ({trouble}): {why}.", load))
            return None
        return self.meshes.raised(trouble, self.tries)

    def _polish(self, point: Point, solver: BranchSolver) -> None:
        """Solve a point once more where its last correction was not far below the accuracy."""
        if point.tangent is None or point.error < 0.01 * self.accuracy or point.error == 0.0:
            return
        system = solver.system
        row = solver.axis if self._at_bound(point) else solver.row(point.tangent)
        point.error = correct(system, point.x, row, reach=POLISHED).error
        point.load, point.ordinate = system.scalar(point.x), solver.shape.ordinate(point.x)
        point.energy, point.potential, point.conjugate = solver.energies(point.x)
        point.stretch = solver.shape.stretch(point.x)

    def _at_bound(self, point: Point) -> bool:
        return min(abs(point.load - bound) for bound in self.bounds) < SAME_LOAD * abs(self.bounds[1] - self.bounds[0])

    def _computed(self, point: Point) -> float:
        """Error of a point across its branch, or at its load on a bound; :class:`TooCoarse` where its index errs."""
        richer = self.meshes.richer(point.mesh)
        richer.solver.damp(self.meshes.solvers[point.mesh].system.damping > 0)
        try:
            again = richer.again(point, fixed_load=self._at_bound(point))
        except ConvergenceError:
            return float("inf")
        negative = self._index(point, richer, again)
        if negative != point.negative and point.arclength > self.excused:
            solver = self.meshes.solvers[point.mesh]
            modes = solver.inertia.modes_near_zero(point.x, abs(negative - point.negative), ROUGH)
            raise TooCoarse(
                point,
                float("inf"),
                modes,
                why=f"index {point.negative}, {negative} on a richer mesh",
            )
        values = (point.load, self.units.load), (point.ordinate, self.units.ordinate)
        error = max(e / unit(v, one=one) for e, (v, one) in zip(again.errors(point), values, strict=True))
        return error if again.resolved else max(error, GROWN * self.accuracy)

    @staticmethod
    def _index(point: Point, richer: Enriched, again: Again) -> int:
        """Index on the richer mesh; the point's own if eigenvalues that are zero on one of the two make up for it.

        One factorisation suffices if it is the same; else a second one separates zero eigenvalues from others.
        """
        inertia = richer.solver.inertia
        found = inertia.at(again.x)
        drifts = found.drifts
        below = found.below(-inertia.tolerance)
        if below < point.negative:
            index = found.count()
            return point.negative if point.negative <= index.negative + max(index.zero - drifts, 0) else index.negative
        return point.negative if below <= point.negative + max(point.zero - drifts, 0) else below

"""The discretisations of one run: one, or with an accuracy asked for as many as its branches need.

Every point knows the number of its mesh.  While a branch is traced a :class:`Watch` estimates the error of its points by
a computation one degree richer, and in between by the decay of Legendre coefficients (:mod:`rodfem.grading`), which
costs next to nothing.  Where an error is too large it raises :class:`TooCoarse`; the explorer then has a mesh made for
that very state, carries the last points over, and goes on there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite, isnan, log10

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.accuracy import Richer
from rodfem.branch import BRANCH_POINT, END, FOLD, Branch, Point, Special
from rodfem.continuation import Follower
from rodfem.errors import ConvergenceError, SceneError
from rodfem.grading import Gauge, cheapest, cost, weights_of
from rodfem.newton import correct
from rodfem.report import Report
from rodfem.scene import Scene
from rodfem.system import System

FINEST, COARSEST = 1e-11, 1e-1
"""Accuracies that can be asked for; round-off is near the first."""
MARGIN = 100.0
"""A new mesh is made for an accuracy better than the one asked for by this factor: it is to last for a while."""
FURTHER = 10.0
"""By this factor more at each further try at one place."""
TRIES, MOST = 4, 16
"""Meshes tried at one place, and in a run."""
SURE = 10.0
"""An error estimated by the decay of coefficients counts where it is this much better than the accuracy."""
GROWN, SELDOM = 1.5, 10
"""An error is computed again where the indicator has grown by this factor, and at the latest after so many points."""
NEAR = 0.1
"""Points of a branch nearer to each other than this, in arclength, are at one place."""


def check_accuracy(accuracy: float) -> None:
    """Raise :class:`SceneError` for an accuracy that is none, or cannot be had in double precision."""
    if not FINEST <= accuracy <= COARSEST:
        raise SceneError(
            f"An accuracy of {accuracy:g} cannot be had: ask for one between {FINEST:g} (round-off) and {COARSEST:g}."
        )


def first_mesh(scene: Scene, accuracy: float, comm: MPI.Comm) -> tuple[int, int]:
    """Elements and degree to start with: few, of a degree that grows with the digits asked for."""
    return max(4, len(scene.joints) + 1, comm.size), min(max(round(4 - log10(accuracy) / 2), 4), 9)


class TooCoarse(Exception):
    """The mesh does not resolve a state to the accuracy: its ``error`` is too large, infinite where it is not known.

    ``directions`` are null vectors to be resolved besides; the error falls as the indicator to the power ``order``.
    """

    def __init__(
        self, point: Point, error: float, directions: Sequence[PETSc.Vec] = (), order: float = 1.0, why: str = ""
    ) -> None:
        """Keep what a new mesh is chosen from, and in words what was found."""
        super().__init__(why or f"estimated error {error:.0e}")
        self.point, self.error, self.directions, self.order = point, error, list(directions), order


class Meshes:
    """The followers of one run, by the number of their mesh, and their richer companions."""

    def __init__(self, follower: Follower, accuracy: float | None) -> None:
        """Begin with one mesh; None as accuracy: no other is made."""
        self.followers = [follower]
        self.accuracy = accuracy
        self._richer: dict[int, Richer] = {}
        self._gauges: dict[int, Gauge] = {}
        if accuracy is not None:
            self._weights = weights_of(follower.system.scene)

    def gauge(self, number: int) -> Gauge:
        """Gauge of the smoothness of states on a mesh."""
        if number not in self._gauges:
            self._gauges[number] = Gauge(self.followers[number], self._weights)
        return self._gauges[number]

    def richer(self, number: int) -> Richer:
        """Companion of a mesh one degree richer, made when it is first asked for."""
        if number not in self._richer:
            self._richer[number] = Richer(self.followers[number])
        return self._richer[number]

    def error_of(self, special: Special) -> float:
        """Estimated error of a special point in load and ordinate, relative to those that exceed one."""
        error = special.ordinate_error / max(1.0, abs(special.point.ordinate))
        if special.kind in (FOLD, BRANCH_POINT) or special.zero_of == "stretch":
            error = max(error, special.error_estimate / max(1.0, abs(special.point.load)))
        return error

    def raised(self, trouble: TooCoarse, tries: int) -> Follower:
        """Follower on the cheapest mesh for the state that was too coarse: one that there is, or a new one."""
        assert self.accuracy is not None
        old = self.followers[trouble.point.mesh]
        error = trouble.error if isfinite(trouble.error) else 1e3 * self.accuracy
        found = self.gauge(old.mesh)(trouble.point.x, trouble.directions)
        gain = self.accuracy / (error * MARGIN * FURTHER**tries)
        indicator = max(found.indicator, 1e-300) * gain**trouble.order
        mesh = cheapest(old, found, indicator)
        fields = old.system.fields
        affordable = 1.2 * cost(fields, mesh.elements, mesh.degree)
        for known in self.followers:
            d = known.system.fields.discretization
            vertices = self.vertices(known.mesh)
            if known is not old and cost(fields, d.elements, d.degree) <= affordable:
                if found.fulfilled_by(d, vertices, indicator):
                    return known
        s = old.system
        with s.clock("setup"):
            new = Follower(System(s.scene, mesh, s.comm, s.clock), old.modes)
        new.mesh = len(self.followers)
        self.followers.append(new)
        return new

    def vertices(self, number: int) -> np.ndarray:
        """Arclengths at which the elements of a mesh meet, (E + 1,)."""
        shape = self.followers[number].shape
        starts = np.sort(shape.gather(shape.start))
        return np.append(starts, shape.system.scene.interval[1])

    # --- points on another mesh --------------------------------------------------------------------------------

    def state(self, x: PETSc.Vec, source: int, target: Follower) -> PETSc.Vec:
        """State of one mesh interpolated on another."""
        return target.shape.restore(self.followers[source].shape.sample(x))

    def direction(self, d: PETSc.Vec, x: PETSc.Vec, source: int, target: Follower) -> PETSc.Vec:
        """Change of the state ``x`` of one mesh interpolated on another: the difference of two states."""
        moved = x.copy()
        moved.axpy(1.0, d)
        out = self.state(moved, source, target)
        out.axpy(-1.0, self.state(x, source, target))
        return out

    def here(self, point: Point, target: Follower) -> Point:
        """Point with its state and tangent interpolated, not solved, on another mesh; itself if it is on that."""
        if point.mesh == target.mesh:
            return point
        x = self.state(point.x, point.mesh, target)
        tangent = None if point.tangent is None else self.direction(point.tangent, point.x, point.mesh, target)
        return replace(point, x=x, tangent=tangent, mesh=target.mesh)

    def carried(self, point: Point, target: Follower, fixed_load: bool) -> Point | None:
        """Point solved on another mesh, on the plane across its tangent or at its load; None where that fails."""
        guess = self.here(point, target)
        if guess.tangent is None:
            return None
        x, system = guess.x, target.system
        system.set_phase(x)
        row = target.axis if fixed_load else target.row(guess.tangent)
        outcome = correct(system, x, row, reach=0.5)
        if fixed_load and not outcome.converged:  # too far from a state on a far finer mesh: from the scene's start
            x, outcome = target.first(point.load)
        if not outcome.converged:
            return None
        side = target.row(guess.tangent)
        return target.point(x, point.arclength, target.tangent(side, at=x), outcome)

    def carry(self, history: Sequence[Point], target: Follower, from_branch_point: bool) -> list[tuple[Point, Point]]:
        """Last points of a branch solved on another mesh: pairs of old and new, in order.

        Points whose index is another there are left out, so that an eigenvalue that passes zero is met again.  The
        start of a branch keeps its load; a branch point from which one leaves is not carried.
        """
        starts = history[0].arclength == 0.0
        first = 1 if starts and from_branch_point else 0
        pairs: list[tuple[Point, Point]] = []
        for number in range(len(history) - 1, first - 1, -1):
            old = history[number]
            new = self.carried(old, target, fixed_load=starts and number == 0)
            if new is not None and (pairs or number == first or new.negative == old.negative):
                pairs.insert(0, (old, new))
            elif pairs:
                break
            if len(pairs) == 4:
                break
        if not pairs:
            raise ConvergenceError(
                f"The branch could not be carried to another mesh near load {history[-1].load:.8g}: use --elements and "
                "--degree instead of an accuracy."
            )
        return pairs


@dataclass
class Checked:
    """A point whose error was computed: its indicator, its error, and how many points came since."""

    indicator: float
    error: float
    since: int = 0


class Watch:
    """Watches over the accuracy of the points of one branch."""

    def __init__(self, meshes: Meshes, bounds: tuple[float, float]) -> None:
        """Begin a branch; its points at the ``bounds`` of the load are judged at that very load."""
        self.meshes, self.bounds = meshes, bounds
        self.checked: Checked | None = None
        self.place, self.error, self.tries = -np.inf, np.inf, 0
        self.excused = -np.inf

    @property
    def accuracy(self) -> float:
        """The accuracy asked for, infinite without one."""
        return self.meshes.accuracy or np.inf

    def row(self, point: Point, follower: Follower) -> None:
        """Estimate the error of a point, by computation where need be; raises :class:`TooCoarse`."""
        if self.meshes.accuracy is None:
            return
        indicator = self.meshes.gauge(follower.mesh)(point.x).indicator
        last = self.checked
        if last is not None and last.since < SELDOM and not self._at_bound(point):
            point.estimate = last.error * max(1.0, indicator / last.indicator)
            if indicator < GROWN * last.indicator or point.estimate * SURE < self.accuracy:
                last.since += 1
                return
        with follower.system.clock.purpose("error bars"):
            point.estimate = self._computed(point)
        self.checked = Checked(max(indicator, 1e-30), point.estimate)
        if point.estimate * GROWN > self.accuracy and point.arclength > self.excused:
            raise TooCoarse(point, point.estimate)

    def special(self, special: Special) -> None:
        """Estimate the errors of a special point; raises :class:`TooCoarse` where another mesh may help."""
        if self.meshes.accuracy is None:
            return
        with self.meshes.followers[special.point.mesh].system.clock.purpose("error bars"):
            self.meshes.richer(special.point.mesh).estimate(special)
        self.judge(special)

    def judge(self, special: Special) -> None:
        """Raise :class:`TooCoarse` for a special point with too large an error, where another mesh may help."""
        error = self.meshes.error_of(special)
        located = special.located_to / max(1.0, abs(special.point.load))
        if error > self.accuracy > located and special.point.arclength > self.excused:
            raise TooCoarse(special.point, error, special.null_vectors, 2.0 if special.zero_of == "stretch" else 1.0)

    def drifting(self, point: Point) -> None:
        """Raise :class:`TooCoarse` for a point at which the mesh breaks a symmetry, where another mesh may help."""
        if self.meshes.accuracy is not None and point.arclength > self.excused:
            raise TooCoarse(point, float("inf"), why="the mesh breaks a symmetry")

    def label(self, special: Special) -> None:
        """Say at a special point whether the accuracy was not reached, and why."""
        if self.meshes.accuracy is None:
            return
        special.point.estimate = error = self.meshes.error_of(special)
        if error > self.accuracy and not special.note:
            located = special.located_to / max(1.0, abs(special.point.load)) > self.accuracy
            why = f"located to {special.located_to:.0e} only" if located else "finer meshes did not lower the error"
            special.note = f"accuracy {self.accuracy:g} not reached: {why}"

    def summary(self, branch: Branch, report: Report) -> None:
        """Say on which meshes a branch was traced, and the largest error of its points."""
        if self.meshes.accuracy is None:
            return
        used = [self.meshes.followers[number].system for number in sorted({p.mesh for p in branch.points})]
        worst = max(p.estimate for p in branch.points if not isnan(p.estimate))
        report.accuracy(used, worst, self.meshes.accuracy)

    def another(self, trouble: TooCoarse) -> Follower | None:
        """Follower on a mesh for the state that was too coarse; None where further meshes do not help there."""
        if abs(trouble.point.arclength - self.place) < NEAR:
            self.tries += 1
            helps = not isfinite(trouble.error) or trouble.error < 0.5 * self.error
        else:
            self.tries, helps = 0, True
        self.place, self.error = trouble.point.arclength, trouble.error
        self.checked = None
        if not helps or self.tries >= TRIES or len(self.meshes.followers) >= MOST:
            self.excused = trouble.point.arclength + NEAR
            return None
        return self.meshes.raised(trouble, self.tries)

    def _at_bound(self, point: Point) -> bool:
        return min(abs(point.load - bound) for bound in self.bounds) < 1e-9 * abs(self.bounds[1] - self.bounds[0])

    def _computed(self, point: Point) -> float:
        """Error of a point across its branch, or in the ordinate where its load is given; raises where the index errs."""
        richer = self.meshes.richer(point.mesh)
        try:
            x = richer.again(point, fixed_load=self._at_bound(point))
        except ConvergenceError:
            return float("inf")
        index, drifts = richer.follower.inertia.count(x), richer.system.active_drifts()
        apart = index.negative > point.negative + max(point.zero - drifts, 0) or point.negative > index.negative + max(
            index.zero - drifts, 0
        )
        if apart and point.arclength > self.excused:
            follower = self.meshes.followers[point.mesh]
            follower.system.set_phase(point.x)
            follower.inertia.count(point.x)
            modes = follower.inertia.nearest(abs(index.negative - point.negative), accuracy=1e-2)[1]
            raise TooCoarse(
                point,
                float("inf"),
                [m.copy() for m in modes],
                why=f"index {point.negative}, {index.negative} one degree richer",
            )
        load, ordinate = richer.system.scalar(x), richer.follower.shape.ordinate(x)
        pairs = (load, point.load), (ordinate, point.ordinate)
        return max(1e-14, *(abs(a - b) / max(1.0, abs(b)) for a, b in pairs))


def end_of(point: Point) -> Special:
    """Last point of a branch as a special one."""
    return Special(END, point, point.negative, point.negative, 1e-12 * max(1.0, abs(point.load)))

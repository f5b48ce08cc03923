"""The meshes of one run: one, or with an accuracy asked for as many as its branches need.

The error of a point is computed on a richer mesh now and then; in between the decay of its Legendre coefficients tells
how it has changed (:mod:`rodfem.adaptivity.grading`).  If it is too large, :class:`TooCoarse` is raised: the explorer
has a mesh made for that state, carries the last points over, and goes on.  Every point knows the number of its mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import inf, isfinite, isnan, log10

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched
from rodfem.adaptivity.grading import SmoothnessIndicator, cheapest, cost, pieces_of
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.continuation.observer import Observer, Remark
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import Discretization
from rodfem.fem.newton import correct
from rodfem.fem.symmetries import may_slide
from rodfem.problem.scene import Scene
from rodfem.stability.inertia import ROUGH
from rodfem.tolerances import SAME_LOAD, TINY, unit

TRIES, MOST = 4, 16  # meshes tried at one place, and in a run
GROWN, SELDOM = 1.5, 10
"""An error is computed again where the indicator has grown by this factor, and at the latest after so many points."""
NEAR = 0.1  # points of a branch nearer to each other than this, in arclength, are at one place


def internal_accuracy(scene: Scene, accuracy: float) -> float:
    """Accuracy to work with: a mesh breaks the symmetry of a uniform ring along itself, which must not be seen."""
    uniform_ring = may_slide(scene) and not scene.energy_depends_on("s")
    return min(accuracy, 1e-8) if uniform_ring else accuracy  # below what counts as a drift


def start_mesh(scene: Scene, formulation: str, accuracy: float, comm: MPI.Comm) -> Discretization:
    """Discretisation to start with: few elements of nearly equal size, of a degree that grows with the digits."""
    degree = round(4 - log10(internal_accuracy(scene, accuracy)) / 2)
    pieces = pieces_of(scene)
    almost = 1e-6  # part of an element that a piece may have more than a whole number of them
    counts = np.ceil(np.diff(pieces) / scene.length * max(4, comm.size) - almost).astype(int).clip(1)
    inner = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(pieces, pieces[1:], counts, strict=False)]
    vertices = tuple(map(float, np.concatenate([pieces[:1], *inner])))
    return Discretization(formulation, len(vertices) - 1, min(max(degree, 4), 9), vertices)


@dataclass(eq=False)
class TooCoarse(Exception):
    """The mesh does not resolve a ``point`` to the accuracy: its ``error`` is too large, infinite if unknown."""

    point: Point
    error: float
    directions: Sequence[PETSc.Vec] = ()  # null vectors to be resolved, too
    order: float = 1.0  # power of the indicator as which the error falls
    why: str = ""

    def __str__(self) -> str:
        return self.why or f"estimated error {self.error:.0e}"


class Meshes:
    """The solvers of one run, by the number of their mesh, and their richer companions, made when needed."""

    def __init__(self, solver: BranchSolver, accuracy: float | None) -> None:
        solvers = self.solvers = [solver]
        self.accuracy = None if accuracy is None else internal_accuracy(solver.system.scene, accuracy)
        self.indicator = cache(lambda mesh: SmoothnessIndicator(solvers[mesh]))
        self.richer = cache(lambda mesh: Enriched(solvers[mesh]))

    def raised(self, trouble: TooCoarse, tries: int) -> BranchSolver:
        """Solver on the cheapest mesh for the state that was too coarse: one that there is, or a new one."""
        assert self.accuracy is not None
        old = self.solvers[trouble.point.mesh]
        error = trouble.error if isfinite(trouble.error) else 1e3 * self.accuracy
        found = self.indicator(old.mesh)(trouble.point.x, trouble.directions)
        # a hundred times better than asked for: the mesh is to last for a while
        gain = self.accuracy / (error * 100.0 * 10.0**tries)
        indicator = max(found.indicator, TINY) * gain**trouble.order
        mesh = cheapest(old, found, indicator)
        fields = old.system.fields
        affordable = 1.2 * cost(fields, mesh.elements, mesh.degree)
        for known in self.solvers:
            d = known.system.fields.discretization
            if known is not old and cost(fields, d.elements, d.degree) <= affordable:
                if found.fulfilled_by(d, known.system.fields.all_vertices, indicator):
                    return known
        return self.add(mesh)

    def add(self, mesh: Discretization) -> BranchSolver:
        """Solver on another ``mesh``."""
        first = self.solvers[0]
        with first.system.clock("setup"):
            new = first.on_mesh(mesh)
        new.mesh = len(self.solvers)
        self.solvers.append(new)
        return new

    def _carried(self, point: Point, target: BranchSolver, fixed_load: bool) -> Point | None:
        """Point solved on another mesh, on the plane across its tangent or at its load; None where that fails."""
        guess = target.interpolated(point)
        if guess.tangent is None:
            return None
        x, row = guess.x, target.row(guess.tangent)
        outcome = correct(target.system, x, target.axis if fixed_load else row, reach=0.5)
        if fixed_load and not outcome.converged:  # too far from a state on a far finer mesh: from the scene's start
            x, outcome = first_equilibrium(target, point.load)
        if not outcome.converged:
            return None
        return target.point(x, point.arclength, target.tangent(row, at=x), outcome)

    def carry(
        self, history: Sequence[Point], target: BranchSolver, from_branch_point: bool
    ) -> list[tuple[Point, Point]]:
        """Last points of a branch solved on another mesh: pairs of old and new, in order."""
        rows, pairs = list(history), list[tuple[Point, Point]]()
        del rows[: int(from_branch_point and rows[0].arclength == 0.0)]
        while rows and len(pairs) < 4:
            old = rows.pop()
            new = self._carried(old, target, fixed_load=old.arclength == 0.0)
            if new is not None and (pairs or not rows or new.negative == old.negative):
                pairs.insert(0, (old, new))
            elif pairs:
                break
        if not pairs:
            raise ConvergenceError(
                f"The branch could not be carried to another mesh near load {history[-1].load:.8g}: use "
                "Discretization(elements=...) and Discretization(degree=...) instead of an accuracy."
            )
        return pairs


class AccuracyControl:
    """Watches over the accuracy of the points of one branch."""

    def __init__(self, meshes: Meshes, bounds: tuple[float, float]) -> None:
        """Begin a branch; its points at the ``bounds`` of the load are judged at that very load."""
        self.meshes, self.bounds = meshes, bounds
        self.units = meshes.solvers[0].units
        self.accuracy = meshes.accuracy or np.inf
        self.checked: tuple[float, float, int] | None = None  # indicator and error of a point, and the points since
        self.place, self.tries = -np.inf, 0
        self.excused = -np.inf

    def row(self, point: Point, solver: BranchSolver) -> None:
        """Estimate the error of a point, by computation where need be; raises :class:`TooCoarse`."""
        if self.meshes.accuracy is None:
            return
        indicator = self.meshes.indicator(solver.mesh)(point.x).indicator
        if self.checked is not None and self.checked[2] < SELDOM and not self._at_bound(point):
            before, error, since = self.checked
            point.estimate = error * max(1.0, indicator / before)
            if indicator < GROWN * before or 10 * point.estimate < self.accuracy:
                self.checked = before, error, since + 1
                return
        with solver.system.clock.scope("error bars"):
            point.estimate = self._computed(point)
        self.checked = max(indicator, TINY), point.estimate, 0
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
            order = 2.0 if special.test_function == "stretch" else 1.0
            raise TooCoarse(special.point, error, special.null_vectors, order)

    def _error_of(self, special: SpecialPoint) -> float:
        """Error of a special point in load and ordinate, relative to those that exceed their natural size."""
        error = special.ordinate_error / unit(special.point.ordinate, one=self.units.ordinate)
        if special.kind.singular or special.test_function == "stretch":
            error = max(error, special.error_estimate / unit(special.point.load, one=self.units.load))
        return max(error, GROWN * self.accuracy) if special.resolved is False else error

    def drifting(self, point: Point) -> None:
        """Raise :class:`TooCoarse` for a point at which the mesh breaks a symmetry, where another mesh may help."""
        if self.meshes.accuracy is not None and point.arclength > self.excused:
            raise TooCoarse(point, inf, why="the mesh breaks a symmetry")

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
        point = trouble.point
        self.tries = self.tries + 1 if abs(point.arclength - self.place) < NEAR else 0
        self.place, self.checked = point.arclength, None
        if self.tries < TRIES and len(self.meshes.solvers) < MOST:
            return self.meshes.raised(trouble, self.tries)
        self.excused = point.arclength + NEAR
        many = len(self.meshes.solvers) >= MOST
        why = f"{MOST} meshes are the most" if many else f"{self.tries + 1} finer meshes did not do"
        words = f"The accuracy is not reached near load {point.load:.6g} ({trouble}): {why}."
        observer.warn(Remark(words, point.load))
        return None

    def _at_bound(self, point: Point) -> bool:
        return min(abs(point.load - bound) for bound in self.bounds) < SAME_LOAD * abs(self.bounds[1] - self.bounds[0])

    def _computed(self, point: Point) -> float:
        """Error of a point across its branch, or at its load on a bound; :class:`TooCoarse` where its index errs."""
        richer, solver = self.meshes.richer(point.mesh), self.meshes.solvers[point.mesh]
        richer.solver.damp(solver.system.damping > 0)
        try:
            again = richer.solve(point, fixed_load=self._at_bound(point))
        except ConvergenceError:
            return inf
        negative = _index(point, richer, again.x)
        if negative != point.negative and point.arclength > self.excused:
            modes = solver.inertia.modes_near_zero(point.x, abs(negative - point.negative), ROUGH)
            raise TooCoarse(point, inf, modes, why=f"index {point.negative}, {negative} on a richer mesh")
        values = (point.load, self.units.load), (point.ordinate, self.units.ordinate)
        error = max(e / unit(v, one=one) for e, (v, one) in zip(richer.errors(point, again), values, strict=True))
        return error if again.resolved else max(error, GROWN * self.accuracy)


def _index(point: Point, richer: Enriched, x: PETSc.Vec) -> int:
    """Index on the richer mesh; the point's own if eigenvalues that are zero on one of the two make up for it."""
    inertia = richer.solver.inertia
    found = inertia.at(x)
    drifts = found.drifts
    below = found.eigenvalue_count(-inertia.tolerance)
    if below < point.negative:
        index = found.count()
        return point.negative if point.negative <= index.negative + max(index.zero - drifts, 0) else index.negative
    return point.negative if below <= point.negative + max(point.zero - drifts, 0) else below

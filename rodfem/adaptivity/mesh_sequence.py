"""The discretisations of one run: one, or with an accuracy asked for as many as its branches need; and gaps.

Every point knows the number of its mesh.  Here meshes are made, and points carried from one to another.

At a gap an imperfection has taken a branch point apart: two branches, that would cross without it, bend away from each
other.  The state and the load at which they would cross are known from :mod:`rodfem.continuation.singular`.  Steps in
proportion to the distance from there follow the bend of either branch, however sharp it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, isfinite, log10

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched
from rodfem.adaptivity.grading import SmoothnessIndicator, cheapest, cost, pieces_of, weights_of
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.continuation.singular import SingularState, SingularSystem
from rodfem.errors import Argument, ConvergenceError, Remedy
from rodfem.fem.fields import Discretization
from rodfem.fem.newton import correct
from rodfem.fem.symmetries import may_slide
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import orthonormalize
from rodfem.problem.scene import Scene
from rodfem.tolerances import TINY, unit

OF_A_RING = 1e-8
"""Accuracy with which a uniform ring is computed at least."""
ALMOST = 1e-6
"""Part of an element that a piece of the rod may have more than a whole number of them."""

OWN_MESH = Remedy(
    "use {} and {} instead of an accuracy", *(Argument("Discretization", name) for name in ("elements", "degree"))
)
SHARE = 0.25
"""Largest step near a gap, relative to the distance from where the branches would cross."""
LEAST = 1e-6
"""Least bound of a step."""
ARM = 0.05
"""Distance, in the metric, at which the four arms that would meet are looked for."""


def internal_accuracy(scene: Scene, accuracy: float) -> float:
    """Accuracy to work with: a mesh breaks the symmetry of a uniform ring along itself, which must not be seen."""
    return min(accuracy, OF_A_RING) if may_slide(scene) and not scene.depends_on_s() else accuracy


def start_mesh(scene: Scene, formulation: str, accuracy: float, comm: MPI.Comm) -> Discretization:
    """Discretisation to start with: few elements of nearly equal size, of a degree that grows with the digits.

    The ``accuracy`` is that of loads and ordinates, relative to values greater than one.  The ``formulation`` is kept,
    and breaks of the ``scene`` are vertices; each rank of ``comm`` has an element.
    """
    degree = round(4 - log10(internal_accuracy(scene, accuracy)) / 2)
    pieces = pieces_of(scene)
    counts = np.ceil(np.diff(pieces) / scene.length * max(4, comm.size) - ALMOST).astype(int).clip(1)
    inner = [np.linspace(a, b, n + 1)[1:] for a, b, n in zip(pieces, pieces[1:], counts, strict=False)]
    vertices = tuple(map(float, np.concatenate([pieces[:1], *inner])))
    return Discretization(formulation, len(vertices) - 1, min(max(degree, 4), 9), vertices)


@dataclass(eq=False)
class TooCoarse(Exception):
    """The mesh does not resolve a ``point`` to the accuracy: its ``error`` is too large, infinite if it is not known.

    ``directions`` are null vectors to be resolved, too; the error falls as the indicator to the power ``order``;
    ``why`` is a sentence.
    """

    point: Point
    error: float
    directions: Sequence[PETSc.Vec] = ()
    order: float = 1.0
    why: str = ""

    def __str__(self) -> str:
        return self.why or f"estimated error {self.error:.0e}"


class Meshes:
    """The solvers of one run, by the number of their mesh, and their richer companions, made when needed."""

    def __init__(self, solver: BranchSolver, accuracy: float | None) -> None:
        self.solvers = [solver]
        self.accuracy = None if accuracy is None else internal_accuracy(solver.system.scene, accuracy)
        self._companions: dict[int, Enriched] = {}
        self._indicators: dict[int, SmoothnessIndicator] = {}
        if accuracy is not None:
            self._weights = weights_of(solver.system.scene)

    def indicator(self, number: int) -> SmoothnessIndicator:
        """Smoothness indicator of a mesh."""
        if number not in self._indicators:
            self._indicators[number] = SmoothnessIndicator(self.solvers[number], self._weights)
        return self._indicators[number]

    def richer(self, number: int) -> Enriched:
        """Companion of a mesh, on halves of its elements one degree richer, made when it is first asked for."""
        if number not in self._companions:
            self._companions[number] = Enriched(self.solvers[number])
        return self._companions[number]

    def error_of(self, special: SpecialPoint) -> float:
        """Estimated error of a special point in load and ordinate, relative to those that exceed their natural size."""
        units = self.solvers[0].units
        error = special.ordinate_error / unit(special.point.ordinate, one=units.ordinate)
        if special.kind.singular or special.test_function == "stretch":
            error = max(error, special.error_estimate / unit(special.point.load, one=units.load))
        return error

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
                if found.fulfilled_by(d, known.system.fields.all_vertices(), indicator):
                    return known
        first = self.solvers[0]
        s = first.system
        with s.clock("setup"):
            new = BranchSolver(System(s.scene, mesh, s.comm, s.clock, symmetries=s.symmetries), first.modes)
        new.mesh = len(self.solvers)
        self.solvers.append(new)
        return new

    # --- points on another mesh --------------------------------------------------------------------------------

    def state(self, x: PETSc.Vec, source: int, target: BranchSolver) -> PETSc.Vec:
        """State of one mesh interpolated on another."""
        return target.shape.restore(self.solvers[source].shape.sample(x))

    def direction(self, d: PETSc.Vec, x: PETSc.Vec, source: int, target: BranchSolver) -> PETSc.Vec:
        """Change ``d`` of the state ``x`` on mesh number ``source``, on that of a ``target``."""
        return self.state(x + d, source, target) - self.state(x, source, target)

    def here(self, point: Point, target: BranchSolver) -> Point:
        """Point with its state and tangent interpolated, not solved, on another mesh; itself if it is on that."""
        if point.mesh == target.mesh:
            return point
        x = self.state(point.x, point.mesh, target)
        tangent = None if point.tangent is None else self.direction(point.tangent, point.x, point.mesh, target)
        return replace(point, x=x, tangent=tangent, mesh=target.mesh)

    def carried(self, point: Point, target: BranchSolver, fixed_load: bool) -> Point | None:
        """Point solved on another mesh, on the plane across its tangent or at its load; None where that fails."""
        guess = self.here(point, target)
        if guess.tangent is None:
            return None
        x, system = guess.x, target.system
        row = target.axis if fixed_load else target.row(guess.tangent)
        outcome = correct(system, x, row, reach=0.5)
        if fixed_load and not outcome.converged:  # too far from a state on a far finer mesh: from the scene's start
            x, outcome = first_equilibrium(target, point.load)
        if not outcome.converged:
            return None
        side = target.row(guess.tangent)
        return target.point(x, point.arclength, target.tangent(side, at=x), outcome)

    def carry(
        self, history: Sequence[Point], target: BranchSolver, from_branch_point: bool
    ) -> list[tuple[Point, Point]]:
        """Last points of a branch solved on another mesh: pairs of old and new, in order.

        Points whose index is another there are left out, so that an eigenvalue that passes zero is met again.  The
        start of a branch keeps its load; a branch point from which one leaves is not carried.  Raises
        :class:`ConvergenceError` if no point is left.
        """
        starts = history[0].arclength == 0.0
        first = 1 if starts and from_branch_point else 0
        pairs: list[tuple[Point, Point]] = []
        for number in range(len(history) - 1, first - 1, -1):
            old = history[number]
            new = self.carried(old, target, fixed_load=starts and number == 0)
            if new is not None and (pairs or number == first or new.negative == old.negative):
                pairs.insert(0, (old, new))
            if pairs and (pairs[0][0] is not old or len(pairs) == 4):
                break
        if not pairs:
            raise ConvergenceError(
                f"The branch could not be carried to another mesh near load {history[-1].load:.8g}", OWN_MESH
            )
        return pairs


class Gap(Exception):
    """A step of continuation has jumped from one branch to another, across the gap at this special point."""

    def __init__(self, special: SpecialPoint, unfolded: SingularState) -> None:
        super().__init__(f"imperfect, unfolding {unfolded.size:.0e}")
        self.special, self.unfolded = special, unfolded
        self.point = replace(special.point, x=unfolded.x, load=unfolded.load)


class Gaps:
    """The gaps of one run: which special points are taken apart, and the steps that resolve them."""

    def __init__(self, meshes: Meshes) -> None:
        self.meshes = meshes
        self.known: list[Gap] = []

    def examine(self, solver: BranchSolver, special: SpecialPoint, found: SingularState) -> Gap | None:
        """The gap at a singular state whose unfolding parameters are not round-off; None where the mesh makes them.

        A mesh need not have a symmetry of the scene: on a richer one its own unfolding is smaller.
        """
        richer = self.meshes.richer(special.point.mesh)
        x = richer.transfer(found.x, state=True)
        modes = [richer.transfer(v, state=False) for v in special.null_vectors]
        orthonormalize(modes, richer.system.metric)
        again = SingularSystem(richer.solver, modes, len(modes), fold=False).solve(x)
        if again is not None and again.size < 0.5 * found.size + again.noise:  # lowered by half: the mesh's own
            return None
        return Gap(special, found)

    def open(self, gap: Gap, solver: BranchSolver) -> bool:
        """Add a gap; False where it is known already, so that smaller steps have not resolved it."""
        for known in self.known:
            if solver.system.distance(gap.point.x, self.meshes.here(known.point, solver).x) < LEAST:
                return False
        self.known.append(gap)
        return True

    def reach(self, solver: BranchSolver, point: Point) -> float:
        """Largest step from a point: in proportion to the distance from the nearest gap."""
        apart = (solver.system.distance(point.x, self.meshes.here(gap.point, solver).x) for gap in self.known)
        return max(SHARE * min(apart, default=inf), LEAST)


def arms(solver: BranchSolver, gap: Gap) -> list[Point]:
    """Equilibria on the branches that would cross at a gap, a little away from it: up to four."""
    system, out = solver.system, []
    for direction in gap.unfolded.directions:
        row = solver.row(direction)
        for sign in (1.0, -1.0):
            x = gap.unfolded.x + direction * (sign * ARM)
            outcome = correct(system, x, row, reach=ARM)
            if outcome.converged:
                out.append(solver.point(x, 0.0, solver.tangent(row, at=x), outcome))
    return out

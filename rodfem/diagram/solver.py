"""A scene on a mesh: equilibria at given loads, one by one, and what can be asked of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from importlib import import_module
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched
from rodfem.adaptivity.soft_states import SoftStates
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.observer import Observer
from rodfem.deflation.search import Deflation
from rodfem.diagram.equilibria import check_index, first_state
from rodfem.diagram.plan import Plan
from rodfem.diagram.sweep import Sweep
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.checks import QuadratureCheck
from rodfem.fem.fields import Discretization, check_number
from rodfem.fem.system import System
from rodfem.modes.finder import ModeFinder
from rodfem.modes.modes import Modes
from rodfem.output.files import load_state
from rodfem.problem.arguments import Check, a, checked, each, finite, path, text, whole
from rodfem.problem.scene import Scene
from rodfem.stability.assessment import Assessor, Verdict
from rodfem.stability.dependence import may_depend, require_independent_constraints
from rodfem.timing import Clock

SCENE: Check = a(Scene, "a rodfem.Scene")
MESH: Check = a(Discretization, "a Discretization, as in Discretization(elements=8); a plan is plan=Plan(...)")
RANKS: Check = a(MPI.Comm, "a communicator of mpi4py, as in @=MPI.COMM_SELF")
POINT: Check = a((Point, SpecialPoint), "a point of a branch, as in diagram['branch 1'].points[0]")
STATE: Check = a((Point, SpecialPoint, PETSc.Vec), "a point of a branch or a vector of the solver's system")
METHOD: Check = text("auto")  # checks of arguments that several functions have


# the derivatives of points stand above them, and are loaded when one is asked for
Point.sensitivity = staticmethod(partial(import_module, "rodfem.codim2.sensitivity"))


class Solver:
    """Computes single equilibria of a scene on one mesh, with their index; collective over the ranks of ``comm``."""

    @checked(scene=SCENE, discretization=MESH, comm=RANKS, spectrum=whole(4, 0), clock=a(Clock, "a Clock"))
    def __init__(
        self,
        scene: Scene,
        discretization: Discretization | None = None,
        comm: MPI.Comm = MPI.COMM_WORLD,
        *,
        spectrum: int = 0,
        clock: Clock | None = None,
    ) -> None:
        """Set up the discrete rod, by default on 8 elements of degree 6.

        ``spectrum`` is the number of left-most eigenvalues that are recorded of each state (conservative scenes);
        ``clock`` notes times.  Raises :class:`~rodfem.errors.InputError` for a ``discretization`` that does not fit.
        """
        Plan(scene.span, spectrum=spectrum).check(scene, discretization or Discretization())
        system = System(scene, discretization or Discretization(), comm, clock)
        self.equilibria = BranchSolver(system, spectrum if scene.conservative else 0)

    @classmethod
    def of(cls, equilibria: BranchSolver) -> Solver:
        """Solver that shares what another computation has set up."""
        solver = cls.__new__(cls)
        solver.equilibria = equilibria
        return solver

    def rebind(self, **constants: float) -> Solver:
        """Solver of the same rod with other constants: ``solver.rebind(A=-1.5)``, on the same mesh.

        Mesh, forms and their compiled code are shared; what depends on the constants is evaluated anew, and this solver
        stays what it is.  Raises :class:`~rodfem.errors.SceneError` for a constant that the scene has not, or a value
        that it does not allow.
        """
        system = self.equilibria.system
        spectrum = self.equilibria.modes
        scene = system.scene.varying(**constants)
        return Solver(scene, system.fields.asked, system.comm, spectrum=spectrum, clock=system.clock)

    def __repr__(self) -> str:
        fields = self.equilibria.system.fields
        d = fields.discretization
        return (
            f"<Solver of {self.scene.name!r}: {d.elements} elements of degree {d.degree}, {fields.unknowns} unknowns>"
        )

    @property
    def scene(self) -> Scene:
        """The rod."""
        return self.equilibria.system.scene

    @cached_property
    def _finder(self) -> ModeFinder:
        return ModeFinder(self.equilibria)

    @cached_property
    def _soft(self) -> SoftStates:
        solver = self.equilibria
        return SoftStates(solver, lambda: Enriched(solver))

    @cached_property
    def _quadrature(self) -> QuadratureCheck:
        return QuadratureCheck(self.equilibria.system)

    @cached_property
    def _sweep(self) -> Sweep:
        return Sweep(self.equilibria, Plan(self.scene.span), Observer(), lambda: None)

    def _state(self, point: Point | SpecialPoint | PETSc.Vec) -> PETSc.Vec:
        """Return the state of a point; raises :class:`InputError` for one of another mesh, as far as sizes tell."""
        x, size = state_of(point), self.equilibria.system.fields.unknowns
        if x.size != size:
            raise InputError(f"The state has {x.size} unknowns, and this mesh {size}: give a state of the same mesh.")
        return x

    @checked(x=a(PETSc.Vec, "a state, as in point.x"))
    def point(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of the equilibrium ``x``: ordinate, energy, index; frequencies without a potential."""
        if not self.equilibria.conservative:
            return replace(self._sweep.at(x), kink=self._quadrature.kink(x))
        return self.examined(self.equilibria.point(x, 0.0, self.equilibria.load_tangent(x, increasing=True)))

    def examined(self, point: Point, *, compare: bool = False, special: SpecialPoint | None = None) -> Point:
        """Record kink and soft modes of a ``point`` of this mesh: see :meth:`SoftStates.examine`; returns the point.

        ``special`` is the fold or branch point that is there, if any.
        """
        point.kink = self._quadrature.kink(point.x)
        if self.equilibria.conservative:
            # by itself a state is on no branch: a tangent at a singular one is any null vector
            tangent, point.tangent = point.tangent, None if special is None else special.point.tangent
            vanishing = () if special is None else special.null_vectors
            self._soft.examine(point, fixed_load=special is None, compare=compare, vanishing=vanishing)
            point.uncompared = self._soft.uncompared
            point.tangent = tangent
        return point

    @checked(load=finite(1.0), guess=STATE)
    def equilibrium(self, load: float, guess: Point | SpecialPoint | PETSc.Vec | None = None) -> Point:
        """Equilibrium at exactly ``load``, from a ``guess`` on this mesh, at any load, or the scene's start.

        Raises :class:`~rodfem.errors.InputError` for a load that is not admissible, or whose index the mesh cannot
        hold, :class:`~rodfem.errors.SceneError` where constraints of the scene follow from others or the stored energy
        is not convex, and :class:`~rodfem.errors.ConvergenceError` where no equilibrium is found.
        """
        scene, found = self.scene, self.equilibria
        scene.parameters[scene.load].check(scene.load, load)
        if guess is None:
            x, outcome = first_state(found, load)
        else:
            x, outcome = found.at_load(self._state(guess), load)
        if not outcome.converged:
            raise ConvergenceError(
                f"No equilibrium was found at {scene.load} = {load:g}: go there in steps of the load, each from the "
                "state before."
            )
        found.require_convexity(x)
        if guess is not None and may_depend(found.shape, x):
            require_independent_constraints(found.shape, x, found.start(load))
        point = self.point(x)
        if found.conservative:
            check_index(found, load, point.index)
        return point

    @checked(point=STATE, method=METHOD, number=whole(4, 1))
    def assess(self, point: Point | SpecialPoint | PETSc.Vec, method: str = "auto", number: int = 4) -> Verdict:
        """Decide the stability of an equilibrium on this mesh by a given method.

        Eigenvalues near zero are computed again on richer meshes; those that have another sign there are undecided.
        What vanishes at a special point is zero there, and undecided, if that is given itself.  ``method`` is ``auto``,
        or a name of ``rodfem.stability.METHODS``, ``number`` how many eigenvalues are computed.

        Raises :class:`~rodfem.errors.InputError` for a method that does not exist or apply and for more eigenvalues
        than the mesh has, and :class:`~rodfem.errors.ConvergenceError` where an eigensolver fails.
        """
        x = self._state(point)
        check_number(self.scene, self.equilibria.system.fields.discretization, number)
        verdict = Assessor(self.equilibria)(x, method, number)
        if not self.equilibria.conservative:
            return replace(verdict, kink=self._quadrature.kink(x))
        special = point if isinstance(point, SpecialPoint) and point.kind.singular else None
        found = self.examined(self.equilibria.point(x, 0.0, None), compare=True, special=special)
        return verdict.at(found)

    @checked(point=STATE, number=whole(3, 1), method=METHOD)
    def modes(self, point: Point | SpecialPoint | PETSc.Vec, number: int = 3, method: str = "auto") -> Modes:
        """Left-most modes of an equilibrium on this mesh, each with its value, motion and error.

        There are ``number`` of them.  Raises :class:`~rodfem.errors.InputError` for fewer than one, and for more than
        the mesh has.
        """
        check_number(self.scene, self.equilibria.system.fields.discretization, number)
        return self._finder(self._state(point), number, method)[1]

    @checked(states=path("results/column/states.h5"), branch=text("branch 1"), row=whole(0, 0))
    def restore(self, states: Path | str, branch: str, row: int) -> Point:
        """Equilibrium of a saved row; it is solved anew, as the mesh may be another one.

        Raises :class:`~rodfem.errors.InputError` where the file ``states`` has no such row.
        """
        x = load_state(Path(states), branch, row, self.equilibria)
        return self.equilibrium(self.equilibria.system.scalar(x), x)

    @checked(
        load=finite(1.0),
        known=each(a(Point, "a point, as diagram.at(load) returns")),
        tries=whole(24, 0),
        seed=whole(0, 0),
    )
    def search(self, load: float, known: Sequence[Point] = (), tries: int = 24, seed: int = 0) -> list[Point]:
        """Equilibria at ``load`` other than the ``known`` ones, by ``tries`` deflated Newton iterations.

        Each is compared with a richer mesh: one that this mesh does not resolve says so in ``uncompared``, and is not
        called stable.  Raises :class:`~rodfem.errors.InputError` for a load that is not admissible, for known
        equilibria at another one, and where a load has no potential.  ``seed`` is that of the random guesses.
        """
        self.scene.require_potential("A search by deflation")
        return [self.examined(p, compare=True) for p in Deflation(self.equilibria, load, known, seed).run(tries)]


def state_of(point: Point | SpecialPoint | PETSc.Vec) -> PETSc.Vec:
    """State vector of a point, of a special point, or itself."""
    if isinstance(point, SpecialPoint):
        return point.point.x
    return point.x if isinstance(point, Point) else point

r"""Derivatives of critical loads in the constants of a scene, and along the rod; of a state's ordinate.

Of folds and branch points see :mod:`rodfem.codim2.adjoint`.  Of flutter and divergence under loads
without a potential the derivative is the slope of the tangent of their locus.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.codim2.adjoint import DIFFERENCES, Adjoint, ordinate_density, state_derivative
from rodfem.codim2.criteria import Plane, restoration
from rodfem.codim2.follow import Curve, RicherMesh, check_special
from rodfem.codim2.neighbours import Neighbours
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.normal_form import Origin, normal_form_of
from rodfem.continuation.singular import SingularSystem
from rodfem.errors import ConvergenceError, InputError, SceneError
from rodfem.fem.shape import halved
from rodfem.fem.state import line
from rodfem.output.words import number
from rodfem.problem.functions import derived
from rodfem.tolerances import TINY, round_off, unit

PIECES = 4
"""Pieces of each element on which a density is known."""
ROUNDED = 1e-9  # round-off of the differences, relative


@dataclass(frozen=True, repr=False)
class Derivative:
    """Derivative ``value`` of a critical load, or of an ordinate, in a parameter, with a bound of its ``error``.

    Where several eigenvalues vanish together it is that of the mean of their loads, and ``splitting`` (k, k) has their
    rates as eigenvalues.  Along the rod ``density`` (m,) has its means on pieces of the rod from ``ends`` (m,) to
    ``ends`` (m + 1,), a derivative per length, with a bound of the largest error, ``density_error``: ``density @
    diff(ends)`` is the value, if nothing at a point depends on the parameter.  Errors are computed when they are first
    asked for, by a second mesh; collective.
    """

    value: float
    bounds: Callable[[], tuple[float, float]] = lambda: (float("nan"), float("nan"))
    splitting: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    ends: np.ndarray = field(default_factory=lambda: np.zeros(1))
    density: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def _errors(self) -> tuple[float, float]:
        return self.bounds()

    @property
    def error(self) -> float:
        """Bound of the error of the value."""
        return self._errors[0]

    @property
    def density_error(self) -> float:
        """Bound of the largest error of the density, nan without one."""
        return self._errors[1]

    def acts_along(self, load: float) -> bool:
        """Whether the parameter acts along the rod, so that another value somewhere changes the ``load`` visibly."""
        return bool(abs(self.density @ np.diff(self.ends)) > ROUNDED * abs(load) if len(self.density) else False)

    def __repr__(self) -> str:
        known = "_errors" in vars(self)  # one rank may print
        return f"<Derivative: {number(self.value, self.error) if known else format(self.value, '.10g')}>"


def derivative(special: SpecialPoint, parameter: str, *, along_the_rod: bool = False) -> Derivative:
    """How fast the load of a ``special`` point changes with a ``parameter`` of the scene; collective.

    Raises :class:`InputError` for what has no locus, or no density, and :class:`ConvergenceError` where the parameter
    destroys the point, which then has no derivative.
    """
    solver = special.point.own_solver
    solver.system.scene.check_constant(parameter)
    if along_the_rod and not special.kind.singular:
        raise InputError(f"A density along the rod is known at folds and branch points, not at {special.kind.words}.")
    check_special(solver, special)
    if not special.kind.singular:
        return _on_locus(solver, special, parameter)
    with solver.system.clock.scope("locus"), restoration(solver.system):
        adjoint = adjoint_of(special)
        splitting = adjoint.splitting(parameter)
        along = adjoint.density(parameter, PIECES) if along_the_rod else ()
    value = float(np.trace(splitting)) / len(splitting)
    return Derivative(value, partial(_bounds, special, parameter, value, along), splitting, *along)


@dataclass(frozen=True, repr=False)
class Tolerance:
    """A critical ``load`` with its standard deviations by some constants, and a bound of the error of its ``mesh``."""

    load: float
    parts: dict[str, float]
    mesh: float

    @property
    def deviation(self) -> float:
        """Standard deviation by all constants, which vary independently."""
        return float(np.linalg.norm([*self.parts.values()]))

    def __str__(self) -> str:
        """As ``12.3 +- 0.4 (stiffness), +- 0.1 (mesh)``, of what is more than the mesh's error."""
        parts = {words: part for words, part in self.parts.items() if not part <= self.mesh}
        parts |= {"mesh": self.mesh} if np.isfinite(self.mesh) else {}
        largest = max([*parts.values(), abs(self.load) * ROUNDED, TINY])
        said = ", ".join(f"+- {part:.2g} ({words})" for words, part in parts.items())
        return f"{self.load:.{max(1 - int(np.floor(np.log10(largest))), 0)}f} {said}"

    __repr__ = __str__


def tolerance(special: SpecialPoint, deviations: Mapping[str, float | tuple[float, float]]) -> Tolerance:
    """Deviations of the load of a special point by those of constants and fields, to first order: see its method."""
    known = special.point.own_solver.system.scene.parameters
    pairs = {name: np.append(given, [np.inf] * (2 - np.size(given))) for name, given in deviations.items()}
    if not all(len(pair) == 2 and (pair > 0.0).all() for pair in pairs.values()):
        raise InputError(f"deviations is {dict(deviations)}: give positive ones, as in {{'A': 0.02, 'B': (0.02, 1)}}.")
    parts = {name: _deviation(special, name, *pair.tolist()) for name, pair in pairs.items()}
    return Tolerance(special.point.load, {known[n].words or n: x for n, x in parts.items()}, special.error_estimate)


def _deviation(special: SpecialPoint, name: str, size: float, length: float) -> float:
    """Deviation of a load by one of this ``size`` that is correlated along the rod over a ``length``."""
    found = derivative(special, name, along_the_rod=bool(np.isfinite(length)))
    if not len(found.density):
        return size * abs(found.value)
    parts, middles = found.density * np.diff(found.ends), (found.ends[1:] + found.ends[:-1]) / 2
    return size * float(np.sqrt(parts @ np.exp(-abs(middles[:, None] - middles) / length) @ parts))


def adjoint_of(special: SpecialPoint) -> Adjoint:
    """Adjoint solutions of a special point, solved for once."""
    modes, solver = [*special.null_vectors, *special.nearby], special.point.own_solver
    return derived(special, Adjoint, lambda: Adjoint(solver, special.point.x, _states(solver, special, modes)))


def _states(solver: BranchSolver, special: SpecialPoint, modes: Sequence[PETSc.Vec]) -> SingularSystem:
    """Equations of a special point on a mesh, with ``modes`` near its own there."""
    return SingularSystem(solver, modes, special.multiplicity, fold=special.kind == FOLD)


def _bounds(
    special: SpecialPoint, parameter: str, value: float, along: tuple[np.ndarray, np.ndarray] | tuple[()]
) -> tuple[float, float]:
    """Bounds of the errors of a derivative and of its density, by the same point of a richer mesh."""
    solver = special.point.own_solver
    rho = halved(solver.system.fields.discretization.degree)
    with solver.system.clock.scope("error bars"):
        richer = derived(special, "richer", lambda: _richer(special))
        with restoration(richer.system):
            again = richer.splitting(parameter)
            error = bound(value, float(np.trace(again)) / len(again), ROUNDED * abs(value), rho)
            if not along:
                return error, float("nan")
            finer, first = richer.density(parameter, PIECES // 2)[1], along[1]
    return error, bound(0.0, abs(finer - first).max(), ROUNDED * abs(first).max(), rho)


def richer_mesh(solver: BranchSolver) -> Enriched:
    """The richer mesh of a solver, made once."""
    return derived(solver, Enriched, lambda: Enriched(solver))


def _richer(special: SpecialPoint) -> Adjoint:
    """Adjoint solutions at the same special point of the richer mesh; raises :class:`ConvergenceError`."""
    richer = richer_mesh(special.point.own_solver)
    modes = [richer.transfer(v, state=False) for v in (*special.null_vectors, *special.nearby)]
    found = _states(richer.solver, special, modes).solve(richer.transfer(special.point.x, state=True))
    if found is None:
        raise ConvergenceError("The richer mesh does not have this special point: use more elements.")
    modes[: special.multiplicity] = found.vectors
    return Adjoint(richer.solver, found.x, _states(richer.solver, special, modes))


def _plane(solver: BranchSolver, parameter: str, load: float) -> Plane:
    """Plane of the load and a parameter near its value, to one side where the scene has no rod on the other."""
    known = solver.system.scene.parameters[parameter]
    value = known.value
    near, own = 0.05 * unit(load, one=solver.units.load), 0.05 * (abs(value) or 1.0)
    a, b = (min(own, 0.5 * abs(end - value)) for end in known.admissible)
    trouble = SceneError(f"{parameter} = {value:g} is the only value that is admissible: it has no derivative.")
    for low, high in ((a, b), (0.0, b), (a, 0.0)):
        try:
            return Plane(solver.system, parameter, ((load - near, load + near), (value - low, value + high)))
        except SceneError as refused:
            trouble = refused
    raise trouble


def _on_locus(solver: BranchSolver, special: SpecialPoint, parameter: str) -> Derivative:
    """Derivative of a flutter or a divergence load: the slope of its locus."""
    plane = _plane(solver, parameter, special.point.load)
    with solver.system.clock.scope("locus"), restoration(solver.system):
        curve = Curve(solver, special, plane, doubtful=False)
    node = curve.first
    if node.ended:
        raise ConvergenceError(f"The {special.kind} at {plane.words(node.p)} has no derivative: {node.ended}.")
    value = float(node.dp[0] / node.dp[1])

    def bounds() -> tuple[float, float]:
        with solver.system.clock.scope("error bars"), restoration(solver.system):
            richer = RicherMesh(curve.criterion, special.kind, node)
            dp = richer.solve(node).dp
            return bound(value, float(dp[0] / dp[1]), ROUNDED * abs(value), richer.rho), float("nan")

    return Derivative(value, bounds)


# --- of a normal form


def coefficient_derivative(special: SpecialPoint, parameter: str) -> Derivative:
    """Derivative of the coefficient of a normal form: differences of the fourth order, of forms at points found again.

    Raises :class:`InputError` for a point without one, :class:`ConvergenceError` for one that becomes of another kind.
    """
    solver, law = special.point.own_solver, special.law
    scene, near, value = solver.system.scene, Neighbours([special]), 0.0
    scene.check_constant(parameter)
    if law is None:
        raise InputError("This special point has no normal form: give a branch point from which a branch was followed.")
    known, error = scene.parameters[parameter].value, 0.0
    size = 10.0 * (abs(known) or 1.0)  # differences of a hundredth
    for place, weight in DIFFERENCES:
        (found,) = near.at({parameter: known + place * size})
        with restoration(solver.system):
            solver.system.line = line(scene, {**found.values, scene.load: 0.0}, {scene.load: 1.0})
            ordinate, way = solver.shape.ordinate(found.x), found.null[0]
            left = special.located_to, round_off(ordinate, solver.units.ordinate)
            form = normal_form_of(solver, Origin(found.x, found.load, ordinate, *left), way / solver.system.norm(way))
        if form is None or (form.power, form.of) != (law.power, law.of):
            raise ConvergenceError(f"The normal form becomes another one near {parameter} = {known:g}.")
        value, error = value + weight / size * form.coefficient, error + abs(weight) / size * form.uncertainty
    return Derivative(value, lambda: (error, float("nan")))


# --- of a state


def ordinate_derivative(point: Point, parameter: str, *, along_the_rod: bool = False) -> Derivative:
    """How fast the ordinate of an equilibrium changes with a ``parameter``, at its load; collective.

    Raises :class:`InputError` for what is no constant, or has no density, and :class:`ConvergenceError` where the state
    is singular.
    """
    solver = point.own_solver
    solver.system.scene.check_constant(parameter)
    if along_the_rod and not solver.conservative:
        raise InputError("A density of an ordinate along the rod is known under loads with a potential: leave it out.")
    value = _of_ordinate(solver, point.x, parameter)
    along = ordinate_density(solver, point.x, parameter, PIECES) if along_the_rod else ()

    def bounds() -> tuple[float, float]:
        richer, rho = richer_mesh(solver), halved(solver.system.fields.discretization.degree)
        x, outcome = richer.solver.at_load(richer.transfer(point.x, state=True), point.load)
        if not outcome.converged:
            return float("inf"), float("nan")
        error = bound(value, _of_ordinate(richer.solver, x, parameter), ROUNDED * abs(value), rho)
        if not along:
            return error, float("nan")
        finer, first = ordinate_density(richer.solver, x, parameter, PIECES // 2)[1], along[1]
        return error, bound(0.0, abs(finer - first).max(), ROUNDED * abs(first).max(), rho)

    return Derivative(value, bounds, np.zeros((0, 0)), *along)


def _of_ordinate(solver: BranchSolver, x: PETSc.Vec, parameter: str) -> float:
    return float(state_derivative(solver, x, parameter, lambda y: np.array([solver.shape.ordinate(y)]))[0])

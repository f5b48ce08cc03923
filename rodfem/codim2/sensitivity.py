r"""Derivatives of critical loads in the constants of a scene, and along the rod; of coefficients, and of ordinates.

Those of loads: :mod:`rodfem.codim2.adjoint`.  An error is bounded by the same of a richer mesh.

*The coefficient of a normal form*: near a branch point the branch is a curve in the amplitude ``a`` along the null
vector, with load ``lam(a, p)`` and ordinate ``o(a, p)`` (:mod:`rodfem.continuation.normal_form`).  At each of its
states UFL's derivative of the equations in the parameter ``p`` gives, by the factors of Newton's method, how state and
load change at this amplitude, and the same factors give the tangent in ``a``.  The branch point moves along the curve,
by ``da`` with ``dp``: to where the load is that of the branch point if it is transcritical, to where ``lam`` is
stationary at a pitchfork,

    lam_a da = lam_b' - lam_p,    or    lam_aa da = -lam_ap.

Load and ordinate at a fixed distance from it change by ``lam_p + lam_a da`` and ``o_p + o_a da``, whose leading
coefficients are the derivatives of ``l`` and ``x`` in the coefficient ``l / x^power``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.codim2.adjoint import (
    DIFFERENCES,
    Adjoint,
    Found,
    along,
    ordinate_density,
    restoration,
    state_derivative,
    values_of,
)
from rodfem.codim2.follow import check_special, modes_of
from rodfem.continuation.branch import DISTANCE, ORDINATE, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.eigenvalue_curves import SHARP
from rodfem.continuation.kinds import FLUTTER, FOLD
from rodfem.continuation.normal_form import LINEAR, SIZE, Expansion, Origin, expansion_of, leading, parts
from rodfem.continuation.singular import SingularSystem
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.shape import halved
from rodfem.output.words import number
from rodfem.problem.functions import derived
from rodfem.stability.cluster import Cluster
from rodfem.tolerances import TINY, unit

OnMesh = Callable[[PETSc.Vec], PETSc.Vec]
PIECES = 4
"""Pieces of each element on which a density is known."""
ROUNDED = 1e-9  # round-off, relative


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

    Raises :class:`InputError` for what has no locus, and :class:`ConvergenceError` where the parameter
    destroys the point, which then has no derivative.
    """
    solver = special.point.own_solver
    solver.system.scene.check_constant(parameter)
    check_special(solver, special)

    def of(adjoint: Adjoint, pieces: int) -> Found:
        return adjoint.splitting(parameter), adjoint.density(parameter, pieces) if pieces else []

    with solver.system.clock.scope("locus"), restoration(solver.system):
        own = derived(special, Adjoint, lambda: Adjoint(solver, special.point.x, _near(special, solver)))
        found = of(own, PIECES * along_the_rod)
    return _derivative(solver, found, lambda pieces: of(derived(special, "richer", lambda: _richer(special)), pieces))


def _derivative(solver: BranchSolver, found: Found, again: Callable[[int], Found]) -> Derivative:
    """Derivative that was found on the mesh of a solver, with what bounds its errors by that of a richer mesh."""
    (splitting, along), rho = found, halved(solver.system.fields.discretization.degree)
    value = float(np.trace(splitting)) / len(splitting)

    def bounds() -> tuple[float, float]:
        with solver.system.clock.scope("error bars"):
            other, finer = again(PIECES // 2 if along else 0)
        error = bound(value, float(np.trace(other)) / len(other), ROUNDED * abs(value), rho)
        if not (along and finer):
            return error, float("nan")
        return error, bound(0.0, abs(finer[1] - along[1]).max(), ROUNDED * abs(along[1]).max(), rho)

    return Derivative(value, bounds, splitting, *along)


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


def _near(special: SpecialPoint, solver: BranchSolver, on: OnMesh = PETSc.Vec.copy) -> SingularSystem | Cluster:
    """Equations of a special point ``on`` the mesh of a solver, with modes near its own there, or its cluster."""
    modes, left, count = modes_of(special.point.own_solver, special, special.point.x)
    modes, left = ([on(v) for v in side] for side in (modes, left))
    if special.cluster is not None and special.kind == FLUTTER:
        return Cluster(np.array([v.array_r.real for v in modes]).T, special.cluster.mean)
    states = SingularSystem(solver, modes, count, fold=special.kind == FOLD)
    states.border(modes, left)
    return states


def richer_mesh(solver: BranchSolver) -> Enriched:
    """The richer mesh of a solver, made once."""
    return derived(solver, Enriched, lambda: Enriched(solver))


def _richer(special: SpecialPoint) -> Adjoint:
    """Adjoint solutions at the same special point of the richer mesh; raises :class:`ConvergenceError`."""
    richer = richer_mesh(special.point.own_solver)
    x = richer.transfer(special.point.x, state=True)
    near, load = _near(special, richer.solver, partial(richer.transfer, state=False)), special.point.load
    found = near.solve(x) if isinstance(near, SingularSystem) else None
    if found is not None:
        return Adjoint(richer.solver, found.x, near)
    for _ in range(8 if isinstance(near, Cluster) else 0):
        x, _ = richer.solver.at_load(x, load)
        adjoint = Adjoint(richer.solver, x, near)
        off = adjoint.left / adjoint.rates.item()
        load -= off
        if abs(off) < SHARP * unit(load, one=richer.solver.units.load):
            return adjoint
    raise ConvergenceError("The richer mesh does not have this special point: use more elements.")


# --- of a normal form


def coefficient_derivative(special: SpecialPoint, parameter: str) -> Derivative:
    """Derivative of the coefficient of a normal form in a ``parameter``; collective.

    Raises :class:`InputError` for a point without one, :class:`ConvergenceError` for one that the parameter destroys.
    """
    solver, law = special.point.own_solver, special.law
    if law is None or not law.coefficient:
        raise InputError("This special point has no normal form: give a branch point from which a branch was followed.")
    rate = derivative(special, parameter).value

    def of(own: BranchSolver, x: PETSc.Vec, null: PETSc.Vec) -> tuple[float, float]:
        null = null / own.system.norm(null)
        origin = Origin(x, own.system.scalar(x), own.shape.ordinate(x), special.located_to, 0.0)
        with restoration(own.system):
            found = expansion_of(own, origin, null)
            if found is None or (found.form.power, found.form.of) != (law.power, law.of):
                raise ConvergenceError(
                    "The branch that leaves here has another normal form on this mesh: use more elements."
                )
            return _coefficient_rate(own, found, null, parameter, rate)

    value, missed = of(solver, special.point.x, special.null_vectors[0])

    def bounds() -> tuple[float, float]:
        finer = derived(special, "richer", lambda: _richer(special))
        null = richer_mesh(solver).transfer(special.null_vectors[0], state=False)
        other, _ = of(finer.solver, finer.x, null)
        return bound(value, other, missed, halved(solver.system.fields.discretization.degree)), float("nan")

    return Derivative(value, bounds)


def _coefficient_rate(
    solver: BranchSolver, found: Expansion, null: PETSc.Vec, parameter: str, rate: float
) -> tuple[float, float]:
    """Derivative of the coefficient, and what the series leaves of it.

    The branch was ``found`` along a ``null`` vector; ``rate`` is the derivative of the branch point's load.

    Raises :class:`ConvergenceError` at a singular state of the branch.
    """
    row, reach, m = solver.row(null), found.amplitudes[-1], len(found.amplitudes)
    moves = np.array([_moves(solver, x, row, parameter, reach) for x in found.states])
    moves = moves.reshape(2, m, 2, 2).transpose(2, 3, 0, 1)
    moves[:, 1] /= solver.units.ordinate
    best, rough = (_rate(found, moves[..., first:], first, rate) for first in (0, 1))
    one = solver.units.ordinate**found.form.power if found.form.of == ORDINATE else 1.0
    return best / one, abs(best - rough) / one


def _moves(solver: BranchSolver, x: PETSc.Vec, row: PETSc.Vec, parameter: str, reach: float) -> np.ndarray:
    """Derivatives (2, 2) of load and ordinate of a state in the amplitude, and in a parameter, one row each."""
    system = solver.system
    with along(system, x, values_of(system), parameter) as there:
        force = -solver.inertia.force(there)
    system.set_load(force, 0.0)
    system.set_phase(x)
    system.at(x).factor(row)
    return np.array([_move(solver, x, right, reach) for right in (solver.axis, force)])


def _move(solver: BranchSolver, x: PETSc.Vec, right: PETSc.Vec, reach: float) -> tuple[float, float]:
    """Derivatives of load and ordinate along the solution for a ``right`` side, the ordinate's by differences."""
    system, change = solver.system, solver.system.new_vector()
    if not system.solve(right, change):
        raise ConvergenceError(f"The branch is singular at {system.scene.load} = {system.scalar(x):.8g}.")
    size = max(system.norm(change), 1.0) / reach
    ordinate = sum(w * size * solver.shape.ordinate(x + change * (place / size)) for place, w in DIFFERENCES)
    return system.scalar(change), float(ordinate)


def _rate(found: Expansion, moves: np.ndarray, first: int, rate: float) -> float:
    """The derivative by the amplitudes from the ``first`` on, at which ``moves`` (2, 2, 2, m) are known."""
    a, (tangents, changes), power = found.amplitudes[first:], moves, found.form.power
    load, (even, odd) = (found.load.best, found.load.rough)[first], parts(changes[0])

    def term(values: np.ndarray, order: int, step: int = 2) -> float:
        return leading(a, values, order, 0.0, step).best

    off = (rate - term(even, 0)) if found.order == 1 else -term(odd, 1) / 2
    (even, odd), (x_even, x_odd) = (parts(each) for each in changes + tangents * (off / load))
    slope = term(odd, 1) if found.order == 1 else term(even - term(even, 0), 2)
    if found.x is None or found.form.of == DISTANCE:
        return slope
    kind, coefficient, _ = found.x
    x = (coefficient.best, coefficient.rough)[first]
    if kind == LINEAR:
        change = term(x_odd, 1)
    elif kind == SIZE:
        change = term(x_even - term(x_even, 0, step=1), 1)
    else:
        change = term(x_even - term(x_even, 0), 2)
    return float((slope - power * load / x * change) / x**power)


# --- of a state


def ordinate_derivative(point: Point, parameter: str, *, along_the_rod: bool = False) -> Derivative:
    """How fast the ordinate of an equilibrium changes with a ``parameter``, at its load; collective.

    Raises :class:`InputError` for what is no constant, and :class:`ConvergenceError` where the state
    is singular.
    """
    solver = point.own_solver
    solver.system.scene.check_constant(parameter)

    def of(own: BranchSolver, x: PETSc.Vec, pieces: int) -> Found:
        slope = state_derivative(own, x, parameter, lambda y: np.array([[own.shape.ordinate(y)]]))
        return slope, ordinate_density(own, x, parameter, pieces) if pieces else []

    def again(pieces: int) -> Found:
        richer = richer_mesh(solver)
        x, outcome = richer.solver.at_load(richer.transfer(point.x, state=True), point.load)
        return of(richer.solver, x, pieces) if outcome.converged else (np.array([[np.inf]]), [])

    return _derivative(solver, of(solver, point.x, PIECES * along_the_rod), again)

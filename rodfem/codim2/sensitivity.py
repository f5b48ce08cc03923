r"""Derivatives of critical loads in the constants of a scene, and along the rod; of a state's ordinate.

*Folds and branch points.*  At a fold with the null vector ``v`` the load ``lam`` changes by ``v . F_p dp + v . F_lam
dlam = 0``.  At a branch point the matrix of the eigenvalues ``mu`` that vanish, with null vectors ``v_i``, changes by

    R dlam + T dp,    T_ij = v_i . S_p v_j + y_ij . F_p,    S y_ij = -D(S v_i) v_j  across the null vectors,

as the state moves by ``-S^-1 F_p dp``; ``R`` is the same of the load.  One is singular along the locus of a simple
point.  Where several vanish together each load moves by itself, at rates that are the eigenvalues of the *matrix of
splitting* ``-R^-1 T``; with null vectors by which ``R`` is plus or minus the unit matrix it is symmetric (Haug, Choi &
Komkov, Design Sensitivity Analysis of Structural Systems, Academic Press 1986, section 1.3).  Its mean diagonal is the
derivative of the mean load.  UFL takes the derivatives in ``p``; what is along null vectors is differences of the
fourth order.

*Along the rod* a parameter may be another one in each element: a stiffness that varies.  Each term is a sum over
elements, or pieces of them, on which the state is the same polynomial: the part of one, over its length, is the mean
there of the density ``dlam/dp(s)``.  What acts at points, as a load at an end, is not in it.

*Flutter and divergence* under loads without a potential: the derivative is the slope of the tangent of their locus.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound
from rodfem.codim2.criteria import IMPERFECT, Plane, kept
from rodfem.codim2.follow import Curve, RicherMesh, check_special
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import FOLD
from rodfem.continuation.singular import SHARP, SingularSystem
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.checks import Pieces
from rodfem.fem.shape import halved
from rodfem.fem.state import line
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine
from rodfem.output.words import number
from rodfem.problem.functions import derived
from rodfem.problem.scene import Scene
from rodfem.stability.reduced_stiffness import DIFFERENCE
from rodfem.tolerances import TINY, unit

PIECES = 4
"""Pieces of each element on which a density is known."""
DIFFERENCES = ((-2e-3, 1e3 / 12), (-1e-3, -2e3 / 3), (1e-3, 2e3 / 3), (2e-3, -1e3 / 12))
"""Places and weights of a central difference of the fourth order: along a null vector, in a parameter over its size."""
ROUNDED = 1e-9  # round-off of the differences, relative


@dataclass(frozen=True, repr=False)
class Derivative:
    """Derivative ``value`` of a critical load, or of an ordinate, in a parameter, with a bound of its ``error``.

    Where several eigenvalues vanish together it is that of the mean of their loads, and ``splitting`` (k, k) has their
    rates as eigenvalues.  Along the rod ``density`` (m,) has its means on pieces of the rod from ``ends`` (m,) to
    ``ends`` (m + 1,), a derivative per length, with a bound of the largest error, ``density_error``: ``density @
    diff(ends)`` is the value, if nothing at a point depends on the parameter.  Errors are computed when they are first
    asked for, by a second mesh.
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

    def __repr__(self) -> str:
        return f"<Derivative: {number(self.value, self.error)}>"


class Adjoint:
    """Null vectors of a located fold or branch point ``x`` on a mesh, and all that its derivatives have in common."""

    def __init__(self, solver: BranchSolver, x: PETSc.Vec, states: SingularSystem) -> None:
        """Take the null vectors at ``x``, a solution of ``states``."""
        self.solver, self.system, self.x, self.fold = solver, solver.system, x, states.fold
        null, y = states.adjoint(x)
        self.null, self.y = null, y
        matrix = solver.inertia.at(x).matrix
        # rounding errors, independent, a hundred times, or all that is zero
        self._noise = [100.0 * rounding(matrix, v, x) + 1e-15 * solver.inertia.scale for v in null]  # round-off
        rates = self._work(self.system.scene.load)
        values, turn = (rates[0], np.ones((1, 1))) if self.fold else np.linalg.eigh(rates)
        if not abs(values).min() > TINY:
            raise ConvergenceError("the load does not change the eigenvalue that vanishes")
        self.signs = np.sign(values)
        turn = turn / (abs(values) if self.fold else np.sqrt(abs(values)))
        self.null = [combine(null, column) for column in turn.T]
        if y:
            flat = [vector for row in y for vector in row]
            self.y = [[combine(flat, np.outer(a, b).ravel()) for b in turn.T] for a in turn.T]

    def splitting(self, parameter: str) -> np.ndarray:
        """Matrix of splitting for a ``parameter``; raises :class:`ConvergenceError` for an imperfection."""
        if not self.fold:
            self._check(self._column(self.x, parameter), parameter)
        return np.asarray(-self.signs[:, None] * self._work(parameter))

    def _work(self, parameter: str) -> np.ndarray:
        """``T`` (k, k) of a parameter, or of the load."""
        column = self._column(self.x, parameter)
        if self.fold:
            return np.array([[column.dot(self.null[0])]])
        out = np.array([[y.dot(column) for y in row] for row in self.y])
        for v, row in zip(self.null, out, strict=True):
            h = DIFFERENCE / self.system.norm(v)
            for step, weight in SHARP:
                there = self._column(self.x + v * (step * h), parameter)
                row += [weight / (2 * h) * there.dot(other) for other in self.null]
        return (out + out.T) / 2

    def _column(self, x: PETSc.Vec, parameter: str) -> PETSc.Vec:
        """Derivative of the equations in a parameter at ``x``; phase conditions stay."""
        scene, before, there = self.system.scene, self.system.line, x.copy()
        if parameter != scene.load:
            load = self.system.scalar(x)
            self.system.set_load(there, self.values[parameter])
            self.system.line = line(scene, {**self.values, scene.load: load, parameter: 0.0}, {parameter: 1.0})
        try:
            return self.solver.inertia.moved(there).border.copy()
        finally:
            self.system.line = before

    @cached_property
    def values(self) -> dict[str, float]:
        """Constants of the state."""
        return dict(zip(self.system.scene.parameters, self.system.line.origin.tolist(), strict=True))

    def _check(self, column: PETSc.Vec, parameter: str) -> None:
        """Raise :class:`ConvergenceError` if a change of the equations does work on a null vector."""
        for v, noise in zip(self.null, self._noise, strict=True):
            each = column.duplicate()
            each.pointwiseMult(column, v)
            work, size = abs(each.sum()), self.system.norm(v)
            if work > noise * size and work > IMPERFECT * each.norm(PETSc.NormType.NORM_1):
                raise ConvergenceError(
                    f"{parameter} is an imperfection that destroys the branch point, or is one on this mesh alone"
                )

    def density(self, parameter: str, pieces: int) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m + 1,) of the pieces of the rod, and the density (m,) of the mean load on each."""
        shape, known = self.solver.shape, self.values[parameter]
        size = abs(known) or 1.0
        parts = sum(
            weight / size * self._parts({parameter: known + place * size}, pieces) for place, weight in DIFFERENCES
        )
        start, length = (shape.from_left(each)[:, None] for each in (shape.start, shape.size))
        ends = np.append((start + length * np.arange(pieces) / pieces).ravel(), start[-1, 0] + length[-1, 0])
        return ends, (-shape.from_left(np.transpose(parts)) / len(self.null) * pieces / length).ravel()

    def _parts(self, constants: dict[str, float], number: int) -> np.ndarray:
        """Parts (pieces, cells) of the sum of ``v . S v + y . F``, at folds of ``v . F``, with other constants."""
        scene, equations = self.system.scene, self.system.equations
        pieces = derived(equations, Pieces, lambda: Pieces(equations))
        equations.take(line(scene, {**self.values, **constants, scene.load: 0.0}, {scene.load: 1.0}))

        def product(state: PETSc.Vec, covector: PETSc.Vec) -> np.ndarray:
            values, own = (v.local[pieces.dofs] for v in (self.system.at(state), self.system.change(covector)))
            return np.einsum("pcn,cn->pc", pieces.vectors(equations.residual, values, number), own)

        if self.fold:
            return np.asarray(self.signs[0] * product(self.x, self.null[0]))
        out = product(self.x, combine([self.y[i][i] for i in range(len(self.y))], self.signs))
        for sign, v in zip(self.signs, self.null, strict=True):
            h = 1.0 / self.system.norm(v)
            out += sum(sign * weight / h * product(self.x + v * (place * h), v) for place, weight in DIFFERENCES)
        return out


def derivative(special: SpecialPoint, parameter: str, *, along_the_rod: bool = False) -> Derivative:
    """How fast the load of a ``special`` point changes with a ``parameter`` of the scene; collective.

    Raises :class:`InputError` for what has no locus, or no density, and :class:`ConvergenceError` where the parameter
    destroys the point, which then has no derivative.
    """
    solver = special.point.own_solver
    check_parameter(solver.system.scene, parameter)
    if along_the_rod and not special.kind.singular:
        raise InputError(f"A density along the rod is known at folds and branch points, not at {special.kind.words}.")
    check_special(solver, special)
    if not special.kind.singular:
        return _on_locus(solver, special, parameter)
    with solver.system.clock.scope("locus"), kept(solver.system):
        adjoint = adjoint_of(special)
        splitting = _splitting(adjoint, parameter, special)
        along = adjoint.density(parameter, PIECES) if along_the_rod else ()
        found = Derivative(float(np.trace(splitting)) / len(splitting), splitting=splitting)
    return Derivative(found.value, partial(_bounds, special, parameter, found.value, along), splitting, *along)


def check_parameter(scene: Scene, parameter: str) -> None:
    """Raise :class:`InputError` for what is no constant of a scene apart from its load."""
    if parameter not in scene.parameters or parameter == scene.load:
        others = ", ".join(name for name in scene.parameters if name != scene.load)
        raise InputError(f"{parameter!r} is no parameter of the scene apart from its load: choose one of {others}.")


def adjoint_of(special: SpecialPoint) -> Adjoint:
    """Adjoint solutions of a special point, solved for once."""
    modes, solver = [*special.null_vectors, *special.nearby], special.point.own_solver
    return derived(special, Adjoint, lambda: Adjoint(solver, special.point.x, _states(solver, special, modes)))


def _states(solver: BranchSolver, special: SpecialPoint, modes: Sequence[PETSc.Vec]) -> SingularSystem:
    """Equations of a special point on a mesh, with ``modes`` near its own there."""
    return SingularSystem(solver, modes, special.multiplicity, fold=special.kind == FOLD)


def _splitting(adjoint: Adjoint, parameter: str, special: SpecialPoint) -> np.ndarray:
    """The same of an adjoint; raises :class:`ConvergenceError` with the place."""
    scene = special.point.own_solver.system.scene
    try:
        return adjoint.splitting(parameter)
    except ConvergenceError as trouble:
        place = f"{scene.load} = {special.point.load:.8g}, {parameter} = {adjoint.values[parameter]:.8g}"
        raise ConvergenceError(f"The {special.kind} at {place} has no derivative: {trouble}.") from None


def _bounds(
    special: SpecialPoint, parameter: str, value: float, along: tuple[np.ndarray, np.ndarray] | tuple[()]
) -> tuple[float, float]:
    """Bounds of the errors of a derivative and of its density, by the same point of a richer mesh."""
    solver = special.point.own_solver
    rho = halved(solver.system.fields.discretization.degree)
    with solver.system.clock.scope("error bars"):
        richer = derived(special, "richer", lambda: _richer(special))
        with kept(richer.system):
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


def _on_locus(solver: BranchSolver, special: SpecialPoint, parameter: str) -> Derivative:
    """Derivative of a flutter or a divergence load: the slope of its locus."""
    scene, load = solver.system.scene, special.point.load
    known = scene.parameters[parameter]
    room = min(abs(end - known.value) for end in known.admissible)
    near, own = 0.05 * unit(load, one=solver.units.load), min(0.05 * (abs(known.value) or 1.0), 0.5 * room)
    plane = Plane(solver.system, parameter, ((load - near, load + near), (known.value - own, known.value + own)))
    with solver.system.clock.scope("locus"), kept(solver.system):
        curve = Curve(solver, special, plane, doubtful=False)
    node = curve.first
    if node.ended:
        raise ConvergenceError(f"The {special.kind} at {plane.words(node.p)} has no derivative: {node.ended}.")
    value = float(node.dp[0] / node.dp[1])

    def bounds() -> tuple[float, float]:
        with solver.system.clock.scope("error bars"), kept(solver.system):
            richer = RicherMesh(curve.criterion, special.kind, node)
            dp = richer.again(node).dp
            return bound(value, float(dp[0] / dp[1]), ROUNDED * abs(value), richer.rho), float("nan")

    return Derivative(value, bounds)


# --- of a state


def ordinate_derivative(point: Point, parameter: str) -> Derivative:
    """How fast the ordinate of an equilibrium changes with a ``parameter``, at its load; collective.

    Raises :class:`InputError` for what is no constant, and :class:`ConvergenceError` where the state is singular.
    """
    solver = point.own_solver
    check_parameter(solver.system.scene, parameter)
    value = _of_ordinate(solver, point.x, parameter)

    def bounds() -> tuple[float, float]:
        richer = richer_mesh(solver)
        x, outcome = richer.solver.at_load(richer.transfer(point.x, state=True), point.load)
        if not outcome.converged:
            return float("inf"), float("nan")
        again = _of_ordinate(richer.solver, x, parameter)
        return bound(value, again, ROUNDED * abs(value), halved(solver.system.fields.discretization.degree)), float(
            "nan"
        )

    return Derivative(value, bounds)


def response(solver: BranchSolver, x: PETSc.Vec, parameter: str) -> PETSc.Vec:
    """Change of an equilibrium with a parameter at its load, with a one in the place of the load."""
    system, there = solver.system, x.copy()
    scene, load = system.scene, system.scalar(x)
    system.set_load(there, scene.parameters[parameter].value)
    system.line = line(scene, {scene.load: load, parameter: 0.0}, {parameter: 1.0})
    tangent = solver.load_tangent(there, increasing=True)
    slope = system.scalar(tangent)
    if not slope > TINY:
        raise ConvergenceError(f"The state at {scene.load} = {load:.8g} is singular: its ordinate has no derivative.")
    return tangent * (1.0 / slope)


def _of_ordinate(solver: BranchSolver, x: PETSc.Vec, parameter: str) -> float:
    """Derivative of the ordinate along the change of state: the ordinate is a number by itself."""
    with kept(solver.system):
        change, there = response(solver, x, parameter), x.copy()
        solver.system.set_load(there, solver.system.scene.parameters[parameter].value)
        h = 1.0 / max(solver.system.norm(change), 1.0 / unit(solver.system.scalar(there), one=1.0))
        parts = [weight / h * solver.shape.ordinate(there + change * (place * h)) for place, weight in DIFFERENCES]
    return float(sum(parts))

r"""Adjoint solutions at folds and branch points, from which the derivatives of their loads in all constants follow.

*Folds and branch points.*  At a fold with the null vector ``v`` the load ``lam`` changes by ``v . F_p dp + v . F_lam
dlam = 0``.  At a branch point the matrix of the eigenvalues ``mu`` that vanish, with null vectors ``v_i``, changes by

    R dlam + T dp,    T_ij = v_i . S_p v_j + y_ij . F_p,    S y_ij = -D(S v_i) v_j  across the null vectors,

as the state moves by ``-S^-1 F_p dp``; ``R`` is the same of the load.  One is singular along the locus of a simple
point.  Where several vanish together each load moves by itself, at rates that are the eigenvalues of the *matrix of
splitting* ``-R^-1 T``; with null vectors by which ``R`` is plus or minus the unit matrix it is symmetric (Haug, Choi &
Komkov, Design Sensitivity Analysis of Structural Systems, Academic Press 1986).  Its mean diagonal is the
derivative of the mean load.  UFL takes the derivatives in ``p``; what is along null vectors is differences of the
fourth order.

*Along the rod* a parameter may be another one in each element: a stiffness that varies.  Each term is a sum over
elements, or pieces of them, on which the state is the same polynomial: the part of one, over its length, is the mean
there of the density ``dlam/dp(s)``.  What acts at points, as a load at an end, is not in it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.criteria import IMPERFECT, restoration
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.singular import SHARP, SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.fem.checks import Pieces
from rodfem.fem.shape import Shape
from rodfem.fem.state import line
from rodfem.fem.system import System
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine
from rodfem.problem.functions import derived
from rodfem.stability.reduced_stiffness import DIFFERENCE, bordered_of
from rodfem.tolerances import TINY

DIFFERENCES = [(1e-3 * step, weight / 2e-3) for step, weight in SHARP]
"""Places and weights of a central difference of the fourth order: along a null vector, in a parameter over its size."""


class Adjoint:
    """Null vectors of a located fold or branch point ``x`` on a mesh, and all that its derivatives have in common."""

    def __init__(self, solver: BranchSolver, x: PETSc.Vec, states: SingularSystem) -> None:
        """Take the null vectors at ``x``, a solution of ``states``."""
        self.solver, self.system, self.x, self.fold = solver, solver.system, x, states.fold
        self.values = dict(zip(self.system.scene.parameters, self.system.line.origin.tolist(), strict=True))
        self.null, self.y, self._noise = list[PETSc.Vec](), list[list[PETSc.Vec]](), list[float]()
        self._normalise(self._solve(states))

    def _solve(self, states: SingularSystem) -> np.ndarray:
        """Find the null vectors and ``y``, none at folds; returns ``R`` (k, k)."""
        inertia, x = self.solver.inertia, self.x
        at, bordered = inertia.at(x), bordered_of(inertia, len(states.phi))
        column, matrix = at.border.copy(), at.matrix
        bordered.factor(matrix, states.phi)
        V, G = bordered.solve()
        Z, N = states.split(G)
        null = self.null = [combine(V, z) for z in Z.T]
        # rounding errors, independent, a hundred times, or all that is zero
        self._noise = [100.0 * rounding(matrix, v, x) + 1e-15 * inertia.scale for v in null]  # round-off
        if self.fold:
            return np.array([[column.dot(null[0])]])
        images, rates = self._along(null, states)

        def across(image: PETSc.Vec) -> PETSc.Vec:
            (y, *_), forces = bordered.solve([-image])
            return combine([y, *V], np.array([1.0, *(N @ states.rest(N, G, -forces[:, 0]))]))

        half, each = {pair: across(image) for pair, image in images.items()}, range(len(null))
        self.y = [[half[min(i, j), max(i, j)] for j in each] for i in each]
        rates += [[y.dot(column) for y in row] for row in self.y]
        return (rates + rates.T) / 2

    def _along(
        self, null: Sequence[PETSc.Vec], states: SingularSystem
    ) -> tuple[dict[tuple[int, int], PETSc.Vec], np.ndarray]:
        """``D(S v_i) v_j`` for i <= j, and the derivatives (k, k) of ``v_j . F_lam`` along null vectors ``v_i``."""
        images, rates = dict[tuple[int, int], PETSc.Vec](), np.zeros((len(null), len(null)))
        for i, v in enumerate(null):
            for step, weight in SHARP:
                share = weight / (2 * DIFFERENCE)
                *parts, force = states.images(self.x + v * (step * DIFFERENCE), null[i:])
                rates[i] += [share * force.dot(other) for other in null]
                for j, part in enumerate(parts, i):
                    images.setdefault((i, j), self.system.new_vector()).axpy(share, part)
        return images, rates

    def _normalise(self, rates: np.ndarray) -> None:
        """Take null vectors by which ``R``, the ``rates`` (k, k), has plus or minus one on its diagonal."""
        values, turn = (rates[0], np.ones((1, 1))) if self.fold else np.linalg.eigh(rates)
        if not abs(values).min() > TINY:
            raise ConvergenceError("the load does not change the eigenvalue that vanishes")
        self.signs = np.sign(values)
        turn = (turn / (abs(values) if self.fold else np.sqrt(abs(values)))).T
        flat = [vector for row in self.y for vector in row]
        self.null = [combine(self.null, column) for column in turn]
        if flat:
            self.y = [[combine(flat, np.outer(a, b).ravel()) for b in turn] for a in turn]

    def splitting(self, parameter: str) -> np.ndarray:
        """Matrix of splitting for a ``parameter``; raises :class:`ConvergenceError` for an imperfection."""
        column = self._column(self.x, parameter)
        if self.fold:
            return np.array([[-self.signs[0] * column.dot(self.null[0])]])
        self._check(column, parameter)
        out = np.array([[y.dot(column) for y in row] for row in self.y])
        for v, row in zip(self.null, out, strict=True):
            h = DIFFERENCE / self.system.norm(v)
            for step, weight in SHARP:
                there = self._column(self.x + v * (step * h), parameter)
                row += [weight / (2 * h) * there.dot(other) for other in self.null]
        return np.asarray(-self.signs[:, None] * (out + out.T) / 2)

    def _column(self, x: PETSc.Vec, parameter: str) -> PETSc.Vec:
        """Derivative of the equations in a parameter at ``x``; phase conditions stay."""
        scene, before, there = self.system.scene, self.system.line, x.copy()
        at = {**self.values, scene.load: self.system.scalar(x)}
        self.system.set_load(there, at[parameter])
        self.system.line = line(scene, {**at, parameter: 0.0}, {parameter: 1.0})
        try:
            return self.solver.inertia.force(there)
        finally:
            self.system.line = before

    @property
    def load(self) -> float:
        """The critical load."""
        return self.system.scalar(self.x)

    def _check(self, column: PETSc.Vec, parameter: str) -> None:
        """Raise :class:`ConvergenceError` if a change of the equations does work on a null vector."""
        for v, noise in zip(self.null, self._noise, strict=True):
            each = column.duplicate()
            each.pointwiseMult(column, v)
            work, size = abs(each.sum()), self.system.norm(v)
            if work > noise * size and work > IMPERFECT * each.norm(PETSc.NormType.NORM_1):
                at = f"{self.system.scene.load} = {self.load:.8g}, {parameter} = {self.values[parameter]:.8g}"
                raise ConvergenceError(
                    f"The branch point at {at} has no derivative: {parameter} is an imperfection that destroys it, or "
                    "is one on this mesh alone."
                )

    def density(self, parameter: str, pieces: int) -> tuple[np.ndarray, np.ndarray]:
        """Ends (m + 1,) of the pieces of the rod, and the density (m,) of the mean load on each."""
        shape, known = self.solver.shape, self.values[parameter]
        size = abs(known) or 1.0
        parts = sum(
            weight / size * self._parts({parameter: known + place * size}, pieces) for place, weight in DIFFERENCES
        )
        return _along(shape, np.asarray(-parts / len(self.null)), pieces)

    def _parts(self, constants: dict[str, float], number: int) -> np.ndarray:
        """Parts (pieces, cells) of the sum of ``v . S v + y . F``, at folds of ``v . F``, with other constants."""
        scene, system = self.system.scene, self.system
        system.equations.take(line(scene, {**self.values, **constants, scene.load: 0.0}, {scene.load: 1.0}))

        def product(state: PETSc.Vec, covector: PETSc.Vec) -> np.ndarray:
            return _product(system, state, covector, number)

        if self.fold:
            return np.asarray(self.signs[0] * product(self.x, self.null[0]))
        out = product(self.x, combine([self.y[i][i] for i in range(len(self.y))], self.signs))
        for sign, v in zip(self.signs, self.null, strict=True):
            h = 1.0 / self.system.norm(v)
            out += sum(sign * weight / h * product(self.x + v * (place * h), v) for place, weight in DIFFERENCES)
        return out


def _product(system: System, state: PETSc.Vec, covector: PETSc.Vec, number: int) -> np.ndarray:
    """Parts (pieces, cells) of the equations at a state times a covector, with the constants that were taken."""
    equations = system.equations
    pieces = derived(equations, Pieces, lambda: Pieces(equations))
    values, own = (v.local[pieces.dofs] for v in (system.at(state), system.change(covector)))
    return np.einsum("pcn,cn->pc", pieces.vectors(equations.residual, values, number), own)


def _along(shape: Shape, parts: np.ndarray, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends (m + 1,) of the pieces of the rod, and the means (m,) of which ``parts`` (number, cells) are integrals."""
    start, length = (shape.from_left(each)[:, None] for each in (shape.start, shape.size))
    ends = np.append((start + length * np.arange(number) / number).ravel(), start[-1, 0] + length[-1, 0])
    return ends, (shape.from_left(np.transpose(parts)) * number / length).ravel()


# --- of a state


def state_derivative(
    solver: BranchSolver, x: PETSc.Vec, parameter: str, of: Callable[[PETSc.Vec], np.ndarray]
) -> np.ndarray:
    """Derivative of numbers ``of`` an equilibrium in a parameter, at its load: along the change of state, a tangent."""
    system = solver.system
    scene, there, load = system.scene, x.copy(), system.scalar(x)
    at = {**dict(zip(scene.parameters, system.line.origin.tolist(), strict=True)), scene.load: load}
    with restoration(system):
        system.set_load(there, at[parameter])
        system.line = line(scene, {**at, parameter: 0.0}, {parameter: 1.0})
        tangent = solver.load_tangent(there, increasing=True)
        slope = system.scalar(tangent)
        if not slope > TINY:
            raise ConvergenceError(f"The state at {scene.load} = {load:.8g} is singular and has no derivative.")
        parts = [weight / slope * of(there + tangent * place) for place, weight in DIFFERENCES]
    return np.asarray(sum(parts))


def ordinate_density(solver: BranchSolver, x: PETSc.Vec, parameter: str, pieces: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends (m + 1,) of pieces of the rod, and the density (m,) of the derivative of an ordinate at its load.

    ``-a . F_p`` with ``S a = o``, the ordinate's own derivatives, by differences of the fourth order in each unknown.
    """
    system = solver.system
    scene, gradient, a, there = system.scene, system.new_vector(), system.new_vector(), x.copy()
    values = dict(zip(scene.parameters, system.line.origin.tolist(), strict=True))
    for i in range(x.size):
        unit = system.new_vector()
        unit.setValue(i, 1.0)
        unit.assemble()
        slope = sum(weight * solver.shape.ordinate(there + unit * place) for place, weight in DIFFERENCES)
        gradient.axpy(slope, unit)
    system.set_load(gradient, 0.0)
    system.set_phase(x)
    system.at(x).factor(solver.axis)
    if not system.solve(gradient, a):
        raise ConvergenceError(f"The state at {scene.load} = {system.scalar(x):.8g} is singular and has no derivative.")
    size, parts = abs(values[parameter]) or 1.0, np.zeros(())
    for place, weight in DIFFERENCES:
        changed = {**values, parameter: values[parameter] + place * size, scene.load: 0.0}
        system.equations.take(line(scene, changed, {scene.load: 1.0}))
        parts = parts - weight / size * _product(system, x, a, pieces)
    return _along(solver.shape, parts, pieces)

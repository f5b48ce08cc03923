r"""Adjoint solutions at special points, from which the derivatives of their loads in all constants follow.

With changes ``y``, ``w``, ``v`` and ``m`` of the state each load has a functional ``E = y . F + w . S v - w . M m`` of
state, load and parameter.  By ``S^t y = -D(w . S v - w . M m)`` its derivative in the state vanishes, so that the load
moves by ``E_p dp + E_lam dlam = 0``, whatever the state does.  UFL derives E in all of them at once.

*Folds*: ``y`` is the null vector alone.  *Branch points*, and *divergence* without a potential: ``w`` and ``v`` are
left and right null vectors, ``y`` has no part along them.  Where several eigenvalues vanish together each load moves by
itself, at rates that are the eigenvalues of the *matrix of splitting*: ``-E_p`` for all pairs ``w_i``, ``v_j``, with
which ``E_lam`` is the unit matrix.  Its mean diagonal is that of the mean load (Haug, Choi & Komkov, Design Sensitivity
Analysis of Structural Systems, Academic Press 1986).

*Flutter*: with bases ``V`` and ``W`` of a cluster's right and left subspace, ``W^t M V = 1`` and ``A = W^t S V``, what
vanishes, ``D`` or the mean rate (:mod:`rodfem.stability.cluster`), changes by

    tr Q W^t (dS V - dM V A),    Q = 2 (A - c) / k,  or 1 / k.

At a double eigenvalue ``mu`` it is ``w . (dS - mu dM) v`` for the one right and the one left vector (Seyranian &
Mailybaev, *Multiparameter Stability Theory with Mechanical Applications*, World Scientific 2003, chapter 2).

*Along the rod* a parameter may be another one in each element: a stiffness that varies.  E is a sum over elements, or
pieces of them, on which the state is the same polynomial: the part of one, over its length, is the mean there of the
density ``dlam/dp(s)``.  What acts at points, as a load at an end, is not in it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.singular import SHARP, SingularSystem
from rodfem.errors import ConvergenceError
from rodfem.fem.checks import Pieces
from rodfem.fem.shape import Shape
from rodfem.fem.state import State, line
from rodfem.fem.system import System
from rodfem.linalg.matrices import rounding
from rodfem.linalg.orthogonal import combine
from rodfem.problem.functions import derived
from rodfem.stability.cluster import Cluster, sides
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.reduced_stiffness import Bordered
from rodfem.tolerances import TINY

IMPERFECT = 1e-7
"""Over the lowest bending eigenvalue, or over the terms that cancel: a larger imperfection is not one of the mesh."""
DIFFERENCES = [(1e-3 * step, weight / 2e-3) for step, weight in SHARP]
"""Places and weights of a central difference of the fourth order, of functions in Python."""
Terms = Sequence[tuple[PETSc.Vec | None, ...]]
"""Changes y, w, v and m of a state, None for zero, of which a functional is the sum."""
Found = tuple[np.ndarray, list[np.ndarray]]
"""A matrix of splitting, and a density by ends of pieces and means on them, empty without one."""


class Adjoint:
    """The functionals of a special point at ``x`` on a mesh, and all that its derivatives have in common.

    Each of the (k, k) functionals is a sum of ``terms``, ``rates`` (k, k) are their derivatives in the load, and
    ``null`` are the right null vectors.  Of a cluster that collides ``left`` is what should vanish.
    """

    def __init__(self, solver: BranchSolver, x: PETSc.Vec, near: SingularSystem | Cluster) -> None:
        """Take the vectors at ``x``, a solution of the equations of a singular point, or of a cluster ``near`` by."""
        self.solver, self.system, self.x, self.left = solver, solver.system, x, 0.0
        self.values, self.load = values_of(self.system), self.system.scalar(x)
        self.null, self._duals, self.terms = list[PETSc.Vec](), list[tuple[PETSc.Vec, float]](), list[Terms]()
        rates = self._colliding(near) if isinstance(near, Cluster) else self._singular(near)
        self.rates = np.reshape(rates, (max(len(self.null), 1), -1))

    def _singular(self, states: SingularSystem) -> list[float]:
        """Take the terms of null vectors; returns their rates."""
        modes, others, G, bordered = states.relaxed(self.x)
        inertia, at, (Z, N) = self.solver.inertia, self.solver.inertia.at(self.x), states.split(G)
        self.null, duals = ([combine(side, z) for z in Z.T] for side in (modes, others))
        if states.fold:
            self.terms = [[(self.null[0], None, None, None)]]
            return [at.border.dot(self.null[0])]
        least = 1e-15 * inertia.scale  # where all is zero; else rounding errors, independent, a hundred times
        self._duals = [(w, 100.0 * rounding(at.matrix, w, self.x) + least) for w in duals]
        pairs = [(None, w, v, None) for w in duals for v in self.null]
        forces, parts = self._derivatives(pairs)
        y, border = bordered.solve(forces)
        near = (N @ states.rest(N, G, -border[:, : len(pairs)])).T
        y = [combine([one, *others], np.array([1.0, *amplitudes])) for one, amplitudes in zip(y, near, strict=False)]
        self.terms = [[(one, *pair[1:])] for one, pair in zip(y, pairs, strict=True)]
        return [part + one.dot(at.border) for part, one in zip(parts, y, strict=True)]

    def _colliding(self, cluster: Cluster) -> list[float]:
        """Take the terms of a cluster that collides; returns their rate."""
        system, pencil = self.system, NonsymmetricSolver(self.system).at(self.x)
        V, W, A = sides(pencil, cluster)
        k, Q = len(A), np.eye(len(A)) / len(A)
        self.left = float(np.trace(A)) / k
        if system.scene.inertia.order == 2:
            inside = A - self.left * np.eye(k)
            self.left, Q = float(np.trace(inside @ inside)) / k, 2.0 * inside / k
        terms = [(None, *term) for term in zip(*map(system.vectors, (W, V @ Q, V @ A @ Q)), strict=True)]
        forces, parts = self._derivatives(terms)
        (y,), _ = transposed(self.solver, self.x).solve([combine(forces, np.ones(k))])
        self.terms = [[(y, None, None, None), *terms]]
        return [sum(parts) + y.dot(self.solver.inertia.at(self.x).border)]

    def _derivatives(self, terms: Terms) -> tuple[list[PETSc.Vec], list[float]]:
        """What balances the derivatives of some terms in the state, and those in its load."""
        forces, parts = list[PETSc.Vec](), list[float]()
        for term in terms:
            local = self.system.at(self.x).adjoint(term)
            forces.append(self.system.new_vector())
            self.system.add_up(-local, forces[-1])
            parts.append(self._of_load(local))
        return forces, parts

    def _of_load(self, local: np.ndarray) -> float:
        return float(self.system.sum(local[self.system.fields.copies[:, -1]].sum()))

    @cached_property
    def turned(self) -> tuple[np.ndarray, np.ndarray]:
        """Matrices L and R with ``L rates R = 1``, transposes but for signs where rates are symmetric."""
        symmetric = self.solver.conservative
        values, turn = np.linalg.eigh((self.rates + self.rates.T) / 2) if symmetric else np.linalg.eig(self.rates)
        if not abs(values).min() > TINY:
            raise ConvergenceError("the load does not change the eigenvalue that vanishes")
        if not symmetric:
            return np.linalg.inv(self.rates), np.eye(len(values))
        R = turn / np.sqrt(abs(values))
        return (R * np.sign(values)).T, R

    def rates_in(self, parameter: str) -> np.ndarray:
        """Derivatives (k, k) in a ``parameter``; raises :class:`ConvergenceError` for an imperfection."""
        with along(self.system, self.x, self.values, parameter) as there:
            if self._duals:
                self._check(parameter, self.solver.inertia.force(there))
            state = self.system.at(there)
            rates = [sum(self._of_load(state.adjoint(term)) for term in terms) for terms in self.terms]
        return np.reshape(rates, self.rates.shape)

    def splitting(self, parameter: str) -> np.ndarray:
        """Matrix of splitting for a ``parameter``."""
        L, R = self.turned
        return -L @ self.rates_in(parameter) @ R

    def density(self, parameter: str, pieces: int) -> list[np.ndarray]:
        """Ends (m + 1,) of the ``pieces`` of all elements, and the density (m,) of the mean load on each."""
        L, R = self.turned
        weighed = zip((R @ L).T.ravel() / -len(L), self.terms, strict=True)
        with along(self.system, self.x, self.values, parameter) as there:
            state = self.system.at(there)
            parts = sum(weight * _parts(state, term, pieces) for weight, terms in weighed for term in terms)
        return _means(self.solver.shape, parts, pieces)

    def _check(self, parameter: str, column: PETSc.Vec) -> None:
        """Raise :class:`ConvergenceError` if a change of the equations does work on a null vector."""
        for w, noise in self._duals:
            each = column.duplicate()
            each.pointwiseMult(column, w)
            work = abs(each.sum())
            if work > noise and work > IMPERFECT * each.norm(PETSc.NormType.NORM_1):
                at = f"{self.system.scene.load} = {self.load:.8g}, {parameter} = {self.values[parameter]:.8g}"
                raise ConvergenceError(
                    f"The branch point at {at} has no derivative: {parameter} is an imperfection that destroys it, or "
                    "is one on this mesh alone."
                )


@contextmanager
def restoration(system: System) -> Iterator[None]:
    """Restore on exit all that a locus changes: the line of parameters, phase conditions."""
    before = system.line, system.phase
    try:
        yield
    finally:
        system.line, system.phase = before


@contextmanager
def along(system: System, x: PETSc.Vec, values: Mapping[str, float], parameter: str) -> Iterator[PETSc.Vec]:
    """Let the load stand for a ``parameter``: yields the state ``x`` there; all else has these ``values``."""
    scene, there, at = system.scene, x.copy(), {**values, system.scene.load: system.scalar(x)}
    with restoration(system):
        system.set_load(there, at[parameter])
        system.line = line(scene, {**at, parameter: 0.0}, {parameter: 1.0})
        yield there


def transposed(solver: BranchSolver, x: PETSc.Vec) -> Bordered:
    """Factors of the transposed tangent matrix at a state; raises :class:`ConvergenceError` if it is singular."""
    matrix = solver.inertia.at(x).matrix.transpose(PETSc.Mat())
    factors = derived(solver, "transposed", lambda: Bordered(solver.system, matrix, 0, None))
    factors.factor(matrix, [])
    return factors


def _parts(state: State, term: Sequence[PETSc.Vec | None], number: int) -> np.ndarray:
    """Parts (pieces, cells) of the derivative of a term in what the load of a state stands for."""
    form, equations = state.equations.adjoint, state.equations
    pieces = derived(equations, Pieces, lambda: Pieces(equations))
    equations.take(state.line)
    return pieces.vectors(form, state.with_changes(term)[:, pieces.dofs], number)[..., pieces.load]


def _means(shape: Shape, parts: np.ndarray, number: int) -> list[np.ndarray]:
    """Ends (m + 1,) of the pieces of the rod, and the means (m,) of which ``parts`` (number, cells) are integrals."""
    start, length = (shape.from_left(each)[:, None] for each in (shape.start, shape.size))
    ends = np.append((start + length * np.arange(number) / number).ravel(), start[-1, 0] + length[-1, 0])
    return [ends, (shape.from_left(np.transpose(parts)) * number / length).ravel()]


# --- of a state


def state_derivative(
    solver: BranchSolver, x: PETSc.Vec, parameter: str, of: Callable[[PETSc.Vec], np.ndarray]
) -> np.ndarray:
    """Derivative of numbers ``of`` an equilibrium in a parameter, at its load: along the change of state, a tangent."""
    system, load = solver.system, solver.system.scalar(x)
    with along(system, x, values_of(system), parameter) as there:
        tangent = solver.load_tangent(there, increasing=True)
        slope = system.scalar(tangent)
        if not slope > TINY:
            raise ConvergenceError(f"The state at {system.scene.load} = {load:.8g} is singular and has no derivative.")
        parts = [weight / slope * of(there + tangent * place) for place, weight in DIFFERENCES]
    return np.asarray(sum(parts))


def ordinate_density(solver: BranchSolver, x: PETSc.Vec, parameter: str, pieces: int) -> list[np.ndarray]:
    """Ends (m + 1,) of pieces of the rod, and the density (m,) of the derivative of an ordinate at its load.

    ``-a . F_p`` with ``S^t a = o``, the ordinate's own derivatives, by differences of the fourth order in each unknown.
    """
    system, gradient = solver.system, solver.system.new_vector()
    for i in range(x.size):
        unit = system.new_vector()
        unit.setValue(i, 1.0)
        unit.assemble()
        gradient.axpy(sum(weight * solver.shape.ordinate(x + unit * place) for place, weight in DIFFERENCES), unit)
    system.set_load(gradient, 0.0)
    with restoration(system):
        (a,), _ = transposed(solver, x).solve([-gradient])
    with along(system, x, values_of(system), parameter) as there:
        parts = _parts(system.at(there), (a, None, None, None), pieces)
    return _means(solver.shape, parts, pieces)


def values_of(system: System) -> dict[str, float]:
    """Values of all parameters at which a system is."""
    return dict(zip(system.scene.parameters, system.line.origin.tolist(), strict=True))

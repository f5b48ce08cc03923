"""Left-most eigenvalues of an equilibrium by SLEPc, on the singular pencil of its saddle matrix.

    (K C; C^t 0) x = mu (M 0; 0 0) x

with ``M`` the kinetic metric: stable where all ``mu = omega^2`` are positive (Kumar & Healey 2010, (21) and (45)).
``M`` is singular, so that only shift-invert is free of spurious eigenvalues: ``(S - sigma M)^-1 M`` is zero on all that
has no inertia.  A symmetry mode, of eigenvalue zero, is excluded by the constraint ``g.Mx = 0`` and by deflation.

The shift is below the spectrum: the nearest eigenvalues to it are the left-most ones.  A count just above the last of
them proves that none is missing, wherever the shift was.  All is in units of natural sizes, but for the modes that are
returned.  Along a branch the shift, the symbolic factorisations and a first vector, the sum of the modes, are those of
the point before: two numeric factorisations a point, one to solve with and one to count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.compat import slepc_errors
from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Factors
from rodfem.linalg.matrices import places_in, shared
from rodfem.stability.inertia import Inertia
from rodfem.stability.pencil import (
    PencilMatrices,
    assemble_pencil,
    exclude_modes,
    in_units,
    scale_in_units,
    symmetry_modes,
)
from rodfem.tolerances import SAME_EIGENVALUE

HIT = 1e-8
"""Distance of a shift from an eigenvalue, relative, below which round-off spoils the others, and the count there."""
CONVERGED = 1e-7
"""Residual, relative to the stiffness, above which a pair is rejected: the Krylov space broke down."""


class Eigenvalues(NamedTuple):
    """Eigenvalues ``values`` (k,), ``vectors``, backward ``errors``; ``certified``: counts prove that none is missing.

    ``factorisations`` are those in addition to the symmetric solver's; a ``note`` goes after the reason for the method.
    """

    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    certified: bool = False
    factorisations: int = 0
    note: str = ""


class SymmetricSolver(PencilMatrices):
    """The pencil of one state at a time, by :meth:`at`: its left-most eigenvalues, and counts below a number.

    ``scale`` is the size of the least eigenvalue, ``scaled`` matrix and mass in natural units.  The next computation
    starts at ``shift``: the first one, and one whose count finds any missing, moves it below all eigenvalues.
    ``factorisations`` counts the numeric ones.
    """

    def __init__(self, inertia: Inertia) -> None:
        super().__init__(inertia.system)
        self.inertia, self.factors = inertia, self.system.fields.factors("cholesky")
        self.scaled, self._shifted, self._factored = (self.matrix, self.mass), self.system.state_matrix(), np.nan
        self.scale = scale_in_units(self.system)
        self.shift, self.factorisations, self.last = -self.scale, 0, np.zeros(0)
        self.deflated: list[PETSc.Vec] = []
        self._places: np.ndarray | None = None
        self._drifts = 0

    def at(self, x: PETSc.Vec) -> SymmetricSolver:
        """Assemble the pencil of the state ``x``; returns this solver."""
        system = self.system
        with system.clock("assembly"):
            modes = symmetry_modes(system, x)
            assemble_pencil(system, x, self.matrix, self.mass)
            free = exclude_modes(system, modes, self.matrix, self.mass)
            # a Krylov space is deflated by those that have mass, too, or round-off adds them if ``mu`` is large
            self.deflated = [mode for mode in free if abs(mode.dot(self.mass * mode) - 1.0) < 0.5]
            self.scaled = in_units(system, self.matrix, self.mass, self.sizes)
            if not system.scene.units.ordinary:
                for mode in self.deflated:
                    mode.pointwiseDivide(mode, self.sizes)
        self._factored, self._drifts = np.nan, system.phase.count
        return self

    def factor(self, sigma: float) -> None:
        """Factor ``S - sigma M``, unless that is what was factored last."""
        if sigma == self._factored:
            return
        own, mass, target = (shared(matrix) for matrix in (*self.scaled, self._shifted))
        if own and mass and target:  # in a tenth of PETSc's time
            if self._places is None:
                self._places = places_in(own.pattern, mass.pattern)
            target.values[:] = own.values
            target.values[self._places] -= sigma * mass.values
        else:
            self.scaled[0].copy(self._shifted, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            self._shifted.axpy(-sigma, self.scaled[1], PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self._shifted.stateIncrease()
        self.factors(self._shifted)
        self._factored = sigma
        self.factorisations += 1

    def leftmost(self, number: int) -> Eigenvalues:
        """Return the ``number`` left-most eigenvalues in its units; :class:`ConvergenceError` if there are fewer."""
        with self.system.clock("stability"):
            modes = self._solve(number, 1) if len(self.last) else None
            if modes is None or not modes.certified:
                self.go_below()
                for extra in (1, 4, 14):
                    modes = self._solve(number, extra)
                    if modes.certified:
                        break
        assert modes is not None
        if len(modes.values) < number:
            raise ConvergenceError(
                f"SLEPc found {len(modes.values)} of the {number} eigenvalues asked for: ask for fewer, or use a "
                "richer discretisation."
            )
        spread = modes.values[-1] - modes.values[0] + 1e-3 * abs(modes.values).max()  # equal ones have none
        self.shift = modes.values[0] - 0.1 * spread
        values, vectors = self.system.scene.units.omega2 * modes.values, self.unscaled(modes.vectors)
        return modes._replace(values=values, vectors=vectors)

    def unscaled(self, vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """The same vectors in the rod's units, in place."""
        if not self.system.scene.units.ordinary:
            for vector in vectors:
                vector.pointwiseMult(vector, self.sizes)
        return vectors

    def go_below(self) -> None:
        """Move the shift below the spectrum; raises :class:`ConvergenceError` if it has no lower end."""
        step = max(abs(self.shift), self.scale)
        for _ in range(40):
            if self.eigenvalue_count(self.shift) == 0 and not self._shift_is_an_eigenvalue():
                return
            self.shift -= step
            step *= 3
        raise ConvergenceError(
            "The spectrum has no lower end: the kinetic metric is too small for the rod's stiffness; give the rod a "
            "larger mass or rotary inertia."
        )

    def _shift_is_an_eigenvalue(self) -> bool:
        """Whether that is so but for round-off, which a count does not show: a step of inverse iteration does."""
        mode = self.inertia.seed(0)
        mode.scale(1.0 / self.system.norm(mode))
        grown = mode.duplicate()
        self.factors.solve(self.scaled[1] * mode, grown)
        return not self.system.norm(grown) * HIT * abs(self.shift) < 1.0

    def eigenvalue_count(self, sigma: float) -> int:
        """Number of eigenvalues below ``sigma``; :class:`ConvergenceError` if the count breaks down."""
        self.factor(sigma)
        return self.inertia.counted(self.factors, sigma, self._drifts)

    def certifies(self, values: np.ndarray) -> bool:
        """Whether counts find none below the least of ``values``, and as many as there are below the greatest."""
        small = SAME_EIGENVALUE * max(abs(values).max(), self.scale)
        distinct = values < values[-1] - small
        return (
            self.eigenvalue_count(values[0] - small) == 0
            and self.eigenvalue_count(values[-1] - small) == distinct.sum()
            and self.eigenvalue_count(values[-1] + small) >= len(values)
        )

    def _solve(self, number: int, extra: int) -> Eigenvalues:
        """Solve for ``number`` values and some more, and count whether any is missing among the first ``number``."""
        self.factor(self.shift)
        if not self.factors.regular:
            self.shift -= self.scale
            return self._solve(number, extra)
        values, vectors, errors = self._krylov_schur(number + extra)
        reach = max(values[-1] - self.shift, self.scale) if len(values) else np.inf
        if len(values) and values[0] - self.shift < HIT * reach:
            self.shift -= reach
            return self._solve(number, extra)
        if len(values) < number:
            return Eigenvalues(values, vectors, errors)
        self.last = sum(vector.array_r for vector in vectors)
        cut = values[number - 1] + SAME_EIGENVALUE * max(abs(values[number - 1]), self.scale)
        known = int((values < cut).sum())
        return Eigenvalues(values[:number], vectors[:number], errors[:number], self.eigenvalue_count(cut) == known)

    def _krylov_schur(self, number: int) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray]:
        """``number`` eigenvalues or all there are, with vectors and backward errors, without what is no eigenpair."""
        start = self.inertia.seed(1)
        if len(self.last):
            start.scale(1e-6 / self.system.norm(start))  # a space that is invariant already would miss all else
            start.array[:] += self.last
        solver = self.eigensolver(number, start)
        with slepc_errors():
            solver.solve()
        values, vectors = self.converged(solver, number)
        solver.destroy()
        if not vectors:
            return values, vectors, values
        # purified: (mu - sigma) (S - sigma M)^-1 M x has no arbitrary massless parts
        right = np.stack([(self.scaled[1] * vector).array_r.real for vector in vectors], axis=1)
        for value, vector, column in zip(values, vectors, self.factors.solve_all(right).T, strict=True):
            vector.array[:] = (value - self.shift) * column
        errors = self.backward_errors(values, vectors)
        stiffness, mass = self._norms()
        true = [i for i in range(len(values)) if errors[i] * (1 + abs(values[i]) * mass / stiffness) < CONVERGED]
        return values[true], [vectors[i] for i in true], errors[true]

    def converged(self, solver: SLEPc.EPS, number: int) -> tuple[np.ndarray, list[PETSc.Vec]]:
        """The ``number`` left-most eigenvalues, or all, that a ``solver`` has found, and their vectors."""
        values = np.array([solver.getEigenvalue(i).real for i in range(solver.getConverged())])
        order = np.argsort(values)[:number]
        vectors = [self.system.new_vector() for _ in order]
        for i, vector in zip(order, vectors, strict=True):
            solver.getEigenvector(int(i), vector)
        return values[order], vectors

    def eigensolver(self, number: int, start: PETSc.Vec) -> SLEPc.EPS:
        """Set up shift-invert for the ``number`` eigenvalues nearest to the shift that was factored."""
        solver = eigensolver(*self.scaled, "rodfem_")
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(self.shift)
        # in a Krylov space with fewer vectors restarts cost more
        solver.setDimensions(number, number + max(number, 6))
        solver.setTolerances(tol=1e-9, max_it=300)  # of vectors: the error of the eigenvalues is the square
        solver.setPurify(False)
        solver.setInitialSpace([start])
        if self.deflated:
            solver.setDeflationSpace(self.deflated)
        transform = solver.getST()
        transform.setMatMode(SLEPc.ST.MatMode.SHELL)  # the shifted matrix is never formed
        ksp = transform.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(_Inverse(self.factors))
        with slepc_errors():
            solver.setFromOptions()
        return solver

    def _norms(self) -> list[float]:
        """Sizes of stiffness and mass."""
        return [matrix.norm(PETSc.NormType.INFINITY) for matrix in self.scaled]

    def backward_errors(self, values: np.ndarray, vectors: list[PETSc.Vec]) -> np.ndarray:
        """Backward errors ``|S x - mu M x| / ((|S| + |mu| |M|) |x|)``."""
        stiffness, mass = self._norms()
        errors, (S, M) = [], self.scaled
        for value, vector in zip(values, vectors, strict=True):
            residual = S * vector - M * vector * value
            errors.append(residual.norm() / ((stiffness + abs(value) * mass) * vector.norm()))
        return np.array(errors)


def eigensolver(matrix: PETSc.Mat, mass: PETSc.Mat, prefix: str) -> SLEPc.EPS:
    """Krylov-Schur solver with shift-invert for the symmetric pencil ``matrix - mu mass``, the mass semidefinite."""
    solver = SLEPc.EPS().create(matrix.comm)
    solver.setOptionsPrefix(prefix)
    solver.setOperators(matrix, mass)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.getST().setType(SLEPc.ST.Type.SINVERT)
    return solver


class _Inverse:
    """Python context of a PETSc preconditioner that solves with factors made elsewhere."""

    def __init__(self, factors: Factors) -> None:
        self.factors = factors

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, z: PETSc.Vec) -> None:
        """Solve for ``z``."""
        self.factors.solve(b, z)

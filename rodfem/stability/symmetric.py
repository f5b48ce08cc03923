"""Left-most eigenvalues of an equilibrium by SLEPc, on the singular pencil of its saddle matrix.

    (K C; C^t 0) x = mu (M 0; 0 0) x

with ``M`` the kinetic metric: stable where all ``mu = omega^2`` are positive (Kumar & Healey 2010, (21) and (45)).
``M`` is singular, so that only shift-invert is free of spurious eigenvalues: ``(S - sigma M)^-1 M`` is zero on all that
has no inertia.  A symmetry mode, of eigenvalue zero, is excluded by the constraint ``g.Mx = 0`` and by deflation.

The shift is below the spectrum: the nearest eigenvalues to it are the left-most ones.  A count just above the last of
them proves that none is missing, wherever the shift was.  All is in units of natural sizes, but for the modes that are
returned.  Along a branch the shift, the symbolic factorisations and a first vector, the sum of the modes, are those of
the point before: two numeric factorisations a point, one to solve with and one to count.

SLEPc's options have the prefix ``rodfem_`` (``-rodfem_eps_monitor``, ``-rodfem_eps_ncv 40``, ``-rodfem_st_type``, ...),
and overrule what is set here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.compat import slepc_errors
from rodfem.errors import ConvergenceError
from rodfem.linalg.factorization import Factors
from rodfem.linalg.matrices import places_in, shared
from rodfem.stability.inertia import Inertia, inertia_factors
from rodfem.stability.pencil import (
    PencilMatrices,
    StatePencil,
    assemble_pencil,
    exclude_modes,
    in_units,
    scale_in_units,
    symmetry_modes,
)
from rodfem.tolerances import SAME_EIGENVALUE

HIT = 1e-8
"""A shift nearer to an eigenvalue than this, relative to the farthest one found, or to itself, is one: but for
round-off, which spoils the others, and the count there."""
OF_VECTORS = 1e-9
"""Relative tolerance of SLEPc for vectors of the left-most ones: the error of the eigenvalues is the square."""
EXTRA = (1, 4, 14)
"""How many eigenvalues more than wanted are computed, at the first, the second and the third attempt."""

CONVERGED = 1e-7
"""Residual, relative to the stiffness, above which a pair is rejected: the Krylov space broke down."""
LEAST_SPREAD = 1e-3
"""Part of the greatest eigenvalue that is added to the distance of the others: equal ones have none."""
NOISE = 1e-6
"""Weight of a generic vector added to the previous modes, which may span an invariant space without the lowest."""


class Found(NamedTuple):
    """Eigenvalues ``values`` (k,), ``vectors``, backward ``errors``; ``certified``: counts prove that none is missing.

    ``factorisations`` are those in addition to the workspace's own; a ``note`` goes after the reason for the method.
    """

    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    certified: bool = False
    factorisations: int = 0
    note: str = ""

    def negative(self, tolerance: float) -> int:
        """Number of eigenvalues below ``-tolerance``."""
        return int((self.values < -tolerance).sum())


NOTHING = Found(np.zeros(0), [], np.zeros(0))


@dataclass
class _Shifted:
    """Factors of ``S - sigma M``, that matrix, and ``sigma`` (nan: none of this state)."""

    factors: Factors
    matrix: PETSc.Mat
    at: float = np.nan


class SymmetricSolver(PencilMatrices):
    """Matrices and factorisations of the pencil, which the states of one system share: see :meth:`at`.

    ``scale`` is the size of the least eigenvalue, ``scaled`` matrix and mass in natural units.  The next computation
    starts at ``shift``: the first one, and one whose count finds any missing, moves it below all eigenvalues.
    ``factorisations`` counts the numeric ones.
    """

    def __init__(self, inertia: Inertia) -> None:
        super().__init__(inertia.system)
        self.inertia = inertia
        system, sizes = self.system, (self.system.fields.along, self.system.fields.dense_rows)
        self.shifted = _Shifted(inertia_factors(system.comm, *sizes), system.state_matrix())
        self.scale = scale_in_units(self.system)
        self.shift = -self.scale
        self.factorisations = 0
        self.last = np.zeros(0)
        self.deflated: list[PETSc.Vec] = []
        self.scaled = self.matrix, self.mass
        self._places: np.ndarray | None = None

    def at(self, x: PETSc.Vec) -> SymmetricPencil:
        """Assemble the pencil of the state ``x``."""
        system = self.system
        self.filled += 1
        with system.clock("assembly"):
            modes = symmetry_modes(system, x)
            assemble_pencil(system, x, self.matrix, self.mass)
            self.deflated = exclude_modes(system, modes, self.matrix, self.mass)
            self.scaled = in_units(system, self.matrix, self.mass, self.sizes)
            if not system.scene.units.ordinary:
                for mode in self.deflated:
                    mode.pointwiseDivide(mode, self.sizes)
        self.shifted.at = np.nan
        return SymmetricPencil(self)

    def factor(self, sigma: float) -> None:
        """Factor ``S - sigma M``, unless that is what was factored last."""
        shifted = self.shifted
        if sigma == shifted.at:
            return
        self._fill(shifted.matrix, sigma)
        shifted.matrix.stateIncrease()
        shifted.factors(shifted.matrix)
        shifted.at = sigma
        self.factorisations += 1

    def _fill(self, target: PETSc.Mat, sigma: float) -> None:
        """Let ``target`` be ``S - sigma M``: by numpy where it shares the arrays, in a tenth of PETSc's time."""
        own, mass, values = (shared(matrix) for matrix in (*self.scaled, target))
        if own is None or mass is None or values is None:
            self.scaled[0].copy(target, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            target.axpy(-sigma, self.scaled[1], PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            return
        if self._places is None:
            self._places = places_in(own.pattern, mass.pattern)
        values.values[:] = own.values
        values.values[self._places] -= sigma * mass.values


class SymmetricPencil(StatePencil[SymmetricSolver]):
    """The pencil of one state: its left-most eigenvalues, and counts below a number."""

    def __init__(self, shared: SymmetricSolver) -> None:
        super().__init__(shared)
        self.inertia, self._drifts = shared.inertia, shared.system.phase.count

    def leftmost(self, number: int) -> Found:
        """Return the ``number`` left-most eigenvalues in its units; :class:`ConvergenceError` if there are fewer."""
        own = self.solver
        with self.system.clock("stability"):
            modes = self._solve(number, EXTRA[0]) if len(own.last) else NOTHING
            if not modes.certified:
                self.go_below()
                for extra in EXTRA:
                    modes = self._solve(number, extra)
                    if modes.certified:
                        break
        if len(modes.values) < number:
            raise ConvergenceError(
                f"SLEPc found {len(modes.values)} of the {number} eigenvalues asked for: ask for fewer, or use a "
                "richer discretisation."
            )
        spread = modes.values[-1] - modes.values[0] + LEAST_SPREAD * abs(modes.values).max()
        own.shift = modes.values[0] - 0.1 * spread
        values, vectors = self.system.scene.units.omega2 * modes.values, self.unscaled(modes.vectors)
        return modes._replace(values=values, vectors=vectors)

    def unscaled(self, vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """The same vectors in the rod's units, in place."""
        if not self.system.scene.units.ordinary:
            for vector in vectors:
                vector.pointwiseMult(vector, self.solver.sizes)
        return vectors

    def go_below(self) -> None:
        """Move the shift below the spectrum; raises :class:`ConvergenceError` if it has no lower end."""
        own = self.solver
        step = max(abs(own.shift), own.scale)
        for _ in range(40):
            if self.below(own.shift) == 0 and not self._shift_is_an_eigenvalue():
                return
            own.shift -= step
            step *= 3
        raise ConvergenceError(
            "The spectrum has no lower end: the kinetic metric is too small for the rod's stiffness; give the rod a "
            "larger mass or rotary inertia."
        )

    def _shift_is_an_eigenvalue(self) -> bool:
        """Whether that is so but for round-off, which a count does not tell: a step of inverse iteration does."""
        own, mode = self.solver, self.inertia.seed(0)
        mode.scale(1.0 / self.system.norm(mode))
        grown = mode.duplicate()
        own.shifted.factors.solve(own.scaled[1] * mode, grown)
        return not self.system.norm(grown) * HIT * abs(own.shift) < 1.0

    def below(self, sigma: float) -> int:
        """Number of eigenvalues below ``sigma``; :class:`ConvergenceError` if the count breaks down."""
        own = self.solver
        own.factor(sigma)
        negative, zero = own.shifted.factors.inertia()
        below = negative - self.inertia.constraints - self._drifts
        if zero or below < 0:
            raise ConvergenceError(
                f"The count of eigenvalues below {sigma:.6g} broke down ({zero} zero pivots, {negative} negative ones "
                f"for {self.inertia.constraints} constraints): the constraints depend on each other."
            )
        return int(below)

    def certifies(self, values: np.ndarray) -> bool:
        """Whether counts find none below the least of ``values``, and as many as there are below the greatest."""
        small = SAME_EIGENVALUE * max(abs(values).max(), self.solver.scale)
        distinct = values < values[-1] - small
        return (
            self.below(values[0] - small) == 0
            and self.below(values[-1] - small) == distinct.sum()
            and self.below(values[-1] + small) >= len(values)
        )

    def _solve(self, number: int, extra: int) -> Found:
        """Solve for ``number`` values and some more, and count whether any is missing among the first ``number``.

        A Krylov method finds the second of two equal eigenvalues late, by round-off.
        """
        own = self.solver
        own.factor(own.shift)
        if not own.shifted.factors.regular:
            own.shift -= own.scale
            return self._solve(number, extra)
        values, vectors, errors = self._krylov_schur(number, number + extra)
        reach = max(values[-1] - own.shift, own.scale) if len(values) else np.inf
        if len(values) and values[0] - own.shift < HIT * reach:
            own.shift -= reach
            return self._solve(number, extra)
        if len(values) < number:
            return Found(values, vectors, errors)
        own.last = sum(vector.array_r for vector in vectors)
        cut = values[number - 1] + SAME_EIGENVALUE * max(abs(values[number - 1]), own.scale)
        known = int((values < cut).sum())
        return Found(values[:number], vectors[:number], errors[:number], self.below(cut) == known)

    def _krylov_schur(self, least: int, number: int) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray]:
        """``number`` eigenvalues or all there are, with vectors and backward errors, without what is no eigenpair.

        More than there are finite ones break the Krylov space down.
        """
        own, start = self.solver, self.inertia.seed(1)
        if len(own.last):  # a space that is invariant already would miss all else
            start.scale(NOISE / self.system.norm(start))
            start.array[:] += own.last
        solver = self.eigensolver(number, start)
        with slepc_errors():
            solver.solve()
        found = solver.getConverged()
        values = np.array([solver.getEigenvalue(i).real for i in range(found)])
        order = np.argsort(values)[:number]
        values, vectors = values[order], [self.system.new_vector() for _ in order]
        for i, vector in zip(order, vectors, strict=True):
            solver.getEigenvector(int(i), vector)
        solver.destroy()
        if found < least:
            raise ConvergenceError(
                f"SLEPc found {found} of the {least} eigenvalues asked for: ask for fewer, or use a richer "
                "discretisation."
            )
        self._purify(values, vectors)
        errors = self.backward_errors(values, vectors)
        stiffness, mass = self._norms()
        true = [i for i in range(len(values)) if errors[i] * (1 + abs(values[i]) * mass / stiffness) < CONVERGED]
        return values[true], [vectors[i] for i in true], errors[true]

    def eigensolver(self, number: int, start: PETSc.Vec) -> SLEPc.EPS:
        """Set up shift-invert for the ``number`` eigenvalues nearest to the shift that was factored.

        Vectors are right up to massless unknowns: purification corrects all of them at once.
        """
        own = self.solver
        solver = eigensolver(*own.scaled, "rodfem_")
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(own.shift)
        # in a Krylov space with fewer vectors restarts cost more
        solver.setDimensions(number, number + max(number, 6))
        solver.setTolerances(tol=OF_VECTORS, max_it=300)
        solver.setPurify(False)
        solver.setInitialSpace([start])
        if own.deflated:
            solver.setDeflationSpace(own.deflated)
        transform = solver.getST()
        transform.setMatMode(SLEPc.ST.MatMode.SHELL)  # the shifted matrix is never formed
        ksp = transform.getKSP()
        ksp.setType("preonly")
        ksp.getPC().setType("python")
        ksp.getPC().setPythonContext(_Inverse(own.shifted.factors))
        with slepc_errors():
            solver.setFromOptions()
        return solver

    def _norms(self) -> tuple[float, float]:
        stiffness, mass = (matrix.norm(PETSc.NormType.INFINITY) for matrix in self.solver.scaled)
        return stiffness, mass

    def _purify(self, values: np.ndarray, vectors: list[PETSc.Vec]) -> None:
        """Replace vectors by ``(mu - sigma) (S - sigma M)^-1 M x``, without arbitrary massless parts, all at once."""
        own = self.solver
        right = np.stack([(own.scaled[1] * vector).array_r.real for vector in vectors], axis=1)
        for value, vector, column in zip(values, vectors, own.shifted.factors.solve_all(right).T, strict=True):
            vector.array[:] = (value - own.shift) * column

    def backward_errors(self, values: np.ndarray, vectors: list[PETSc.Vec]) -> np.ndarray:
        """Backward errors ``|S x - mu M x| / ((|S| + |mu| |M|) |x|)``."""
        stiffness, mass = self._norms()
        errors, (S, M) = [], self.solver.scaled
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

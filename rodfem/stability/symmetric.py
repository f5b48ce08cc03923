"""Left-most eigenvalues of an equilibrium by ARPACK, on the singular pencil of its saddle matrix.

    (K C; C^t 0) x = mu (M 0; 0 0) x

with ``M`` the kinetic metric: stable where all ``mu = omega^2`` are positive (Kumar & Healey 2010, (21) and (45)).
``M`` is singular, so that only shift-invert is free of spurious eigenvalues: ``(S - sigma M)^-1 M`` is zero on all that
has no inertia.  A symmetry mode, of eigenvalue zero, is excluded by the constraint ``g.Mx = 0``.

The shift is below the spectrum: the nearest eigenvalues to it are the left-most ones.  A count just above the last of
them proves that none is missing, wherever the shift was.  All is in units of natural sizes, but for the modes that are
returned.  Along a branch the shift, the symbolic factorisations and a first vector, the sum of the modes, are those of
the point before: two numeric factorisations a point, one to solve with and one to count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc
from scipy.sparse.linalg import ArpackError, ArpackNoConvergence, LinearOperator, eigsh

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import factors_of
from rodfem.linalg.matrices import gathered, places_in, shared
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
        self.inertia, fields = inertia, self.system.fields
        self.factors = factors_of("cholesky", self.system.comm, fields.chain_size, fields.dense_rows)
        self.scaled, self._shifted, self._factored = (self.matrix, self.mass), self.system.state_matrix(), np.nan
        self.scale = scale_in_units(self.system)
        self.shift, self.factorisations, self.last = -self.scale, 0, np.zeros(0)
        self._places: np.ndarray | None = None
        self._drifts = 0

    def at(self, x: PETSc.Vec) -> SymmetricSolver:
        """Assemble the pencil of the state ``x``; returns this solver."""
        system = self.system
        with system.clock("assembly"):
            modes = symmetry_modes(system, x)
            assemble_pencil(system, x, self.matrix, self.mass)
            exclude_modes(system, modes, self.matrix, self.mass)
            self.scaled = in_units(system, self.matrix, self.mass, self.sizes)
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
                f"ARPACK found {len(modes.values)} of the {number} eigenvalues asked for: ask for fewer, or use a "
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
        values, vectors, errors = self._lanczos(number, number + extra)
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

    def _lanczos(self, least: int, number: int) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray]:
        """``number`` eigenvalues or all there are, with vectors and backward errors, without what is no eigenpair."""
        system, own, mass = self.system, slice(*self.matrix.getOwnershipRange()), gathered(self.scaled[1])
        start, size = self.inertia.seed(1), mass.shape[0]
        if len(self.last):
            start.scale(1e-6 / system.norm(start))  # a space that is invariant already would miss all else
            start.array[:] += self.last

        def solved(b: np.ndarray) -> np.ndarray:
            return system.whole(self.factors.solve_all(b[own].reshape(-1, 1))[:, 0])

        inverse, number = LinearOperator(mass.shape, solved, dtype=float), min(number, size - 1)
        tolerance = 1e-9  # of vectors: the error of the eigenvalues is the square
        given = {
            "v0": system.whole(start.array_r),
            "ncv": min(number + max(number, 6), size),
            "tol": tolerance,
            "maxiter": 300,
        }
        try:
            values, vectors = eigsh(inverse, number, mass, self.shift, OPinv=inverse, **given)
        except ArpackNoConvergence as trouble:
            values, vectors = trouble.eigenvalues, trouble.eigenvectors
        except (ArpackError, ValueError) as trouble:
            raise ConvergenceError(
                f"ARPACK found no eigenvalues ({trouble}): use a richer discretisation."
            ) from trouble
        if len(values) < least:
            raise ConvergenceError(
                f"ARPACK found {len(values)} of the {least} eigenvalues asked for: ask for fewer, or use a richer "
                "discretisation."
            )
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
        # purified: (mu - sigma) (S - sigma M)^-1 M x has no arbitrary massless parts
        found = system.vectors(self.factors.solve_all((mass @ vectors)[own]) * (values - self.shift))
        errors = self.backward_errors(values, found)
        stiffness, weight = self._norms()
        true = [i for i in range(len(values)) if errors[i] * (1 + abs(values[i]) * weight / stiffness) < CONVERGED]
        return values[true], [found[i] for i in true], errors[true]

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

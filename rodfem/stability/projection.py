r"""The pencil projected onto the null space of the constraints: matrix-vector products and shifted inverses.

Shift-invert and Cayley transforms need the inverse of the shifted matrix ``Q2^t A Q2``, ``A = K - sigma M``.  It is a
block of the inverse of a sparse saddle point matrix:

    ( A    C ) ( x )   ( Q2 b )
    ( C^t  0 ) ( y ) = (  0   ),        (Q2^t A Q2)^-1 b = Q2^t x:

the second row puts x in the kernel, Q2^t times the first is Q2^t A Q2 z = b (``inverse="saddle"``).  It holds whenever
C has full rank and sigma is no eigenvalue, also where A itself is singular.  Elimination of x (Kumar & Healey 2010,
(32)),

    (Q2^t A Q2)^-1 = Q2^t [A^-1 - A^-1 C (C^t A^-1 C)^-1 C^t A^-1] Q2        (``inverse="elimination"``),

factors A alone and needs p solves and a dense p x p matrix more: for a few integral constraints.  It fails where A is
singular although the reduced matrix is not.  So it is in the pointwise formulation without mass (``rho_A = 0``) or with
sigma = 0, where A has no entry for the centreline at all, and where sigma is an eigenvalue of the unconstrained pencil.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError, InputError
from rodfem.linalg.matrices import gathered, petsc_matrix
from rodfem.linalg.null_space import kernel
from rodfem.linalg.selection import factors_of
from rodfem.stability.blocks import Pencil
from rodfem.stability.inertia import inertia_factors

INVERSES = ("saddle", "elimination")
SINGULAR = 1e-6
"""Relative residual of a solve above which its matrix counts as singular."""
RANK, MASSLESS = 1e-10, 1e-20
"""Squared-norm thresholds below which a unit vector counts as linearly dependent on others, and as massless."""

PREFIX = "rodfem_reduced_inverse_"
"""Prefix of the options of its factors."""


class Projection:
    """Blocks ``K``, ``C``, ``M`` of all ranks (scipy) and the kernel of ``C^t``."""

    def __init__(self, pencil: Pencil) -> None:
        """Gather the blocks and factor ``C``; raises :class:`InputError` for dependent constraints."""
        self.K, self.C, self.M = gathered(pencil.K), gathered(pencil.C), gathered(pencil.M)
        self.kernel = kernel(self.C, pencil.place)

    def times(self, matrix: sp.csr_matrix, z: np.ndarray) -> np.ndarray:
        """``Q2^t A Q2 z`` for a matrix ``A`` (m, m)."""
        return self.kernel.project(matrix @ self.kernel.expand(z))

    def saddle(self, sigma: float) -> sp.csr_matrix:
        """``(K - sigma M, C; C^t, 0)``."""
        shifted = self.K - sigma * self.M
        return (sp.bmat([[shifted, self.C], [self.C.T, None]]) if self.C.shape[1] else shifted).tocsr()

    def below(self, sigma: float) -> int:
        """Number of eigenvalues of a symmetric pencil below ``sigma``, by the inertia of the saddle matrix."""
        factors = inertia_factors(MPI.COMM_SELF, 0, 0)
        factors(petsc_matrix(MPI.COMM_SELF, self.saddle(sigma)))
        return factors.inertia()[0] - self.C.shape[1]


class ShiftedInverse:
    """``(Q2^t (K - sigma M) Q2)^-1`` as the python context of a PETSc preconditioner."""

    def __init__(self, projection: Projection, sigma: float, inverse: str = "saddle") -> None:
        """Factor at ``sigma``.

        Raises :class:`InputError` for an unknown formula, :class:`ConvergenceError` where it does not apply.
        """
        if inverse not in INVERSES:
            raise InputError(f"Unknown inverse {inverse!r}: choose one of {', '.join(INVERSES)}.")
        r = self.projection = projection
        self.inverse = inverse
        self.sigma = sigma
        shifted, p = r.K - sigma * r.M, r.C.shape[1]
        if inverse == "saddle":
            full = r.C.nnz > 0.5 * r.C.shape[0] * p  # integral constraints
            self.solve = factored(r.saddle(sigma), p if full else 0)
            return
        singular = ConvergenceError(
            f"K - sigma M is singular at sigma = {sigma:g} without the constraints: use the inverse 'saddle'."
        )
        try:
            self.solve = factored(shifted)
        except ConvergenceError:
            raise singular from None
        self.border = np.zeros((r.C.shape[0], 0))
        if p:
            columns = r.C.toarray()
            self.border = np.stack([self.solve(column) for column in columns.T], axis=1)
            left = abs(shifted @ self.border - columns).max() / abs(columns).max()
            if not left < SINGULAR:
                raise singular
            self.capacitance = scipy.linalg.lu_factor(columns.T @ self.border)

    def apply(self, pc: PETSc.PC, b: PETSc.Vec, z: PETSc.Vec) -> None:
        """``z = (Q2^t (K - sigma M) Q2)^-1 b``."""
        z.array[:] = self(b.array_r)

    def ritz(self, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues in ascending order and vectors, orthonormal in M, in the span of vectors (m, k), no more than k.

        By the Rayleigh-Ritz method with the inverse, ``mu = sigma + x.Mx / x.M A^-1 Mx``: as precise as shift-invert
        near sigma, where ``x.Kx / x.Mx`` would suffer from the size of K, and the same for all transforms (SLEPc gives
        wrong values for complex pairs under Cayley's).  Massless unknowns are left out.
        """
        r = self.projection
        squares = (vectors * (r.M @ vectors)).sum(axis=0)
        heavy = squares > MASSLESS * abs(r.M).max() * (vectors**2).sum(axis=0)
        vectors = vectors[:, heavy] / np.sqrt(squares[heavy])
        masses = r.M @ vectors
        solved = np.stack([r.kernel.expand(self(r.kernel.project(mass))) for mass in masses.T], axis=1)
        squares, turn = np.linalg.eigh((vectors.T @ masses + masses.T @ vectors) / 2)
        kept = squares > RANK * squares.max(initial=0.0)
        turn = turn[:, kept] / np.sqrt(squares[kept])
        compliance = turn.T @ (masses.T @ solved) @ turn
        inverse, inner = np.linalg.eigh((compliance + compliance.T) / 2)
        values, turn = self.sigma + 1.0 / inverse, turn @ inner
        order = np.argsort(values)
        return values[order], vectors @ turn[:, order]

    def __call__(self, b: np.ndarray) -> np.ndarray:
        """Solution for the right-hand side ``b`` (m - p,)."""
        r = self.projection
        x = r.kernel.expand(b)
        if self.inverse == "saddle":
            x = self.solve(np.append(x, np.zeros(r.C.shape[1])))[: len(x)]
        else:
            x = self.solve(x)
            if r.C.shape[1]:
                x = x - self.border @ scipy.linalg.lu_solve(self.capacitance, r.C.T @ x)
        return r.kernel.project(x)


def factored(matrix: sp.spmatrix, dense: int = 0) -> Callable[[np.ndarray], np.ndarray]:
    """Solver with the LU factors of a matrix, the last rows of which may be ``dense``.

    Raises :class:`ConvergenceError` where there are none.
    """
    petsc = petsc_matrix(MPI.COMM_SELF, matrix)
    factors = factors_of("lu", MPI.COMM_SELF, 0, dense, {}, prefix=PREFIX)
    factors(petsc)
    if not factors.regular:
        raise ConvergenceError("The shifted matrix is singular: change the shift.")
    right, out = petsc.createVecs()

    def solve(b: np.ndarray) -> np.ndarray:
        right.array[:] = b
        factors.solve(right, out)
        return out.array_r.copy()

    return solve

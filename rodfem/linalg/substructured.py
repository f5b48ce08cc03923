r"""Factors of a bordered matrix on several ranks: static condensation onto the cuts of the chain.

A rod is a chain, cut where the subdomain of one rank meets that of the next.  Let ``u`` be the interface unknowns
(those at the cuts and all scalars) and ``x_r`` the inner unknowns of rank r, which do not couple to those of another
rank:

    A_r x_r + B_r u = b_r,        sum_r C_r x_r + G u = c.

The Schur complement of ``A_r`` requires ``A_r`` to be regular, and it need not be where the whole matrix is: a piece
between two clamps buckles at loads of its own.  Instead each piece is braced at its ends by artificial springs ``T_r``,
any diagonal matrix that makes it regular, and interface forces ``l_r`` act on it there:

    P_r (x_r; u_r) = (b_r; l_r),        P_r = (A_r B_r; C_r T_r).

With ``y_r = P_r^-1 (b_r; 0)``, the columns ``Z_r = P_r^-1 (0; 1)``, and their part ``X_r`` at the interface unknowns,
compatibility ``u_r = u`` and the balance of the interface forces are the small dense system

    D (l; u) = (y at the interface unknowns; c),        D = (-X 1; 1 G - sum_r T_r),

the same on all ranks, and ``x_r`` is the rest of ``y_r + Z_r l_r``.

*Inertia.*  For a symmetric matrix give each piece unknowns ``u_r`` of its own, m_r of them, and tie them to ``u`` by as
many multipliers ``-l_r``.  Elimination of ``u_r`` and ``l_r`` leaves the matrix itself, and takes m_r positive and m_r
negative eigenvalues away; elimination of the pieces leaves D, up to the sign of ``l``.  Inertia adds over eliminations
(Haynsworth, Linear Algebra Appl. 1 (1968) 73-81), so that

    negative(A) = sum_r [negative(P_r) - m_r] + negative(D).

The artificial springs cancel exactly: their contribution to each subdomain is subtracted in the interface matrix D.
Their stiffness is a multiple of the diagonal of the whole matrix, which at a cut nearly clamps the piece.
Multipliers, scalars, and a centreline without weight have no diagonal: there it is minus the sum of magnitudes of the
column, because a piece that is nearly singular with weak springs loses digits.  A piece so braced is singular by
coincidence only, which is detected: ``|T|^1/2 X |T|^1/2`` is large, or a pivot zero.  Then the piece is braced by other
springs.  A piece that is singular with all of them has a null vector that vanishes at the interface, and so has the
whole matrix.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Block, LocalFactors, Spread
from rodfem.linalg.subdomain import Subdomain

GROWTH = 100.0
"""Largest compliance of a braced piece, relative to that of its springs; the excess over one is lost in digits."""
SOFT = 1e-3
"""Relative to the sum of its column, a diagonal entry below this is no spring: it may be a shifted zero."""
NOTHING = 1e-12
"""A column whose sum is less than this, relative to the diagonals of others, is round-off."""
SPRINGS = (3.0, 1.0, -2.0, 0.3, 10.0, -0.5)
"""Multiples of the diagonal used as springs, in the order of the attempts.

The first exceeds one: the Schur complement of a piece of a positive matrix is at most the diagonal, and equals it where
an unknown couples to this piece alone.
"""


class SubstructuredFactors(Spread):
    """Factors on several ranks: of each rank's piece, along the rod or by MUMPS, and of the interface matrix on all.

    :class:`~rodfem.linalg.factorization.Factors` of matrices whose pattern is symmetric and stays.
    """

    def __init__(self, scalars: int, factors: LocalFactors) -> None:
        """Keep the factors for this rank's piece; the last ``scalars`` unknowns are shared."""
        self.factors, self.scalars = factors, scalars
        self.symmetric = factors.kind == "cholesky"
        self.regular = False
        self._matrix: PETSc.Mat | None = None

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises :class:`ConvergenceError` on all ranks where one gives up."""
        if self._matrix is None or matrix.handle != self._matrix.handle:
            self._matrix = matrix
            self.piece = Subdomain(matrix, self.scalars, symmetric=self.symmetric)
            self.touched = self.piece.comm.allgather(self.piece.touched)
            self._block = Block(self.factors, self.piece.matrix.size[0])
            if isinstance(self.factors, Chain):
                self.factors.border = len(self.piece.touched)
        piece = self.piece
        corner = piece.update(matrix)
        trouble = ""
        springs = compliance = np.zeros(0)
        try:
            springs, compliance = self._factor_piece(np.diag(corner)[piece.touched])
        except ConvergenceError as error:
            trouble = str(error)
        negative, determinant = 0, 0.0
        if self.symmetric and piece.size and not trouble:
            negative, determinant = self.factors.inertia()[0], self.factors.determinant()
        elif not trouble:
            determinant = float(np.log(abs(springs)).sum())
        # one message: an error is raised on all ranks, and D is made of the compliances and springs of all of them
        parts = piece.comm.allgather((trouble, negative, springs, compliance, determinant))
        if any(part[0] for part in parts):
            raise ConvergenceError(next(part[0] for part in parts if part[0]))
        # Haynsworth: negative(A) = sum_r [negative(P_r) - m_r] + negative(D), the last added where D is factored
        self._negative, self._zero = sum(part[1] - len(part[2]) for part in parts), 1
        self._determinant = sum(part[4] for part in parts)
        self.regular = all(np.isfinite(part).all() for part in (corner, *(part[3] for part in parts)))
        if self.regular:
            self._join(corner, [part[2] for part in parts], [part[3] for part in parts])

    def _factor_piece(self, diagonal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Factor this rank's piece; springs (m,) and compliance ``X`` (m, m), nan where it is singular with any."""
        piece, m = self.piece, len(diagonal)
        sizes, stiffness = piece.border()
        # a zero diagonal (multiplier, scalar) gives no spring: minus the sum of magnitudes of its column does
        usual = np.where(sizes > NOTHING * stiffness, -sizes, 1.0)
        usual = np.where(abs(diagonal) > SOFT * sizes, diagonal, usual)
        self._columns = np.zeros((piece.size + m, m), dtype=PETSc.ScalarType)
        if not piece.size:
            return usual, np.diag(1.0 / usual)
        coupled = np.flatnonzero(sizes > 0)
        for factor in SPRINGS:
            springs = usual * factor
            piece.brace(springs)
            self.factors(piece.matrix)
            if not self.factors.regular or (self.symmetric and self.factors.inertia()[1]):
                continue
            if len(coupled):
                self._columns[:, coupled] = self._block.columns(piece.size + coupled)
            for i in np.flatnonzero(sizes == 0):
                self._columns[piece.size + i, i] = 1.0 / springs[i]
            compliance = self._columns[piece.size :]
            if self.symmetric:
                compliance = (compliance + compliance.T) / 2
            # |T|^1/2 X |T|^1/2 is of size one where the springs carry the piece, large where it is nearly singular
            scale = np.sqrt(abs(springs))
            if abs(compliance * np.outer(scale, scale)).max(initial=0.0) < GROWTH:
                return springs, compliance
        return usual, np.full((m, m), np.nan)

    def _join(self, corner: np.ndarray, springs: list[np.ndarray], compliances: list[np.ndarray]) -> None:
        """Factor the interface matrix ``D``, scaled."""
        forces = sum(len(part) for part in springs)
        held = np.concatenate(self.touched)
        # D = (-X 1; 1 G - sum T): the artificial springs are taken away again
        joint = scipy.linalg.block_diag(*[-part for part in compliances], corner)
        every = np.concatenate(springs)
        joint[np.arange(forces), forces + held] = joint[forces + held, np.arange(forces)] = 1.0
        np.subtract.at(joint, (forces + held, forces + held), every)
        self._scale = equilibrate(joint)
        joint *= np.outer(self._scale, self._scale)
        start = sum(len(part) for part in self.touched[: self.piece.comm.rank])
        self._forces, self._number = np.arange(start, start + len(self.piece.touched)), forces
        factor, self._back = scipy.linalg.get_lapack_funcs(("getrf", "getrs"), (joint,))
        self._lu, self._pivots, zero_pivot = factor(joint)
        self.regular = zero_pivot == 0
        if self.symmetric:
            values = np.linalg.eigvalsh(joint)
            self._negative += int((values < 0).sum())
            with np.errstate(divide="ignore"):
                self._determinant += float(np.log(abs(values)).sum() - 2 * np.log(self._scale).sum())
            self._zero = int((values == 0).sum())
            self.regular = self._zero == 0

    def spread(self, right: np.ndarray) -> np.ndarray:
        """Solve for the columns of the rows of this rank."""
        piece, k = self.piece, right.shape[1]
        local = np.zeros((piece.size + len(piece.touched), k), dtype=PETSc.ScalarType)
        if piece.size:
            local[: piece.size] = right[piece.inner]
            local = self._block.solve(local)
        # right-hand side of D: compatibility (y at the interface), then balance (c); each rank has its own part of it
        shared = np.zeros((len(self._scale), k), dtype=PETSc.ScalarType)
        shared[self._forces] = local[piece.size :]
        shared[self._number + piece.held] = right[piece.own]
        piece.comm.Allreduce(MPI.IN_PLACE, shared)
        solved = self._back(self._lu, self._pivots, self._scale[:, None] * shared)[0] * self._scale[:, None]
        out = np.empty(right.shape, dtype=PETSc.ScalarType)
        # back substitution: x_r = y_r + Z_r l_r
        out[piece.inner] = local[: piece.size] + self._columns[: piece.size] @ solved[self._forces]
        out[piece.own] = solved[self._number + piece.held]
        return out

    def inertia(self) -> tuple[int, int]:
        """Number of negative eigenvalues of the symmetric matrix last factored, and of pivots that are zero."""
        return self._negative, self._zero

    def determinant(self) -> float:
        """Logarithm of the size of the determinant of the symmetric matrix last factored: it multiplies, too."""
        return self._determinant


def equilibrate(matrix: np.ndarray, most: int = 30) -> np.ndarray:
    """Scale of rows and columns, the same for both, with which the largest entries of all are near one (Ruiz 2001)."""
    sizes = np.maximum(abs(matrix), abs(matrix.T))
    scale = np.ones(len(matrix))
    for _ in range(most):
        largest = (sizes * np.outer(scale, scale)).max(axis=0, initial=0.0)
        if np.all((largest == 0) | (abs(largest - 1) < 0.5)):
            break
        scale /= np.sqrt(np.where(largest > 0, largest, 1.0))
    return scale

"""Factors of a matrix on several ranks that is small enough for each of them to factor all of it.

The ranks send each other their rows once a factorisation, and right-hand sides once a solution: two messages, where a
parallel factorisation exchanges some for every front, each longer under way than the front's arithmetic takes.
"""

from __future__ import annotations

from math import inf

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.linalg.factorization import Block, LocalFactors, Spread


class Copy:
    """All of a distributed matrix whose pattern stays, on every rank.

    Attributes
    ----------
    matrix
        The copy (PETSc, on this rank alone).
    own
        Rows of it that are this rank's.
    """

    def __init__(self, matrix: PETSc.Mat) -> None:
        """Gather pattern and values of ``matrix``; collective."""
        self.comm = matrix.comm.tompi4py()
        starts, columns, values = matrix.getValuesCSR()
        lengths, columns = zip(*self.comm.allgather((np.diff(starts), columns)), strict=True)
        self.rows = [len(part) for part in lengths]
        self._counts = [len(part) for part in columns]
        begin = sum(self.rows[: self.comm.rank])
        self.own = slice(begin, begin + self.rows[self.comm.rank])
        starts = np.concatenate([[0], np.cumsum(np.concatenate(lengths))])
        size = (len(starts) - 1, matrix.size[1])
        table = sp.csr_matrix((np.arange(starts[-1]), np.concatenate(columns), starts), shape=size)
        table.sort_indices()
        self._source, self._received = table.data, np.empty(starts[-1], dtype=values.dtype)
        self._values = np.empty_like(self._received)
        index = [part.astype(PETSc.IntType) for part in (table.indptr, table.indices)]
        self.matrix = PETSc.Mat().createAIJWithArrays(size, (*index, self._values), comm=PETSc.COMM_SELF)
        self.update(matrix)

    def update(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """Copy the values of ``matrix``, whose pattern is the same; returns the copy."""
        self.comm.Allgatherv(matrix.getValuesCSR()[2], [self._received, self._counts])
        np.take(self._received, self._source, out=self._values)
        self.matrix.stateIncrease()
        return self.matrix

    def columns(self, own: np.ndarray) -> np.ndarray:
        """All rows (n, k) of columns of which this rank has its ``own`` (m, k)."""
        whole = np.empty((sum(self.rows), own.shape[1]), dtype=own.dtype)
        counts = [rows * own.shape[1] for rows in self.rows]
        self.comm.Allgatherv(np.ascontiguousarray(own), [whole, counts])
        return whole


class Copied(Spread):
    """Factors of the whole matrix on every rank.

    :class:`~rodfem.linalg.factorization.Factors` of matrices whose pattern stays.  What is decided by round-off is the
    same on all ranks, also where their processors are not: the count is rank 0's.
    """

    def __init__(self, factors: LocalFactors) -> None:
        """Keep what factors on this rank."""
        self.factors, self.symmetric = factors, factors.kind == "cholesky"
        self.regular = False
        self._matrix: PETSc.Mat | None = None
        self._inertia, self._determinant = (0, 0), -inf

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises :class:`ConvergenceError` on all ranks where one gives up."""
        if self._matrix is None or matrix.handle != self._matrix.handle:
            self._matrix, self.copy = matrix, Copy(matrix)
            self._block = Block(self.factors, matrix.size[0])
        else:
            self.copy.update(matrix)
        trouble, inertia, determinant = "", (0, 1), -inf
        try:
            self.factors(self.copy.matrix)
            if self.symmetric and self.factors.regular:
                inertia, determinant = self.factors.inertia(), self.factors.determinant()
        except ConvergenceError as error:
            trouble = str(error)
        troubles, regular, inertias, determinants = zip(
            *self.copy.comm.allgather((trouble, self.factors.regular, inertia, determinant)), strict=True
        )
        if any(troubles):
            raise ConvergenceError(next(filter(None, troubles)))
        self.regular, self._inertia, self._determinant = all(regular), inertias[0], determinants[0]

    def spread(self, right: np.ndarray) -> np.ndarray:
        """Solve for the columns of the rows of this rank."""
        return self._block.solve(self.copy.columns(right))[self.copy.own]

    def inertia(self) -> tuple[int, int]:
        """Number of negative eigenvalues of the symmetric matrix last factored, and of pivots that are zero."""
        return self._inertia

    def determinant(self) -> float:
        """Logarithm of the size of the determinant of the symmetric matrix last factored."""
        return self._determinant

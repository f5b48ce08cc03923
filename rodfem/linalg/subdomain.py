"""Subdomains of a distributed bordered matrix: the inner unknowns of one rank, and the interface unknowns."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.linalg.matrices import first_of


class Subdomain:
    """Rows and columns of this rank's inner unknowns, and of the interface unknowns that couple to them.

    Interface (shared) unknowns are the last ``scalars`` ones and, for each pair of coupled ranks, the boundary
    unknowns of the rank that has fewer of them.  The pattern of the matrix is symmetric.

    Attributes
    ----------
    shared
        Global numbers of all interface unknowns in ascending order, the same on all ranks.
    own, inner
        Interface rows and inner rows of this rank, counted from its first row.
    held
        Places in ``shared`` of the rows of ``own``.
    touched
        Places in ``shared`` of the unknowns coupled to this rank's inner ones; they are the last of the piece.
    matrix
        The piece (PETSc, on this rank alone); its block of interface unknowns is diagonal.  A symmetric piece stores
        the upper triangle.
    """

    def __init__(self, matrix: PETSc.Mat, scalars: int, *, symmetric: bool) -> None:
        """Find the interface in the pattern of ``matrix``; collective."""
        self.symmetric = symmetric
        self.comm = comm = matrix.comm.tompi4py()
        rank, ranges = comm.rank, np.array(matrix.getOwnershipRanges())
        begin, end = ranges[rank], ranges[rank + 1]
        starts, columns, _ = matrix.getValuesCSR()
        rows = np.repeat(np.arange(begin, end), np.diff(starts))
        first = ranges[-1] - scalars
        own = np.append(self._cut(rows, columns, ranges, first), np.arange(max(begin, first), end)).astype(int)
        self.shared = np.concatenate(comm.allgather(own))
        offset = first_of(comm, len(own))
        self.held = np.arange(offset, offset + len(own))
        kept = np.ones(end - begin, dtype=bool)
        kept[own - begin] = False
        self.own, self.inner = own - begin, np.flatnonzero(kept)
        self.size = len(self.inner)

        number = np.full(ranges[-1], -1, dtype=np.int32)  # of an unknown among those that are shared
        number[self.shared] = np.arange(len(self.shared))
        right, mine = number[columns] >= 0, kept[rows - begin]
        self.touched = np.unique(number[columns[mine & right]])
        place = np.full(ranges[-1], -1, dtype=np.int32)  # of an unknown in the piece
        place[begin + self.inner] = np.arange(self.size)
        place[self.shared[self.touched]] = self.size + np.arange(len(self.touched))

        i, j = place[rows[mine]], place[columns[mine]]
        pool = [np.flatnonzero(mine)]
        corner = np.flatnonzero(~mine & right)
        self._corner = corner, number[rows[corner]], number[columns[corner]]
        self._sent, self._counts = np.array([], dtype=int), ([0], [0])
        # C_r is the transpose of B_r in a symmetric matrix; else its rows are on the ranks that own the interface
        if not symmetric:
            self._sent, row, column = self._exchange(rows, columns, np.flatnonzero(~mine & ~right), ranges)
            i, j = np.append(i, place[row]), np.append(j, place[column])
            pool.append(len(columns) + np.arange(len(row)))
        diagonal = self.size + np.arange(len(self.touched))
        pool.append(len(columns) + len(i) - len(pool[0]) + np.arange(len(diagonal)))
        size = self.size + len(diagonal)
        entries = np.concatenate(pool), (np.append(i, diagonal), np.append(j, diagonal))
        table = sp.csr_matrix(entries, shape=(size, size))
        table.sort_indices()
        row = np.repeat(np.arange(size), np.diff(table.indptr))
        on = row == table.indices
        self._source = table.data
        self._diagonal, self._springs = np.flatnonzero(on & (row < self.size)), np.flatnonzero(on & (row >= self.size))
        outside = np.maximum(row, table.indices)
        self._border = np.flatnonzero((outside >= self.size) & ~on)
        self._border_of = outside[self._border] - self.size
        self.values = np.zeros(table.nnz, dtype=PETSc.ScalarType)
        index = [part.astype(PETSc.IntType) for part in (table.indptr, table.indices)]
        self.matrix = PETSc.Mat().createAIJWithArrays((size, size), (*index, self.values), comm=PETSc.COMM_SELF)

    def _cut(self, rows: np.ndarray, columns: np.ndarray, ranges: np.ndarray, first: int) -> np.ndarray:
        """Global numbers of this rank's unknowns on the interface with other ranks, scalars not included."""
        rank, size = self.comm.rank, self.comm.size
        between = ((columns < ranges[rank]) | (columns >= ranges[rank + 1])) & (columns < first) & (rows < first)
        row, owner = rows[between], np.searchsorted(ranges, columns[between], side="right") - 1
        facing = [np.unique(row[owner == r]) for r in range(size)]
        # of two coupled ranks the one with fewer boundary unknowns gives them to the interface, at a tie the lower rank
        counts = np.array(self.comm.allgather([len(found) for found in facing]))
        given = [facing[r] for r in range(size) if (counts[rank, r], rank) < (counts[r, rank], r)]
        return np.unique(np.concatenate([*given, np.array([], dtype=int)]))

    def _exchange(
        self, rows: np.ndarray, columns: np.ndarray, entries: np.ndarray, ranges: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Prepare to send entries of shared rows to the ranks of their columns.

        Returns their places among this rank's, in the order in which they are sent, and the rows and columns received.
        """
        owner = np.searchsorted(ranges, columns[entries], side="right") - 1
        order = np.argsort(owner, kind="stable")
        entries, owner = entries[order], owner[order]
        parts = [entries[owner == r] for r in range(self.comm.size)]
        got = self.comm.alltoall([(rows[part], columns[part]) for part in parts])
        self._counts = [len(part) for part in parts], [len(row) for row, _ in got]
        row, column = (np.concatenate(part) for part in zip(*got, strict=True))
        return entries, row, column

    def update(self, matrix: PETSc.Mat) -> np.ndarray:
        """Copy the values of ``matrix``, without the springs; returns its block of interface unknowns, on all ranks."""
        values = matrix.getValuesCSR()[2]
        if not self.symmetric:
            received = np.empty(sum(self._counts[1]), dtype=values.dtype)
            self.comm.Alltoallv([values[self._sent], self._counts[0]], [received, self._counts[1]])
            values = np.append(values, received)
        np.take(values, self._source, out=self.values, mode="clip")  # springs, beyond the end, are set later
        corner = np.zeros((len(self.shared), len(self.shared)), dtype=values.dtype)
        entries, row, column = self._corner
        corner[row, column] = values[entries]
        self.comm.Allreduce(MPI.IN_PLACE, corner)
        return corner

    def border(self) -> tuple[np.ndarray, float]:
        """Sums of magnitudes of the columns of touched unknowns, and the median magnitude of the inner diagonal."""
        sizes = np.bincount(self._border_of, abs(self.values[self._border]), minlength=len(self.touched))
        diagonal = abs(self.values[self._diagonal])
        diagonal = diagonal[diagonal > 0]
        return sizes, float(np.median(diagonal)) if len(diagonal) else 1.0

    def brace(self, springs: np.ndarray) -> None:
        """Set the diagonal of the touched unknowns."""
        self.values[self._springs] = springs
        self.matrix.stateIncrease()

"""The piece of a distributed bordered matrix that one rank eliminates."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.linalg.matrices import Entries


class Piece:
    """Inner unknowns of one rank with all their couplings, and the rows of the interface that it owns.

    Inner unknowns couple to none of another rank.  The interface, which all ranks share, are the last ``scalars``
    unknowns and, for each pair of coupled ranks, the boundary unknowns of the rank that has fewer of them.  The pattern
    of the matrix is symmetric.  Of a symmetric piece rows of the interface have entries in its columns only.

    Attributes
    ----------
    starts, columns
        Pattern of the piece: unknowns of its rank, then others of the interface.
    border, places
        Unknowns of the interface that this piece has, and their places on the interface, in ascending order.
    shared
        Number of unknowns on the interface.
    """

    def __init__(self, matrix: PETSc.Mat, scalars: int, *, symmetric: bool) -> None:
        """Find the interface in the pattern of ``matrix``; collective."""
        self.comm, self._entries = matrix.comm.tompi4py(), Entries(matrix)
        self._ranges = np.array(matrix.getOwnershipRanges())
        begin, end = matrix.getOwnershipRange()
        rows, columns = np.repeat(np.arange(begin, end), np.diff(self._entries.starts)), self._entries.columns
        first = self._ranges[-1] - scalars
        own = np.append(self._cut(rows, columns, first), np.arange(max(begin, first), end)).astype(int)
        interface = np.concatenate(self.comm.allgather(own))
        number = np.full(self._ranges[-1], -1)  # places on the interface
        number[interface] = np.arange(len(interface))
        outer_row, outer_column = number[rows] >= 0, number[columns] >= 0

        kept = np.flatnonzero(~outer_row | outer_column)
        i, j, source = rows[kept], columns[kept], self._entries.stored[kept]
        self._sent: np.ndarray | None = None
        if not symmetric:
            row, column = self._exchange(rows, columns, np.flatnonzero(outer_row & ~outer_column))
            i, j = np.append(i, row), np.append(j, column)
            source = np.append(source, len(columns) + np.arange(len(row)))
        self.shared, found = len(interface), number[np.concatenate([own, i, j])]
        self.places = np.unique(found[found >= 0])
        unknowns = interface[self.places]
        others = unknowns[(unknowns < begin) | (unknowns >= end)]
        local = np.full(self._ranges[-1], -1)
        local[begin:end] = np.arange(end - begin)
        local[others] = end - begin + np.arange(len(others))
        self.border = local[unknowns]
        size = end - begin + len(others)
        table = sp.csr_matrix((source, (local[i], local[j])), shape=(size, size))
        table.sort_indices()
        self.starts, self.columns, self._source = table.indptr, table.indices, table.data
        # entries that come from other ranks, and their places among those received
        self._late = np.flatnonzero(self._source >= len(columns))
        self._order = self._source[self._late] - len(columns)
        self._values = np.zeros(table.nnz, dtype=PETSc.ScalarType)

    def _cut(self, rows: np.ndarray, columns: np.ndarray, first: int) -> np.ndarray:
        """Global numbers of this rank's unknowns on the interface with other ranks, scalars not included."""
        rank, size, ranges = self.comm.rank, self.comm.size, self._ranges
        between = ((columns < ranges[rank]) | (columns >= ranges[rank + 1])) & (columns < first) & (rows < first)
        row, owner = rows[between], self._owner(columns[between])
        facing = [np.unique(row[owner == r]) for r in range(size)]
        # of two coupled ranks the one with fewer boundary unknowns gives them to the interface, at a tie the lower rank
        counts = np.array(self.comm.allgather([len(found) for found in facing]))
        given = [facing[r] for r in range(size) if (counts[rank, r], rank) < (counts[r, rank], r)]
        return np.unique(np.concatenate([*given, np.array([], dtype=int)]))

    def _owner(self, numbers: np.ndarray) -> np.ndarray:
        return np.searchsorted(self._ranges, numbers, side="right") - 1

    def _exchange(self, rows: np.ndarray, columns: np.ndarray, entries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Prepare to send ``entries`` of rows of the interface to the ranks of their columns, this one included.

        Returns the rows and columns of those that this rank receives.
        """
        owner = self._owner(columns[entries])
        parts = [entries[owner == r] for r in range(self.comm.size)]
        got = self.comm.alltoall([(rows[part], columns[part]) for part in parts])
        self._sent = self._entries.stored[np.concatenate(parts)]
        self._counts = [len(part) for part in parts], [len(row) for row, _ in got]
        row, column = (np.concatenate(part) for part in zip(*got, strict=True))
        return row, column

    def values(self) -> np.ndarray:
        """Values of the piece's entries now; collective."""
        stored = self._entries.values()
        np.take(stored, self._source, out=self._values, mode="clip")  # those that come later are beyond the end
        if self._sent is not None:
            received = np.empty(sum(self._counts[1]), dtype=stored.dtype)
            self.comm.Alltoallv([stored[self._sent], self._counts[0]], [received, self._counts[1]])
            self._values[self._late] = received[self._order]
        return self._values

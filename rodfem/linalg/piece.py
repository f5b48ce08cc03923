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
    starts, columns, places
        Pattern of the piece: unknowns of its rank, then others of the interface; places of its entries in the values.
    border, interface
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

        kept, below = np.flatnonzero(~outer_row | outer_column), np.flatnonzero(outer_row & ~outer_column)
        self._exchanged, stored = not symmetric, self._entries.number
        row, column = self._exchange(rows, columns, below) if self._exchanged else (below[:0], below[:0])
        i, j = np.append(rows[kept], row), np.append(columns[kept], column)
        places = np.append(self._entries.places[kept], stored + np.arange(len(row)))
        self._values = np.empty(stored + len(row), dtype=PETSc.ScalarType)
        self.shared, found = len(interface), number[np.concatenate([own, i, j])]
        self.interface = np.unique(found[found >= 0])
        unknowns = interface[self.interface]
        others = unknowns[(unknowns < begin) | (unknowns >= end)]
        self._own, self._others = own - begin, number[others]
        local = np.full(self._ranges[-1], -1)
        local[begin:end] = np.arange(end - begin)
        local[others] = end - begin + np.arange(len(others))
        self.border = local[unknowns]
        size = end - begin + len(others)
        table = sp.csr_matrix((places, (local[i], local[j])), shape=(size, size))
        table.sort_indices()
        self.starts, self.columns, self.places = table.indptr, table.indices, table.data

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
        self._sent = self._entries.places[np.concatenate(parts)]
        self._counts = [len(part) for part in parts], [len(row) for row, _ in got]
        row, column = (np.concatenate(part) for part in zip(*got, strict=True))
        return row, column

    def sizes(self, own: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sizes of the unknowns of this piece, and of those of the interface; collective.

        ``own`` (n,) are those of the unknowns of this rank.
        """
        shared = np.concatenate(self.comm.allgather(own[self._own]))
        return np.append(own, shared[self._others]), shared

    def values(self) -> np.ndarray:
        """Values now: those of this rank's rows, then those received; collective."""
        values, stored = self._values, self._entries.number
        np.concatenate(self._entries.values(), out=values[:stored])
        if self._exchanged:
            self.comm.Alltoallv([values[self._sent], self._counts[0]], [values[stored:], self._counts[1]])
        return values

"""Assembly on several ranks: element tensors by compiled code on each, and one exchange of rows that others own.

A cell at a cut has unknowns of the next rank, and all cells have the scalars, which are the last rank's.  Their rows
are assembled where the cell is, and sent: places are known on both sides, so that a message has nothing but values.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fem.assembly import Assembler, Places, matrix_places
from rodfem.linalg.matrices import Entries

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields


class Layout:
    """Rows that this rank assembles of matrices with one pattern: its own, then those of other ranks.

    Attributes
    ----------
    pattern
        Pattern of these rows, (own + foreign, unknowns).
    """

    def __init__(self, fields: Fields, dofs: np.ndarray, pattern: sp.csr_matrix) -> None:
        """Agree on what is sent; collective.

        ``dofs`` are the degrees of freedom of all local cells, ``pattern`` that of this rank's rows.
        """
        self.comm, comm, n = fields.comm, fields.comm, fields.unknowns
        numbers = fields.number[dofs[: fields.owned_cells]]
        counts = comm.allgather(pattern.shape[0])
        ranges = np.append(0, np.cumsum(counts))
        first, end = ranges[comm.rank], ranges[comm.rank + 1]
        every = np.unique(numbers[numbers >= 0])
        foreign = every[(every < first) | (every >= end)]
        kept = numbers >= 0
        starts = np.append(0, np.cumsum(kept.sum(axis=1)))
        incidence = sp.csr_matrix((np.ones(starts[-1]), numbers[kept], starts), shape=(len(numbers), n))
        outside = (incidence[:, foreign].T @ incidence).tocsr()
        outside.sort_indices()
        self.pattern, self.own = sp.vstack([pattern, outside]).tocsr(), pattern.nnz
        self.pattern.sort_indices()
        self.row = np.full(n, -1)
        self.row[first:end], self.row[foreign] = np.arange(end - first), end - first + np.arange(len(foreign))
        # foreign rows ascend, so that those of one owner stand together
        rows = np.repeat(foreign, np.diff(outside.indptr))
        cuts = np.searchsorted(rows, ranges)
        self._sent = np.diff(cuts).tolist()
        got = comm.alltoall([(rows[a:b], outside.indices[a:b]) for a, b in pairwise(cuts)])
        keys = np.repeat(np.arange(first, end), np.diff(pattern.indptr)) * n + pattern.indices
        self._got = [len(row) for row, _ in got]
        self._places = []
        for row, column in got:
            wanted = row.astype(np.int64) * n + column
            place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            found = np.flatnonzero(
                keys[place] == wanted
            )  # a metric has fewer entries than its cells couple: those are 0
            self._places.append((found, place[found]))

    def exchange(self, values: np.ndarray) -> np.ndarray:
        """Values of this rank's own rows, with what others have assembled of them; collective."""
        own, received = values[: self.own], np.empty(sum(self._got))
        self.comm.Alltoallv([values[self.own :], self._sent], [received, self._got])
        for (found, place), part in zip(self._places, np.split(received, np.cumsum(self._got)[:-1]), strict=True):
            own[place] += part[found]
        return own


class SpreadMatrix:
    """A PETSc matrix on several ranks that forms are added to."""

    def __init__(self, layout: Layout, matrix: PETSc.Mat) -> None:
        """Learn where the ``matrix`` has its entries; collective."""
        self.layout, self._entries = layout, Entries(matrix)
        self._order = np.argsort(self._entries.places, kind="stable")

    def add(self, form: Assembler, local: np.ndarray, places: Places) -> None:
        """Add a form at ``local`` values of the unknown, to ``places`` of the layout's rows; collective."""
        values = np.zeros(self.layout.pattern.nnz)
        form.add(local, places, values)
        stored, begin = self.layout.exchange(values)[self._order], 0
        for part in self._entries.values():
            part += stored[begin : begin + len(part)]
            begin += len(part)
        self._entries.matrix.stateIncrease()


def spread_places(layout: Layout, dofs: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> Places:
    """Places in the rows of a ``layout``.

    ``rows`` and ``columns`` (local size,) are global numbers of the degrees of freedom, -1 for none; ``dofs`` (cells,
    n) are those of each cell.
    """
    return matrix_places(dofs, np.where(rows < 0, -1, layout.row[rows]), columns, layout.pattern)

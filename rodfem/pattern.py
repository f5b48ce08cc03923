"""Sparsity of the bordered system, and PETSc matrices made for it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fields import Fields


def bordered_pattern(fields: Fields) -> sp.csr_matrix:
    """Nonzero pattern of this rank's rows: couplings inside the cells, dense rows and columns of the scalars.

    Returns a matrix of ones, (local_unknowns, unknowns), that has the diagonal too.
    """
    comm, n = fields.comm, fields.unknowns
    cells = fields.owned_cells
    numbers = np.hstack([fields.number[d[:cells]].reshape(cells, -1) for d in fields.dofs.values()])
    cell = np.repeat(np.arange(cells), numbers.shape[1])
    keep = numbers.ravel() >= 0
    incidence = sp.csr_matrix((np.ones(keep.sum()), (cell[keep], numbers.ravel()[keep])), shape=(cells, n))
    coupling = (incidence.T @ incidence).tocoo()
    mine = fields.offset + np.arange(len(fields.free_owned))
    scalars = np.array(list(fields.scalars.values()))
    field, scalar = (x.ravel() for x in np.meshgrid(mine, scalars, indexing="ij"))
    a, b = (x.ravel() for x in np.meshgrid(scalars, scalars, indexing="ij"))
    rows = np.concatenate([coupling.row, mine, field, scalar, a])
    columns = np.concatenate([coupling.col, mine, scalar, field, b])
    starts = np.array([*comm.allgather(fields.offset), n])
    starts[-1] = n
    owner = np.clip(np.searchsorted(starts, rows, side="right") - 1, 0, comm.size - 1)
    owner[rows >= fields.field_unknowns] = comm.size - 1
    sent = comm.alltoall([np.stack([rows[owner == rank], columns[owner == rank]]) for rank in range(comm.size)])
    row, column = np.hstack(sent)
    first = fields.offset
    pattern = sp.csr_matrix((np.ones(len(row)), (row - first, column)), shape=(fields.local_unknowns, n))
    pattern.sum_duplicates()
    pattern.sort_indices()
    return pattern


def new_matrix(fields: Fields, pattern: sp.csr_matrix, rows: PETSc.LGMap, columns: PETSc.LGMap) -> PETSc.Mat:
    """Zero PETSc AIJ matrix with ``pattern`` and the maps from local degrees of freedom to its rows and columns."""
    size = (fields.local_unknowns, fields.unknowns)
    matrix = PETSc.Mat().createAIJ((size, size), comm=fields.comm)
    matrix.setPreallocationCSR(
        (pattern.indptr.astype(PETSc.IntType), pattern.indices.astype(PETSc.IntType), np.zeros(pattern.nnz))
    )
    matrix.setLGMap(rows, columns)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
    matrix.setOption(PETSc.Mat.Option.IGNORE_ZERO_ENTRIES, True)  # a point between two cells couples all of both, by 0
    return matrix

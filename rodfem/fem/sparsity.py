"""Sparsity of the bordered system, and PETSc matrices made for it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fem.fields import Fields
from rodfem.linalg.matrices import shared_matrix


def bordered_pattern(fields: Fields) -> sp.csr_matrix:
    """Nonzero pattern of this rank's rows: couplings inside the cells, dense rows and columns of the scalars.

    Returns a matrix of ones, (local_unknowns, unknowns), that has the diagonal too.
    """
    comm, n = fields.comm, fields.unknowns
    own = len(fields.free_owned)
    rows = _own_rows(fields, list(fields.dofs))
    scalars = np.array(list(fields.scalars.values()), dtype=np.int32)  # beyond all fields: the last columns of each row
    size = len(scalars)
    indptr = rows.indptr.astype(np.int64) + size * np.arange(own + 1)
    indices = np.empty(indptr[-1], dtype=np.int32)
    scalar = (indptr[1:, None] - size + np.arange(size)).ravel()
    field = np.ones(len(indices), dtype=bool)
    field[scalar] = False
    indices[scalar], indices[field] = np.tile(scalars, own), rows.indices
    if comm.rank == comm.size - 1:
        indptr = np.append(indptr, indptr[-1] + n * np.arange(1, size + 1))
        indices = np.append(indices, np.tile(np.arange(n, dtype=np.int32), size))
    shape = (fields.local_unknowns, n)
    return sp.csr_matrix((np.ones(len(indices), dtype=np.int8), indices, indptr), shape=shape)


def metric_pattern(fields: Fields) -> sp.csr_matrix:
    """Nonzero pattern of a metric: rotations couple to rotations, centreline or strains to themselves; the diagonal.

    A part of :func:`bordered_pattern`.
    """
    names = [name for name in (fields.turning.name, "r" if "r" in fields.dofs else "v") if name in fields.dofs]
    rows = sum(_own_rows(fields, [name]) for name in names)
    size = (fields.local_unknowns, fields.unknowns)
    diagonal = sp.eye(*size, k=fields.offset, dtype=np.int8, format="csr")
    pattern = sp.csr_matrix((rows.data, rows.indices, np.pad(rows.indptr, (0, size[0] - rows.shape[0]), "edge")), size)
    pattern = (pattern + diagonal).tocsr()
    pattern.sort_indices()
    return pattern


def _own_rows(fields: Fields, names: list[str]) -> sp.csr_matrix:
    """Couplings of this rank's unknowns of some fields inside all cells of which they are.

    Returns (free_owned, unknowns), sorted.
    """
    comm, n = fields.comm, fields.unknowns
    first, own, cells = fields.offset, len(fields.free_owned), fields.owned_cells
    numbers = np.hstack([fields.number[fields.dofs[name][:cells]].reshape(cells, -1) for name in names])
    keep = numbers >= 0
    indptr = np.append(0, np.cumsum(keep.sum(axis=1)))
    incidence = sp.csr_matrix((np.ones(indptr[-1], dtype=np.int8), numbers[keep], indptr), shape=(cells, n))
    coupling = incidence.T.tocsr() @ incidence
    rows = coupling[first : first + own]
    if comm.size > 1:
        starts = np.array(comm.allgather(first))
        outside = sp.vstack([coupling[:first], sp.csr_matrix((own, n), dtype=np.int8), coupling[first + own :]]).tocoo()
        owner = np.searchsorted(starts, outside.row, side="right") - 1
        sent = comm.alltoall([(outside.row[owner == rank], outside.col[owner == rank]) for rank in range(comm.size)])
        row, column = (np.concatenate(parts) for parts in zip(*sent, strict=True))
        rows = rows + sp.csr_matrix((np.ones(len(row), dtype=np.int8), (row - first, column)), shape=rows.shape)
    rows.sort_indices()
    return rows


def new_matrix(fields: Fields, pattern: sp.csr_matrix, rows: PETSc.LGMap, columns: PETSc.LGMap) -> PETSc.Mat:
    """Zero PETSc AIJ matrix with ``pattern``, on the ranks of ``fields``.

    ``rows`` and ``columns`` are the maps from local degrees of freedom to its rows and columns.  Its values are shared
    with numpy where compiled code assembles it.
    """
    if fields.compiled:
        matrix = shared_matrix(fields.comm, pattern)
    else:
        size = (fields.local_unknowns, fields.unknowns)
        matrix = PETSc.Mat().createAIJ((size, size), comm=fields.comm)
        index = (pattern.indptr.astype(PETSc.IntType), pattern.indices.astype(PETSc.IntType))
        matrix.setPreallocationCSR((*index, np.zeros(pattern.nnz)))
    matrix.setLGMap(rows, columns)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
    matrix.setOption(PETSc.Mat.Option.IGNORE_ZERO_ENTRIES, True)  # a point between two cells couples all of both, by 0
    return matrix

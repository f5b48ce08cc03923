"""Conversion of matrices of a rank's own unknowns to PETSc and back, and matrices whose values numpy shares."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import _sparsetools

EPS = float(np.finfo(float).eps)


def block_matrix(blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> sp.csr_matrix:
    """Sparse matrix of a ``shape`` with dense ``blocks`` (b, r, c) at ``rows`` (b, r) and ``columns`` (b, c)."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sp.csr_matrix((blocks.ravel(), (i.ravel(), j.ravel())), shape=shape)


def times(matrix: sp.csr_matrix, vectors: np.ndarray, values: np.ndarray | None = None) -> np.ndarray:
    """Product (m,) or (m, k) of real numbers, ``matrix`` (m, n) and ``vectors`` (n,) or (n, k).

    It is what ``@`` does, without the inspection of both that takes several times as long for a hundred unknowns.  The
    entries may have other ``values``.
    """
    (rows, columns), data = matrix.shape, matrix.data if values is None else values
    out, stored = np.zeros((rows, *vectors.shape[1:])), (matrix.indptr, matrix.indices, data)
    if vectors.ndim == 1:
        _sparsetools.csr_matvec(rows, columns, *stored, vectors, out)
    else:
        _sparsetools.csr_matvecs(rows, columns, vectors.shape[1], *stored, vectors.ravel(), out.ravel())
    return out


def local_rows(matrix: PETSc.Mat) -> sp.csr_matrix:
    """Rows of this rank, with the columns of all ranks; those of a shared matrix are its own, not a copy."""
    if (known := shared(matrix)) is not None:
        return known.matrix
    starts, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, starts), shape=(len(starts) - 1, matrix.getSize()[1]))


def rounding(matrix: PETSc.Mat, v: PETSc.Vec, x: PETSc.Vec) -> float:
    """Change of ``v.Sx`` by independent relative errors eps of all entries of a ``matrix`` S."""
    return rounding_of(matrix, v.array_r, x.array_r)


def rounding_of(matrix: PETSc.Mat, v: np.ndarray, x: np.ndarray) -> float:
    """The same for ``v`` and ``x`` (n,), real or complex, by the n values of each on this rank."""
    comm, rows = matrix.comm.tompi4py(), local_rows(matrix)
    squares = np.concatenate(comm.allgather(abs(x) ** 2))
    return float(EPS * np.sqrt(comm.allreduce(float(abs(v) ** 2 @ times(rows, squares, abs(rows.data) ** 2)))))


def gathered(matrix: PETSc.Mat) -> sp.csr_matrix:
    """All of a matrix on every rank."""
    own, comm = local_rows(matrix), matrix.comm.tompi4py()
    return own if comm.size == 1 else sp.vstack(comm.allgather(own)).tocsr()


@dataclass(frozen=True)
class Shared:
    """Values of a PETSc matrix on one rank that are an array of numpy as well, and its pattern."""

    values: np.ndarray
    pattern: sp.csr_matrix

    @cached_property
    def matrix(self) -> sp.csr_matrix:
        """The matrix, with the values that it has at any time."""
        pattern = self.pattern
        return sp.csr_matrix((self.values, pattern.indices, pattern.indptr), shape=pattern.shape, copy=False)


def bordered(rows: sp.csr_matrix, width: int, border: int, below: int) -> tuple[sp.csr_matrix, np.ndarray]:
    """Pattern of sparse ``rows`` with the last ``border`` of ``width`` columns in each, and dense rows ``below`` them.

    Returned with it is which entries of the given rows are those of the border.
    """
    count = rows.shape[0]
    indptr = np.append(0, np.cumsum(np.append(np.diff(rows.indptr) + border, np.full(below, width))))
    indices, added = np.empty(indptr[-1], dtype=np.int32), np.zeros(indptr[count], dtype=bool)
    added[(indptr[1 : count + 1, None] - border + np.arange(border)).ravel()] = True
    inside = indices[: len(added)]
    inside[added], inside[~added] = np.tile(np.arange(width - border, width), count), rows.indices
    indices[len(added) :] = np.tile(np.arange(width), below)
    ones = np.ones(len(indices), dtype=np.int8)
    return sp.csr_matrix((ones, indices, indptr), shape=(count + below, width)), added


def matrix_of(comm: MPI.Comm, pattern: sp.csr_matrix, *, compiled: bool) -> PETSc.Mat:
    """Zero matrix with a ``pattern`` of rows on this rank; that of ``compiled`` code shares its values with numpy."""
    if compiled:
        return shared_matrix(comm, pattern)
    matrix = PETSc.Mat().createAIJ((pattern.shape, pattern.shape), comm=comm)
    index = (x.astype(PETSc.IntType) for x in (pattern.indptr, pattern.indices))
    matrix.setPreallocationCSR((*index, np.zeros(pattern.nnz)))
    return matrix


def shared_matrix(comm: MPI.Comm, pattern: sp.csr_matrix) -> PETSc.Mat:
    """Zero matrix on the one rank of ``comm`` with a ``pattern``, whose indices are sorted; see :func:`shared`."""
    values = np.zeros(pattern.nnz)
    index = (x.astype(PETSc.IntType, copy=False) for x in (pattern.indptr, pattern.indices))
    matrix = PETSc.Mat().createAIJWithArrays(pattern.shape, (*index, values), comm=comm)
    matrix.setAttr("shared", Shared(values, pattern))
    return matrix


def shared(matrix: PETSc.Mat) -> Shared | None:
    """What a matrix shares with numpy; None for one that :func:`shared_matrix` did not make, copies among them."""
    found: Shared | None = matrix.getAttr("shared")
    return found


def places_in(pattern: sp.csr_matrix, other: sp.csr_matrix) -> np.ndarray:
    """Places among the entries of a ``pattern`` of those of an ``other``, all of which it has; indices are sorted."""
    numbers = [
        np.repeat(np.arange(x.shape[0]), np.diff(x.indptr)) * x.shape[1] + x.indices.astype(np.int64)
        for x in (pattern, other)
    ]
    return np.searchsorted(*numbers).astype(np.int32)

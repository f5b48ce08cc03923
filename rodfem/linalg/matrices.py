"""Conversion of matrices of a rank's own unknowns to PETSc and back, the entries that PETSc stores, and shared ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import _sparsetools


def first_of(comm: MPI.Comm, count: int) -> int:
    """Number of things on the ranks before this one, of which it has ``count``."""
    return sum(comm.allgather(count)[: comm.rank])


def block_matrix(blocks: np.ndarray, rows: np.ndarray, columns: np.ndarray, shape: tuple[int, int]) -> sp.csr_matrix:
    """Sparse matrix of a ``shape`` with dense ``blocks`` (b, r, c) at ``rows`` (b, r) and ``columns`` (b, c)."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sp.csr_matrix((blocks.ravel(), (i.ravel(), j.ravel())), shape=shape)


def times(matrix: sp.csr_matrix, vector: np.ndarray) -> np.ndarray:
    """Product (m,) of real numbers, ``matrix`` (m, n) and ``vector`` (n,).

    It is what ``@`` does, without the inspection of both that takes several times as long for a hundred unknowns.
    """
    rows, columns = matrix.shape
    out = np.zeros(rows)
    _sparsetools.csr_matvec(rows, columns, matrix.indptr, matrix.indices, matrix.data, vector, out)
    return out


def petsc_matrix(comm: MPI.Comm, local: sp.spmatrix) -> PETSc.Mat:
    """Block diagonal PETSc matrix, one block a rank."""
    local = local.tocsr()
    local.sort_indices()
    n = local.shape[1]
    size = ((local.shape[0], PETSc.DETERMINE), (n, PETSc.DETERMINE))
    columns = (local.indices + first_of(comm, n)).astype(PETSc.IntType)
    return PETSc.Mat().createAIJ(size, csr=(local.indptr.astype(PETSc.IntType), columns, local.data), comm=comm)


def local_rows(matrix: PETSc.Mat) -> sp.csr_matrix:
    """Rows of this rank, with the columns of all ranks."""
    starts, columns, values = matrix.getValuesCSR()
    return sp.csr_matrix((values, columns, starts), shape=(len(starts) - 1, matrix.getSize()[1]))


def gathered(matrix: PETSc.Mat) -> sp.csr_matrix:
    """All of a matrix on every rank."""
    return sp.vstack(matrix.comm.tompi4py().allgather(local_rows(matrix))).tocsr()


@dataclass(frozen=True)
class Shared:
    """Values of a PETSc matrix on one rank that are an array of numpy as well, and its pattern."""

    values: np.ndarray
    pattern: sp.csr_matrix

    @property
    def matrix(self) -> sp.csr_matrix:
        """The matrix, with the values that it has now."""
        return sp.csr_matrix((self.values, self.pattern.indices, self.pattern.indptr), shape=self.pattern.shape)


def shared_matrix(comm: MPI.Comm, pattern: sp.csr_matrix) -> PETSc.Mat:
    """Zero matrix on the one rank of ``comm`` with a ``pattern``, whose indices are sorted; see :func:`shared`."""
    values = np.zeros(pattern.nnz)
    index = (pattern.indptr.astype(PETSc.IntType), pattern.indices.astype(PETSc.IntType))
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
    return np.asarray(np.searchsorted(*numbers))


STORED = """
int MatMPIAIJGetSeqAIJ(void *matrix, void **block, void **rest, void *columns);
int MatSeqAIJGetArrayRead(void *matrix, void **values);
int MatSeqAIJRestoreArrayRead(void *matrix, void **values);
"""
"""Functions of PETSc that petsc4py does not have: they show where the entries of a matrix are."""


@cache
def _petsc() -> tuple[Any, Any]:
    """PETSc's library, which petsc4py has loaded, and what calls it."""
    from cffi import FFI

    ffi = FFI()
    ffi.cdef(STORED)
    return ffi, ffi.dlopen(PETSc.__file__)


class Entries:
    """Entries of this rank's rows of an AIJ matrix whose pattern stays, without the search that PETSc makes for each.

    Attributes
    ----------
    starts, columns
        Pattern of the rows, with global columns in ascending order.
    places
        Places of these entries among :meth:`values`: those in columns of this rank's unknowns are stored first.
    number
        How many there are.
    """

    def __init__(self, matrix: PETSc.Mat) -> None:
        """Learn the pattern of ``matrix``."""
        self.matrix = matrix
        self.starts, self.columns, _ = matrix.getValuesCSR()
        begin, end = matrix.getOwnershipRangeColumn()
        own = (self.columns >= begin) & (self.columns < end)
        self._counts, self.number = [int(own.sum()), int((~own).sum())], len(own)
        self.places = np.where(own, np.cumsum(own) - 1, self._counts[0] + np.cumsum(~own) - 1)

    def values(self) -> list[np.ndarray]:
        """Values now, in the arrays of PETSc: not to be kept."""
        ffi, lib = _petsc()
        whole = ffi.cast("void *", self.matrix.handle)
        if self.matrix.comm.size == 1:
            return [self._values(whole, self.number)]
        blocks = ffi.new("void *[2]")
        lib.MatMPIAIJGetSeqAIJ(whole, blocks, blocks + 1, ffi.NULL)
        return [self._values(block, n) for block, n in zip(blocks, self._counts, strict=True)]

    @staticmethod
    def _values(block: Any, number: int) -> np.ndarray:
        if not number:
            return np.empty(0, PETSc.ScalarType)
        ffi, lib = _petsc()
        at = ffi.new("void **")
        lib.MatSeqAIJGetArrayRead(block, at)
        out = np.frombuffer(ffi.buffer(at[0], number * np.dtype(PETSc.ScalarType).itemsize), PETSc.ScalarType)
        lib.MatSeqAIJRestoreArrayRead(block, at)
        return out

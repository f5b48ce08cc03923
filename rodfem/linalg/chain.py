"""Factors of a matrix whose graph is a chain: one elimination along it, compiled (``chain.c``).

The unknowns of a rod couple within cells, and cells follow one another; a few scalars couple to everything.  Eliminated
along the rod, each cell is a small dense front, and what is left of it, a Schur complement of the order of one vertex
and the scalars, enters the next one.  The factors of a rod of 73 unknowns take 0.04 ms; a general package needs five
times as long, most of it for finding its way.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rodfem.errors import ConvergenceError
from rodfem.linalg.compiled import module
from rodfem.linalg.matrices import values_of

DECLARATIONS = """
typedef struct chain chain;
chain *chain_new(int n, const int *starts, const int *indices, const int *sequence, int groups, const int *begin,
                 int symmetric, int largest);
void chain_free(chain *c);
int chain_factor(chain *c, const double *values);
int chain_solve(const chain *c, int k, const double *b, double *x);
int chain_negative(const chain *c);
int chain_zero(const chain *c);
int chain_fronts(const chain *c);
double chain_determinant(const chain *c);
double chain_growth(const chain *c);
int chain_delayed(const chain *c);
"""
LARGEST = 2000
"""Delayed pivots that a front may have: with more of them the matrix is no chain."""
SINGULAR, TOO_LARGE = 1, 2
"""What ``chain_factor`` returns for a matrix that is exactly singular, and where it gives up."""


def sequence(pattern: sp.csr_matrix, border: int) -> tuple[np.ndarray, np.ndarray]:
    """Order of elimination along a chain, (n,), and where its groups begin, (groups + 1,).

    Unknowns with the same couplings form a group (a supervariable): the interior of a cell, or a vertex.  The last
    group is the border, the last ``border`` rows of the ``pattern``, which is symmetric.
    """
    inner = pattern.shape[0] - border
    fields = sp.csr_matrix(pattern[:inner, :inner])
    fields.data = np.ones(fields.nnz)
    along = np.asarray(reverse_cuthill_mckee(fields, symmetric_mode=True), dtype=np.int64)
    # rows with the same nonzeros have the same sum of random numbers, which differ
    sums = fields @ np.random.default_rng(1).random(inner)
    _, group = np.unique(sums, return_inverse=True)
    first = np.full(group.max(initial=-1) + 1, inner)
    np.minimum.at(first, group[along], np.arange(inner))
    order = along[np.argsort(first[group[along]], kind="stable")]
    changes = np.flatnonzero(np.diff(group[order], prepend=-1)) if inner else np.array([], dtype=int)
    return (
        np.concatenate([order, np.arange(inner, inner + border)]).astype(np.int32),
        np.concatenate([changes, [inner, inner + border]]).astype(np.int32),
    )


class Chain:
    """:class:`~rodfem.linalg.factorization.Factors` of matrices with one pattern, on this rank.

    ``kind`` is ``lu``, or ``cholesky`` (LDL^t with the inertia).  The last ``border`` rows of a matrix may couple to
    all others.  ``regular`` is false where the last one was exactly singular.
    """

    def __init__(self, kind: str, border: int) -> None:
        """Keep the number of scalars for when there is a matrix."""
        self.kind, self.border = kind, border
        self.compiled = module("chain", DECLARATIONS)
        self.lib, self.ffi = self.compiled.lib, self.compiled.ffi
        self.regular = False
        self._handle: int = 0
        self._chain: Any = None

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises :class:`ConvergenceError` where it is no chain, or holds what is no number."""
        self.prepare(matrix)
        values = values_of(matrix)
        status = self.lib.chain_factor(self._chain, self._pointer(values, "double"))
        self.regular = status == 0
        if status > SINGULAR:
            why = "its fronts are too large" if status == TOO_LARGE else "it has entries that are no numbers"
            raise ConvergenceError(f"The matrix could not be factored along the rod: {why}.")

    def prepare(self, matrix: PETSc.Mat) -> None:
        """Find the fronts of a ``matrix``, unless they are known."""
        if self._chain is None or matrix.handle != self._handle:
            starts, indices, _ = matrix.getValuesCSR()
            self._set_up(matrix.size[0], starts, indices)
            self._handle = matrix.handle

    @property
    def pointer(self) -> Any:
        """The chain, for other compiled code; it sets :attr:`regular`."""
        return self._chain

    @property
    def functions(self) -> list[int]:
        """Addresses of the functions that factor, solve, and count negative pivots and those that are zero."""
        names = ("factor", "solve", "negative", "zero")
        return [int(self.ffi.cast("uintptr_t", self.ffi.addressof(self.lib, f"chain_{name}"))) for name in names]

    def _pointer(self, array: np.ndarray, kind: str) -> Any:
        return self.ffi.from_buffer(f"{kind}[]", array)

    def _set_up(self, n: int, starts: np.ndarray, indices: np.ndarray) -> None:
        starts, indices = starts.astype(np.int32), indices.astype(np.int32)
        order, groups = sequence(sp.csr_matrix((np.ones(len(indices)), indices, starts), shape=(n, n)), self.border)
        made = self.lib.chain_new(
            n,
            *(self._pointer(x, "int") for x in (starts, indices, order)),
            len(groups) - 1,
            self._pointer(groups, "int"),
            self.kind == "cholesky",
            LARGEST,
        )
        if made == self.ffi.NULL:
            raise MemoryError(f"No memory for the factors of {n} unknowns.")
        self._chain, self.rows = self.ffi.gc(made, self.lib.chain_free), n

    def solve_columns(self, right: np.ndarray) -> np.ndarray:
        """Solutions (n, k) for ``right`` (n, k); raises :class:`MemoryError` where there is no room for them."""
        out = np.array(right, dtype=float, order="F")
        room = self.ffi.cast("double *", out.ctypes.data)
        if self.lib.chain_solve(self._chain, out.shape[1], room, room):
            raise MemoryError(f"No memory for solutions of {self.rows} unknowns.")
        return out

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> None:
        """Solve with the last factors."""
        out.array[:] = self.solve_columns(right.array_r.real[:, None])[:, 0]

    def solve_all(self, right: PETSc.Mat, out: PETSc.Mat) -> None:
        """Solve for all columns of a dense matrix."""
        out.getDenseArray()[:] = self.solve_columns(right.getDenseArray().real)

    def columns(self, rows: np.ndarray, right: PETSc.Mat, out: PETSc.Mat) -> None:
        """Columns ``rows`` of the inverse; ``right`` is room for their right-hand sides."""
        units = np.zeros((self.rows, len(rows)))
        units[rows, np.arange(len(rows))] = 1.0
        out.getDenseArray()[:] = self.solve_columns(units)

    def inertia(self) -> tuple[int, int]:
        """Number of negative eigenvalues of the symmetric matrix last factored, and of pivots that are zero."""
        return int(self.lib.chain_negative(self._chain)), int(self.lib.chain_zero(self._chain))

    def determinant(self) -> float:
        """Logarithm of the size of the determinant of the matrix last factored; -inf where it is zero."""
        return float(self.lib.chain_determinant(self._chain)) if self.regular else -inf

    @property
    def growth(self) -> float:
        """Largest multiplier of the last factors."""
        return float(self.lib.chain_growth(self._chain))

    @property
    def delayed(self) -> int:
        """Number of pivots that the last factors delayed, once for each front."""
        return int(self.lib.chain_delayed(self._chain))

    @property
    def fronts(self) -> int:
        """Number of fronts."""
        return int(self.lib.chain_fronts(self._chain))

"""Factors of a matrix whose graph is a chain: one elimination along it, compiled (``chain.c``).

The unknowns of a rod couple within cells, and cells follow one another; a few scalars couple to everything.  Eliminated
along the rod, each cell is a small dense front, and what is left of it, a Schur complement of the order of one vertex
and the scalars, enters the next one.  The factors of a rod of 73 unknowns take 0.04 ms; a general package needs five
times as long, most of it for finding its way.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rodfem.errors import ConvergenceError
from rodfem.linalg.compiled import addresses, buffer, module
from rodfem.linalg.factorization import Mumps, Sizes
from rodfem.linalg.matrices import Shared, shared

LARGEST = 2000
"""Delayed pivots that a front may have: with more of them the matrix is no chain."""
SINGULAR, TOO_LARGE = 1, 2
"""What ``chain_factor`` returns for a matrix that is exactly singular, and where it gives up."""


def sequence(starts: np.ndarray, columns: np.ndarray, border: int) -> tuple[np.ndarray, np.ndarray]:
    """Order of elimination along a chain, (n,), and where its groups begin, (groups + 1,): see :func:`_sequence`."""
    order, begins = _sequence(*(np.ascontiguousarray(x, dtype=np.int64).tobytes() for x in (starts, columns)), border)
    return order.copy(), begins.copy()


@lru_cache(maxsize=64)
def _sequence(starts_of_rows: bytes, numbers_of_columns: bytes, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Order of elimination along a chain, (n,), and where its groups begin, (groups + 1,), of many equal patterns once.

    Unknowns with the same couplings form a group (a supervariable): the interior of a cell, or a vertex.  The last
    group is the border, the ``last`` unknowns.  Of the two directions that is chosen in which fewer fronts have
    unknowns of the border: towards them.  The pattern is symmetric.
    """
    starts, columns = (np.frombuffer(x, dtype=np.int64) for x in (starts_of_rows, numbers_of_columns))
    n = len(starts) - 1
    border = np.arange(n - last, n)
    numbers = np.setdiff1d(np.arange(n), border)
    inner = len(numbers)
    if not inner:
        return border, np.array([0, n])
    rows = sp.csr_matrix((np.ones(len(columns), dtype=np.int8), columns, starts), shape=(n, n))[numbers]
    fields = rows[:, numbers]
    along = np.asarray(reverse_cuthill_mckee(fields, symmetric_mode=True), dtype=np.int64)
    along = _towards(sp.csc_matrix(rows[:, border]), along)
    # rows with the same nonzeros have the same sum of random numbers, which differ
    sums = fields @ np.random.default_rng(1).random(inner)
    _, group = np.unique(sums, return_inverse=True)
    first = np.empty(group.max() + 1, dtype=np.int64)
    first[group[along[::-1]]] = np.arange(inner)[::-1]  # of several the last stays, the first along the chain
    order = along[np.argsort(first[group[along]], kind="stable")]
    changes = np.flatnonzero(np.diff(group[order], prepend=-1))
    return np.append(numbers[order], border), np.append(changes, [inner, n])


def _towards(couplings: sp.csc_matrix, along: np.ndarray) -> np.ndarray:
    """The order ``along`` or its reverse, in which unknowns of the border couple later to those before them."""
    inner, begin = len(along), couplings.indptr[:-1][np.diff(couplings.indptr) > 0]
    if not len(begin):
        return along
    turn = np.empty(inner, dtype=np.int64)
    turn[along] = np.arange(inner)
    first, last = (pick.reduceat(turn[couplings.indices], begin) for pick in (np.minimum, np.maximum))
    return along[::-1] if (last + 1).sum() < (inner - first).sum() else along


class Chain:
    """Factors of matrices of compiled code with one pattern, whose last ``border`` rows may couple to all others.

    ``kind`` is ``lu``, or ``cholesky`` (LDL^t with the inertia); ``sizes`` returns the natural sizes of the unknowns,
    None where they are one.  ``regular`` is false where the last matrix was exactly singular.  Other compiled code may
    use the ``pointer``; whoever keeps it in a structure keeps this object, too.
    """

    def __init__(self, kind: str, border: int, sizes: Sizes | None = None) -> None:
        compiled = module("linalg/chain")
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self.kind, self.border, self.sizes, self.regular = kind, border, sizes, False
        self._matrix: Shared | None = None

    def prepare(self, matrix: PETSc.Mat) -> Shared:
        """Find the fronts of a ``matrix``, unless they are known; returns its values."""
        own = shared(matrix)
        assert own is not None
        if own is not self._matrix:
            pattern = own.pattern.indptr, own.pattern.indices
            arrays = (*pattern, *sequence(*pattern, self.border))
            *known, groups = (np.ascontiguousarray(x, dtype=np.int32) for x in arrays)
            sizes = *(buffer(self.ffi, x) for x in known), len(groups) - 1, buffer(self.ffi, groups)
            made = self.lib.chain_new(len(known[0]) - 1, *sizes, self.kind == "cholesky", LARGEST)
            if made == self.ffi.NULL:
                raise MemoryError(f"No memory for the factors of {len(known[0]) - 1} unknowns.")
            self.pointer = self.ffi.gc(made, self.lib.chain_free)
            if self.sizes is not None:  # the scale of the next matrix starts from them
                self.lib.chain_sizes(self.pointer, buffer(self.ffi, np.array(self.sizes().array_r, dtype=float)))
            self._matrix = own  # last: there may be no memory for the fronts
        return own

    @property
    def functions(self) -> list[int]:
        """Addresses of the functions that factor and solve."""
        return addresses(module("linalg/chain"), "chain_factor", "chain_solve")

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises :class:`ConvergenceError` for one that is no chain, or has no numbers in it."""
        values = self.prepare(matrix).values
        status = self.lib.chain_factor(self.pointer, buffer(self.ffi, values))
        self.regular = status == 0
        if status > SINGULAR:
            why = "its fronts are too large" if status == TOO_LARGE else "it has entries that are no numbers"
            raise ConvergenceError(f"The matrix could not be factored along the rod: {why}.")

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> None:
        """Solve with the last factors."""
        out.array[:] = self.solve_all(right.array_r[:, None])[:, 0]

    def solve_all(self, right: np.ndarray) -> np.ndarray:
        """Solutions for all columns of ``right`` (n, k) at once: a column costs much less than a call."""
        right = np.asarray(right, dtype=float, order="F")
        out = np.empty_like(right)
        if self.lib.chain_solve(self.pointer, right.shape[1], buffer(self.ffi, right), buffer(self.ffi, out)):
            raise MemoryError(f"No memory for solutions of {len(right)} unknowns.")
        return out

    def inertia(self) -> tuple[int, int]:
        """Number of negative pivots of the symmetric matrix last factored, and of those that are zero."""
        return int(self.lib.chain_negative(self.pointer)), int(self.lib.chain_zero(self.pointer))


Factors = Chain | Mumps
"""Factors ``lu``, or ``cholesky``, of matrices given one after the other."""

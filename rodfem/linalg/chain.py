"""Factors of a matrix whose graph is a chain: one elimination along it, compiled (``chain.c``).

The unknowns of a rod couple within cells, and cells follow one another; a few scalars couple to everything.  Eliminated
along the rod, each cell is a small dense front, and what is left of it, a Schur complement of the order of one vertex
and the scalars, enters the next one.  The factors of a rod of 73 unknowns take 0.04 ms; a general package needs five
times as long, most of it for finding its way.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rodfem.errors import ConvergenceError, InputError
from rodfem.linalg.compiled import buffer, module
from rodfem.linalg.factorization import Factors, Mumps, Sizes
from rodfem.linalg.matrices import Entries

CHAIN, MUMPS = "chain", "mumps"
"""Names of what factors a rod's matrices."""
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


class GaveUpError(ConvergenceError):
    """The elimination along the rod needs fronts that are too large: too many pivots were delayed."""


class Elimination:
    """The compiled elimination of matrices with one pattern (``starts``, ``indices``), in the order of a sequence.

    ``kind`` is ``lu``, or ``cholesky`` (LDL^t with the inertia). ``regular`` is false where the last matrix was exactly
    singular.
    """

    def __init__(
        self,
        kind: str,
        starts: np.ndarray,
        indices: np.ndarray,
        order: tuple[np.ndarray, np.ndarray],
    ) -> None:
        compiled = module("linalg/chain")
        self.lib, self.ffi = compiled.lib, compiled.ffi
        self.rows, self.regular = len(starts) - 1, False
        *pattern, groups = (np.ascontiguousarray(x, dtype=np.int32) for x in (starts, indices, *order))
        made = self.lib.chain_new(
            self.rows,
            *(buffer(self.ffi, x) for x in pattern),
            len(groups) - 1,
            buffer(self.ffi, groups),
            kind == "cholesky",
            LARGEST,
        )
        if made == self.ffi.NULL:
            raise MemoryError(f"No memory for the factors of {self.rows} unknowns.")
        self._chain = self.ffi.gc(made, self.lib.chain_free)

    @property
    def pointer(self) -> Any:
        """The chain, for other compiled code; whoever keeps it in a structure keeps this object, too."""
        return self._chain

    @property
    def functions(self) -> list[int]:
        """Addresses of the functions that factor and solve."""
        found = (self.ffi.addressof(self.lib, name) for name in ("chain_factor", "chain_solve"))
        return [int(self.ffi.cast("uintptr_t", address)) for address in found]

    def factor(self, values: np.ndarray) -> None:
        """Eliminate; raises :class:`GaveUpError` where the matrix is no chain."""
        values = np.ascontiguousarray(values.real)
        status = self.lib.chain_factor(self._chain, buffer(self.ffi, values))
        self.regular = status == 0
        if status == TOO_LARGE:
            raise GaveUpError("The matrix could not be factored along the rod: its fronts are too large.")
        if status > SINGULAR:
            raise ConvergenceError(
                "The matrix could not be factored along the rod: it has entries that are no numbers."
            )

    def measure(self, sizes: np.ndarray) -> None:
        """Let the scale of the next matrix start from the natural ``sizes`` (n,) of the unknowns."""
        sizes = np.ascontiguousarray(sizes, dtype=float)
        self.lib.chain_sizes(self._chain, buffer(self.ffi, sizes))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solutions (n, k) for ``right`` (n, k)."""
        right = np.asarray(right, dtype=float, order="F")
        out = np.empty_like(right)
        if self.lib.chain_solve(self._chain, right.shape[1], buffer(self.ffi, right), buffer(self.ffi, out)):
            raise MemoryError(f"No memory for solutions of {self.rows} unknowns.")
        return out

    def inertia(self) -> tuple[int, int]:
        """Number of negative pivots of the symmetric matrix last factored, and of those that are zero."""
        return int(self.lib.chain_negative(self._chain)), int(self.lib.chain_zero(self._chain))

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


class Chain:
    """Factors of matrices with one pattern, on one rank, whose last ``border`` rows may couple to all others.

    ``kind`` is ``lu``, or ``cholesky`` (LDL^t with the inertia); ``sizes`` returns the natural sizes of the unknowns,
    None where they are one. ``regular`` is false where the last one was exactly singular; ``elimination`` has its
    factors. A matrix on which the elimination gives up is factored by the last ``resort``, without one
    :class:`GaveUpError` is raised; ``times`` is the number of those.
    """

    def __init__(self, kind: str, border: int, resort: Mumps | None = None, sizes: Sizes | None = None) -> None:
        self.kind, self.border, self.resort, self.sizes = kind, border, resort, sizes
        self.resorted, self.times, self.regular = False, 0, False
        self._matrix: PETSc.Mat | None = None

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``."""
        self.resorted = False
        self.prepare(matrix)
        try:
            self.elimination.factor(self._entries.values())
            self.regular = self.elimination.regular
        except GaveUpError:
            if self.resort is None:
                raise
            self.resort(matrix)
            self.resorted, self.regular = True, self.resort.regular
            self.times += 1

    def prepare(self, matrix: PETSc.Mat) -> None:
        """Find the fronts of a ``matrix``, unless they are known."""
        if self._matrix is None or matrix.handle != self._matrix.handle:
            entries = Entries(matrix)
            pattern = entries.starts, entries.columns
            self.elimination = Elimination(self.kind, *pattern, sequence(*pattern, self.border))
            if self.sizes is not None:
                self.elimination.measure(self.sizes().array_r.real)
            self._matrix, self._entries = matrix, entries  # last: there may be no memory for the fronts

    def adopt(self, *, regular: bool) -> None:
        """The factors are those that other compiled code has just made by :attr:`Elimination.functions`."""
        self.resorted, self.regular, self.elimination.regular = False, regular, regular

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> None:
        """Solve with the last factors."""
        if self.resort and self.resorted:
            self.resort.solve(right, out)
        else:
            out.array[:] = self.elimination.solve(right.array_r.real[:, None])[:, 0]

    def solve_all(self, right: np.ndarray) -> np.ndarray:
        """Solutions for all columns of ``right`` (own rows, k) at once."""
        return (self.resort.solve_all if self.resort and self.resorted else self.elimination.solve)(right)

    def inertia(self) -> tuple[int, int]:
        """Number of negative eigenvalues of the symmetric matrix last factored, and of pivots that are zero."""
        return (self.resort if self.resort and self.resorted else self.elimination).inertia()


def package(prefix: str) -> str:
    """Name of what factors a rod's matrices: PETSc's option with the prefix, or what is best."""
    best = MUMPS if np.issubdtype(PETSc.ScalarType, np.complexfloating) else CHAIN
    name = str(PETSc.Options(prefix).getString("pc_factor_mat_solver_type", best))
    if name not in (CHAIN, MUMPS):
        raise InputError(f"Nothing factors matrices by the name {name!r}: choose {CHAIN} or {MUMPS}.")
    return name


def factors_of(kind: str, comm: MPI.Comm, unknowns: int, scalars: int, sizes: Sizes | None = None) -> Factors:
    """Factors for matrices of ``unknowns`` rows along a rod on a communicator, the last ``scalars`` of which are dense.

    Those of another matrix, of 0 unknowns, and on several ranks are MUMPS's, which is the last resort of the others.
    """
    mumps = Mumps(kind, sizes)
    if not unknowns or package(mumps.prefix) == MUMPS or comm.size > 1:
        return mumps
    return Chain(kind, scalars, mumps, sizes)

r"""All finite eigenvalues ``mu = omega^2``, or rates of decay, of a pencil ``S x = mu M x``, on its unknowns with mass.

The mass is ``M = L R^t``: ``R = L`` has as many columns as its rank; of a large pencil ``L`` is ``M``, and ``R`` one.
With a shift ``a``

    T w = nu w,        T = R^t (S - a M)^-1 L,        nu = 1 / (mu - a),

has all finite eigenvalues: ``x = (S - a M)^-1 L w / nu`` and ``w = R^t x``.  Massless unknowns, multipliers and
constraints are eliminated by as many solves as ``L`` has columns.  Directions with mass that the constraints hold have
``nu = 0``, in no Jordan blocks: round-off leaves them as small as it is, and finite eigenvalues are distinct from them
down to there.  LAPACK finds all eigenvalues of ``T``; of a large ``T`` SLEPc finds the greatest.

Round-off ``dT`` moves a simple eigenvalue by up to ``|dT| |z|`` for its right and left vectors ``w`` and ``z``, with
``|w| = 1`` and ``z.w = 1``, and one of two that meet by no more than ``(|dT| |T|)^(1/2)``, where ``z`` has no bound
(Wilkinson, The Algebraic Eigenvalue Problem, 1965, chapter 2).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache, partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc
from scipy.linalg.lapack import dpstrf
from scipy.sparse.linalg import splu
from slepc4py import SLEPc

from rodfem.compat import slepc_errors
from rodfem.errors import ConvergenceError
from rodfem.tolerances import TINY

SHIFT = -10.0
"""Eigenvalues are sought next to this one, over their natural size.

Next to zero the matrix may be singular, and the rigid motions of a rod that floats take the digits of all others."""
REAL = 1e-7
"""An imaginary part smaller than this, relative to the eigenvalue, is round-off of a real one."""
ALL = 1000
"""Rank of the mass up to which all eigenvalues are found: LAPACK takes some seconds there."""
RANK = 1e-13
"""Pivot of the mass below which it is round-off, relative to its diagonal: a quaternion's own length has no mass."""
FINITE = 1e-13
"""Eigenvalue of an inverted pencil, over the greatest, below which it is that of an infinite one."""
ROUNDED = 1e-14
"""Round-off of ``T``, over the norms of its factors: of free rods on six elements 1.2e-14 of its norm is seen."""
TOLERANCE = 1e-13
"""Relative tolerance of SLEPc."""

Solve = Callable[[np.ndarray], np.ndarray]
Matrix: TypeAlias = np.ndarray | sp.csr_matrix


def factors_of_mass(mass: sp.csr_matrix) -> tuple[np.ndarray, sp.csr_matrix, sp.csr_matrix]:
    """Rows with mass (h,), and ``L`` and ``R`` in them (h, r): see :func:`_factors`; straight rods have one mass."""
    return _factors(mass.shape[0], *(x.tobytes() for x in (mass.data, mass.indices, mass.indptr)), mass.indices.dtype)


@lru_cache(2)
def _factors(n: int, data: bytes, indices: bytes, starts: bytes, kind: Any) -> tuple[Any, sp.csr_matrix, sp.csr_matrix]:
    """The same by Cholesky's method with pivots of a unit diagonal."""
    index = (np.frombuffer(x, kind) for x in (indices, starts))
    mass = sp.csr_matrix((np.frombuffer(data), *index), shape=(n, n))
    size = np.sqrt(np.maximum(mass.diagonal(), 0.0))
    heavy = np.flatnonzero(size)
    if len(heavy) > 2000:  # too many for dense matrices
        return heavy, mass[heavy][:, heavy].tocsr(), sp.identity(len(heavy), format="csr")
    scale = size[heavy]
    lower, pivots, rank, _ = dpstrf(mass[heavy][:, heavy].toarray() / np.outer(scale, scale), tol=RANK, lower=1)
    out = np.zeros((len(heavy), rank))
    out[pivots - 1] = np.tril(lower)[:, :rank]
    lower = sp.csr_matrix(out * scale[:, None])
    return heavy, lower, lower


class Eigenpairs(NamedTuple):
    """Eigenvalues of ``T``, the greatest first."""

    nu: np.ndarray  # (k,)
    right: np.ndarray  # vectors (r, k), or those of T^t
    noise: np.ndarray  # what round-off may make of nu
    error: np.ndarray  # residual over the size of T
    left: np.ndarray = np.zeros((0, 0))  # vectors (k, r) of all eigenvalues, biorthonormal to the right ones
    vectors: np.ndarray | None = None  # those of a large pencil (n, k)

    def at(self, places: slice | np.ndarray) -> Eigenpairs:
        """Those at some places, without left vectors."""
        vectors = None if self.vectors is None else self.vectors[:, places]
        nu, right, noise, error = (each[..., places] for each in self[:4])
        return Eigenpairs(nu, right, noise, error, vectors=vectors)


class Spectrum:
    """A pencil on its unknowns with mass about a ``shift``, and all its finite eigenvalues, nearest to that first.

    ``one`` is their natural size, the unit of the ``shift``.  ``floor`` is what round-off makes of zero, where it is
    known (:mod:`rodfem.stability.nonsymmetric`).
    """

    order = 2  # of the equations of motion in time: of the first order eigenvalues are rates of decay

    def __init__(self, stiffness: sp.csr_matrix, mass: sp.csr_matrix, shift: float, one: float = 1.0) -> None:
        """Factor by LU; raises :class:`~rodfem.errors.ConvergenceError` if the pencil is singular at the shift."""
        try:
            lu = splu((stiffness - shift * mass).tocsc())
        except RuntimeError as trouble:
            raise ConvergenceError(
                f"The pencil is singular at the shift {shift:.6g}: choose another load, or another discretisation."
            ) from trouble
        self.solve, self.solve_transposed, self.shift, self.one = lu.solve, partial(lu.solve, trans="T"), shift, one
        self.floor, self.rows, self._known = np.inf, mass.shape[0], dict[float, np.ndarray]()
        self.heavy, self.lower, self.dual = factors_of_mass(mass)
        self.rank = self.lower.shape[1]

    # --- eigenpairs of T ---------------------------------------------------------------------------------------

    def spread(self, w: np.ndarray, factor: Matrix | None = None) -> np.ndarray:
        """``L w`` (n, k) for ``w`` (r, k), or that of another ``factor``: products of vectors with the mass."""
        product = times(self.lower if factor is None else factor, w)
        out = np.zeros((self.rows, w.shape[1]), dtype=product.dtype, order="F")
        out[self.heavy] = product
        return out

    @cached_property
    def images(self) -> np.ndarray:
        """``(S - a M)^-1 L`` (n, r)."""
        return self.solve(self.spread(np.eye(self.rank)))

    @property
    def inverse(self) -> np.ndarray:
        """The same in the rows with mass (h, r)."""
        return self.images[self.heavy]

    @property
    def complete(self) -> bool:
        """Whether it has all eigenvalues of the mesh."""
        return self.rank <= ALL

    @cached_property
    def pairs(self) -> Eigenpairs:
        """All finite eigenpairs, or 40 where the mass has a rank above :data:`ALL`."""
        if not self.complete:  # left vectors within the span of the right ones
            found = self.greatest(40)
            return found._replace(left=np.linalg.pinv(found.right), vectors=self.vectors(found))
        matrix, size = self.dual.T @ self.inverse, np.linalg.norm(self.lower.data)
        nu, right = np.linalg.eig(matrix)
        try:
            left = np.linalg.inv(right)
        except np.linalg.LinAlgError:
            left = np.linalg.pinv(right)
        rounded = ROUNDED * size * max(np.linalg.norm(self.inverse), size)
        noise = np.minimum(rounded * np.linalg.norm(left, axis=1), np.sqrt(rounded * np.linalg.norm(matrix)))
        error = np.linalg.norm(matrix @ right - right * nu, axis=0) / max(abs(nu).max(), TINY)
        order = np.argsort(-abs(nu), kind="stable")
        order = order[abs(nu[order]) > noise[order]]
        return Eigenpairs(nu[order], right[:, order], noise[order], error[order], left[order])

    def greatest(self, number: int, *, left: bool = False) -> Eigenpairs:
        """The ``number`` greatest of ``T``, or of ``T^t`` (``left``), or all finite ones if these are fewer.

        By LAPACK where it costs no more, or SLEPc gives up: at times it cannot sort equal complex ones.
        """
        if self.rank > max(80, 3 * number):
            try:
                return self._nearest(number, left=left)
            except ConvergenceError:
                if self.rank > ALL:
                    raise
        return (self.pairs._replace(right=self.pairs.left.T) if left else self.pairs).at(slice(number))

    def _nearest(self, number: int, *, left: bool) -> Eigenpairs:
        """The same by SLEPc; raises :class:`ConvergenceError` where it gives up."""
        first, last, solve = self.lower, self.dual, self.solve
        if left:
            first, last, solve = self.dual, self.lower, self.solve_transposed
        nu, w = krylov(lambda w: last.T @ solve(self.spread(w[:, None], first))[self.heavy, 0], self.rank, number)
        order = np.argsort(-abs(nu), kind="stable")[:number]
        error, noise = np.full(len(nu), TOLERANCE), np.full(len(nu), TOLERANCE * abs(nu).max())
        return Eigenpairs(nu, w, noise, error).at(order[abs(nu[order]) > noise[order]])

    def eigenvalues(self, pairs: Eigenpairs) -> np.ndarray:
        """Eigenvalues ``mu`` (k,) in natural units without imaginary parts that are noise."""
        values, size = self.shift + 1.0 / pairs.nu, abs(pairs.nu)
        return np.where(abs(values.imag) * size <= pairs.noise / size, values.real, values).astype(complex)

    def vectors(self, pairs: Eigenpairs, *, left: bool = False) -> np.ndarray:
        """Vectors (n, k) of the pencil for those of ``T``, or ``left`` ones: ``z.S = mu z.M`` without conjugation."""
        nu, w = pairs.nu, pairs.right
        if pairs.vectors is not None:
            return pairs.vectors
        if not left and "images" in vars(self):
            return times(self.images, w) / nu
        given = self.spread(w, self.dual if left else self.lower)
        solve = self.solve_transposed if left else self.solve
        if not np.iscomplexobj(given):
            return solve(given) / nu
        re, im = np.hsplit(solve(np.concatenate([given.real, given.imag], axis=1)), 2)
        return (re + 1j * im) / nu

    # --- eigenvalues of the pencil -----------------------------------------------------------------------------

    @cached_property
    def right(self) -> np.ndarray:
        """Vectors (h, k) of all eigenvalues in the rows with mass."""
        pairs = self.pairs
        return times(self.inverse, pairs.right) / pairs.nu if pairs.vectors is None else pairs.vectors[self.heavy]

    def coordinates(self, other: Spectrum) -> np.ndarray:
        """Vectors (r, k) of another state's eigenvalues in coordinates in which the mass of this state is one."""
        return times(self.dual.T, other.right)

    @cached_property
    def noise(self) -> np.ndarray:
        """What round-off may make of each eigenvalue (k,)."""
        return self.one * self.pairs.noise / abs(self.pairs.nu) ** 2

    @property
    def values(self) -> np.ndarray:
        """Eigenvalues (k,), complex; imaginary parts that are round-off, by the floor, are zero."""
        if self.floor not in self._known:
            values = self.one * (self.shift + 1.0 / self.pairs.nu)
            least = np.maximum(REAL * np.maximum(abs(values), min(self.one, self.floor)), self.noise)
            self._known[self.floor] = np.where(abs(values.imag) <= least, values.real, values).astype(complex)
            self._known[self.floor].setflags(write=False)
        return self._known[self.floor]

    @property
    def zero(self) -> float:
        """Magnitude below which an eigenvalue counts as zero."""
        return size_of_zero(self.values, self.one, self.floor)

    @property
    def negative(self) -> np.ndarray:
        """Places (m,) of the real ones that are negative."""
        values = self.values
        return np.flatnonzero((values.imag == 0.0) & (values.real < -np.maximum(self.zero, self.noise)))

    @property
    def upper(self) -> np.ndarray:
        """Places (m,) of those of positive imaginary part, one of each complex pair."""
        return np.flatnonzero(self.values.imag > 0.0)

    @property
    def growing(self) -> np.ndarray:
        """Places (m,) of the complex pairs of which one grows: all, but of rates those of a negative real part."""
        upper = self.upper
        return upper if self.order == 2 else upper[self.values[upper].real < -np.maximum(self.zero, self.noise[upper])]

    @property
    def numbers(self) -> tuple[int, int]:
        """Numbers of negative eigenvalues and of growing pairs."""
        return len(self.negative), len(self.growing)

    @property
    def unstable(self) -> int:
        """Number of unstable eigenvalues: negative ones, and growing pairs."""
        return len(self.negative) + 2 * len(self.growing)


def size_of_zero(values: np.ndarray, one: float, floor: float) -> float:
    """Magnitude below which one of some ``values``, of natural size ``one``, is zero; round-off is the ``floor``."""
    least = REAL * float(abs(values).min(initial=np.inf))
    return min(max(REAL * one, least), max(floor, least))


def inside(basis: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Shares (k,) of ``vectors`` (r, k) in the span of a real ``basis`` (r, m)."""
    parts = np.linalg.qr(basis)[0].T @ vectors
    return np.asarray((abs(parts) ** 2).sum(axis=0) / np.maximum((abs(vectors) ** 2).sum(axis=0), TINY))


def times(matrix: Matrix, w: np.ndarray) -> np.ndarray:
    """Product of a real matrix (n, r) with ``w`` (r, k), real or complex, in real arithmetic."""
    if not np.iscomplexobj(w):
        return np.asarray(matrix @ w)
    parts = np.ascontiguousarray(w).view(float)  # real and imaginary parts in turn
    return np.ascontiguousarray(matrix @ parts).view(complex)


class _Operator:
    """A real matrix that is known by its products, as PETSc's python matrices ask for it."""

    def __init__(self, apply: Solve) -> None:
        self.apply = apply

    def mult(self, matrix: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """``y = T x``."""
        values = x.array_r
        y.array[:] = self.apply(values.real)
        if np.iscomplexobj(values):
            y.array[:] += 1j * self.apply(values.imag)


def krylov(apply: Solve, size: int, number: int, start: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """The ``number`` greatest eigenvalues, and vectors, of a real matrix (``size``, ``size``) known by ``apply``."""
    matrix = PETSc.Mat().createPython((size, size), _Operator(apply), comm=PETSc.COMM_SELF)
    matrix.setUp()
    solver = SLEPc.EPS().create(PETSc.COMM_SELF)
    solver.setOptionsPrefix("rodfem_")
    solver.setOperators(matrix)
    solver.setProblemType(SLEPc.EPS.ProblemType.NHEP)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.LARGEST_MAGNITUDE)
    solver.setDimensions(number, min(2 * number + 20, size))
    solver.setTolerances(tol=TOLERANCE, max_it=300)
    solver.setFromOptions()
    re, im = matrix.createVecs()
    if start is not None:
        re.array[:] = start
        solver.setInitialSpace([re])
    try:
        with slepc_errors():
            solver.solve()
    except PETSc.Error as trouble:
        why = str(trouble).splitlines()[-1]
        raise ConvergenceError(f"SLEPc found no eigenvalues ({why}): use another mesh.") from trouble
    nu, columns = list[complex](), list[np.ndarray]()
    for i in range(solver.getConverged()):
        nu.append(complex(solver.getEigenpair(i, re, im)))
        columns.append(re.array_r + (0.0 if np.iscomplexobj(re.array_r) else 1j * im.array_r))
    solver.destroy()
    matrix.destroy()
    if not nu:
        raise ConvergenceError("SLEPc found no eigenvalue: use a richer discretisation.")
    return np.array(nu), np.stack(columns, axis=1)

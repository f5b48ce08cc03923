"""Eigenvalues by reduction: the pencil of a state on the null space of its constraints, and by the Cayley transform.

With ``C = (Q1 Q2) (R; 0)`` from :mod:`rodfem.kumar_healey.null_space`, the perturbations that fulfil the constraints
are ``x = Q2 z``, and the singular pencil ``(K C; C^t 0), (M 0; 0 0)`` of size m + p becomes

    Q2^t K Q2 z = mu Q2^t M Q2,        of size m - p,

whose finite eigenvalues are those of the former, without its 2p infinite ones (Kumar & Healey 2010, (21)-(32)).

A Krylov space of the inverse of the shifted matrix, ``A = K - sigma M``, finds those nearest to ``sigma``:

    T = (Q2^t A Q2)^-1 Q2^t M Q2,        T z = z / (mu - sigma).

The inverse is a block of that of a sparse saddle point matrix (``inverse="saddle"``):

    ( A    C ) ( x )   ( Q2 b )
    ( C^t  0 ) ( y ) = (  0   ),        (Q2^t A Q2)^-1 b = Q2^t x:

the second row puts x in the kernel, Q2^t times the first is Q2^t A Q2 z = b.  It holds if C has full rank and sigma is
no eigenvalue, also if A itself is singular.  Elimination of x, (32) (``inverse="elimination"``),

    (Q2^t A Q2)^-1 = Q2^t [A^-1 - A^-1 C (C^t A^-1 C)^-1 C^t A^-1] Q2,

factors A alone and needs p solves and a dense p x p matrix more: for a few integral constraints.  It fails if A is
singular although the reduced matrix is not: in the pointwise formulation without mass (``rho_A = 0``) or with
sigma = 0, where A has no entry for the centreline, and if sigma is an eigenvalue of the unconstrained pencil.

The Cayley transform ``(mu - a2) / (mu - a1)`` with ``a1 = (mu1 + mu2) / 2`` and ``a2 = 2 mu2 - a1`` is 3 at the first
eigenvalue, -1 at the second, and less than one in size beyond: the first dominates.  Along a branch the two are
estimated by those of the point before.  It belongs to the matrix

    (K - a1 M)^-1 (K - a2 M) = 1 + (a1 - a2) (K - a1 M)^-1 M,

whose Krylov spaces are those of ``(K - a1 M)^-1 M`` for any ``a2``: shift-invert with the shift ``a1``.
Every rank has the whole matrices and computes the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from petsc4py import PETSc
from scipy.sparse.linalg import splu

from rodfem.errors import ConvergenceError
from rodfem.kumar_healey.coordinates import Coordinates, MappedPencil
from rodfem.kumar_healey.null_space import kernel
from rodfem.linalg.orthogonal import generic
from rodfem.stability.assessment import Assessor, Eigenvalues, Method, SymmetricMethod
from rodfem.stability.pencil import scale_in_units
from rodfem.stability.spectrum import FINITE, krylov

Solve = Callable[[np.ndarray], np.ndarray]


class Reduced(NamedTuple):
    """Eigenvalues by their real parts and vectors of a pencil; real for a symmetric one."""

    values: np.ndarray  # (k,)
    vectors: np.ndarray  # Q2 z, (m, k), in the pencil's coordinates
    errors: np.ndarray  # |Q2^t (K - mu M) x| / ((|K| + |mu| |M|) |x|), (k,)


class ReducedPencil:
    """The reduced eigenproblem of a pencil: blocks ``K``, ``C``, ``M`` and the ``kernel`` of ``C^t``."""

    def __init__(self, pencil: MappedPencil, inverse: str = "saddle") -> None:
        """Factor ``C``; raises :class:`InputError` for dependent constraints."""
        self.inverse, self.symmetric = inverse, pencil.symmetric
        self.K, self.C, self.M = pencil.K, pencil.C, pencil.M
        self.kernel = kernel(self.C, pencil.place)

    def nearest(self, number: int, target: float) -> Reduced:
        """Return the ``number`` eigenvalues nearest to ``target``; :class:`ConvergenceError` if fewer are found."""
        n, solve = self.kernel.dimension, self.solver(target)

        def T(z: np.ndarray) -> np.ndarray:
            return self.kernel.project(solve(self.M @ self.kernel.expand(z)))

        start = T(generic(np.arange(n)))  # no massless part
        # a Krylov space has the second of two equal eigenvalues late: more are sought
        nu, z = krylov(T, n, min(number + 14, n), start)
        finite = abs(nu) > FINITE * abs(nu).max()
        nu, vectors = nu[finite], self.kernel.expand(z[:, finite])
        if self.symmetric:  # round-off may make a complex pair of a double eigenvalue: its parts span the same plane
            nu, vectors = self._ritz(np.where(nu.imag < 0, vectors.imag, vectors.real), solve)
        values = target + 1.0 / nu
        if len(values) < number:
            raise ConvergenceError(
                f"{len(values)} of {number} eigenvalues near {target:g} were found: ask for fewer, or elsewhere."
            )
        distance = abs(values - target)
        nearest = np.lexsort((values.real, np.round(distance / distance.max(), 9)))[:number]
        order = nearest[np.lexsort((values[nearest].imag, values[nearest].real))]
        return Reduced(values[order], vectors[:, order], self._errors(values[order], vectors[:, order]))

    def _ritz(self, vectors: np.ndarray, solve: Solve) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues of ``T`` and vectors, orthonormal in M, of a symmetric pencil in the span of vectors (m, k)."""
        masses = self.M @ vectors
        squares, turn = np.linalg.eigh((vectors.T @ masses + masses.T @ vectors) / 2)
        kept = squares > 1e-10 * squares.max(initial=0.0)  # others depend on these
        turn = turn[:, kept] / np.sqrt(squares[kept])
        compliance = turn.T @ (masses.T @ solve(masses)) @ turn
        nu, inner = np.linalg.eigh((compliance + compliance.T) / 2)
        return nu, vectors @ turn @ inner

    def _errors(self, values: np.ndarray, vectors: np.ndarray) -> np.ndarray:
        """Backward errors (k,) of eigenpairs."""
        residuals = np.linalg.norm(self.kernel.project(self.K @ vectors - (self.M @ vectors) * values), axis=0)
        stiffness, mass = (float(abs(matrix).sum(axis=1).max()) for matrix in (self.K, self.M))
        return np.asarray(residuals / ((stiffness + abs(values) * mass) * np.linalg.norm(vectors, axis=0)))

    def solver(self, sigma: float) -> Solve:
        """What makes of b (m, ...) the ``x`` in the kernel with ``Q2^t (K - sigma M) x = Q2^t b``."""
        m, p = self.C.shape
        shifted = self.K - sigma * self.M
        if self.inverse == "elimination":
            return self._elimination(shifted, sigma)
        saddle = sp.bmat([[shifted, self.C], [self.C.T, None]]) if p else shifted
        try:
            lu = splu(saddle.tocsc())
        except RuntimeError as trouble:
            raise ConvergenceError("The shifted matrix is singular: change the shift, look elsewhere.") from trouble
        return lambda b: lu.solve(np.concatenate([b, np.zeros((p, *b.shape[1:]))]))[:m]

    def _elimination(self, shifted: sp.csr_matrix, sigma: float) -> Solve:
        """The same by (32) of the paper."""
        singular = ConvergenceError(
            f"K - sigma M is singular at sigma = {sigma:g} without the constraints: use the inverse 'saddle'."
        )
        try:
            lu = splu(shifted.tocsc())
        except RuntimeError:
            raise singular from None
        columns = self.C.toarray()
        border = lu.solve(columns)
        if not abs(shifted @ border - columns).max() < 1e-6 * abs(columns).max():  # the residual of a solve
            raise singular
        capacitance = scipy.linalg.lu_factor(columns.T @ border)

        def solve(b: np.ndarray) -> np.ndarray:
            x = lu.solve(b)
            return np.asarray(x - border @ scipy.linalg.lu_solve(capacitance, columns.T @ x))

        return solve


class Reduction(Method):
    """A Krylov space of the reduced pencil."""

    def __init__(self, work: Assessor) -> None:
        super().__init__(work)
        self.coordinates = Coordinates(work.system)

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """With a shift below the spectrum."""
        below = self.work.low_pencil(x)
        found = self.reduced(x).nearest(number, below.shift)
        return self.lifted(found, below.certifies(found.values), 1)

    def nearest(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """With a shift near zero."""
        found = self.reduced(x).nearest(number, 1e-3 * scale_in_units(self.work.system))  # where it is singular at zero
        return Eigenvalues(self.work.one * found.values, [], found.errors, factorisations=1)

    def reduced(self, x: PETSc.Vec) -> ReducedPencil:
        """The reduced pencil at ``x``, symmetry modes left out."""
        return ReducedPencil(self.coordinates.without_modes(x))

    def lifted(self, found: Reduced, certified: bool, made: int, note: str = "") -> Eigenvalues:
        """What was ``found``, as vectors of the system in its units, with so many factorisations ``made``."""
        vectors = self.coordinates.lift(found.vectors)
        return Eigenvalues(self.work.one * found.values, vectors, found.errors, certified, made, note)


class Cayley(Reduction, SymmetricMethod):
    """Its shift is from estimates of the two left-most eigenvalues, or from those of the last state."""

    def __init__(self, work: Assessor) -> None:
        super().__init__(work)
        self._shift: float | None = None

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """With the shift of the last state; with a new one where a count finds some missing."""
        below, reduced = self.work.low_pencil(x), self.reduced(x)
        most, made = min(number + 2, reduced.kernel.dimension), 0
        for fresh in (False, True):
            if self._shift is None or fresh:
                self._shift, made = cayley_shift(reduced.nearest(3, below.shift).values), made + 1
            try:
                # the first two are equally far from the shift: more are asked for than wanted where they are multiple
                found, made = reduced.nearest(most, self._shift), made + 1
            except ConvergenceError:
                continue
            found = Reduced(found.values[:number], found.vectors[:, :number], found.errors[:number])
            if below.certifies(found.values):
                certified, note = True, ""
                break
        else:
            found, made = reduced.nearest(number, below.shift), made + 1
            certified = below.certifies(found.values)
            note = ", but a count found some missing (equal eigenvalues): completed by shift-invert"
        if number > 1:
            self._shift = cayley_shift(found.values)
        return self.lifted(found, certified, made, note)


def cayley_shift(values: np.ndarray) -> float:
    """``a1``, the mean of the first of ascending ``values`` (k,), k > 0, and of the next that is not equal."""
    others = values[values > values[0] + 1e-3 * abs(values).max()]  # nearer ones are equal
    return float((values[0] + others[0]) / 2) if len(others) else float(values[0] + abs(values).max() / 4)

r"""Eigenvalues by reduction: the pencil of a state on the null space of its constraints.

With ``C = (Q1 Q2) (R; 0)`` from :mod:`rodfem.kumar_healey.null_space`, the perturbations that fulfil the constraints
are ``x = Q2 z``, and the singular pencil ``(K C; C^t 0), (M 0; 0 0)`` of size m + p becomes

    Q2^t K Q2 z = mu Q2^t M Q2 z,        of size m - p,

whose finite eigenvalues are those of the former, without its 2p infinite ones (Kumar & Healey 2010, (21)-(32)).

A Krylov space of the inverse of the shifted matrix, ``A = K - sigma M``, finds those nearest to ``sigma``:

    T = (Q2^t A Q2)^-1 Q2^t M Q2,        T z = z / (mu - sigma).

The inverse is a block of that of a sparse saddle point matrix:

    ( A    C ) ( x )   ( Q2 b )
    ( C^t  0 ) ( y ) = (  0   ),        (Q2^t A Q2)^-1 b = Q2^t x:

the second row puts x in the kernel, Q2^t times the first is Q2^t A Q2 z = b (``inverse="saddle"``).  It holds whenever
C has full rank and sigma is no eigenvalue, also where A itself is singular.  Elimination of x, (32),

    (Q2^t A Q2)^-1 = Q2^t [A^-1 - A^-1 C (C^t A^-1 C)^-1 C^t A^-1] Q2        (``inverse="elimination"``),

factors A alone and needs p solves and a dense p x p matrix more: for a few integral constraints.  It fails where A is
singular although the reduced matrix is not.  So it is in the pointwise formulation without mass (``rho_A = 0``) or with
sigma = 0, where A has no entry for the centreline at all, and where sigma is an eigenvalue of the unconstrained pencil.

Every rank has the whole matrices and computes the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from rodfem.errors import ConvergenceError, InputError
from rodfem.kumar_healey.coordinates import MappedPencil
from rodfem.kumar_healey.null_space import kernel
from rodfem.linalg.orthogonal import generic
from rodfem.stability.spectrum import FINITE, krylov

INVERSES = ("saddle", "elimination")
SPARE = 14
"""Eigenvalues that are sought beyond those wanted: a Krylov space has the second of two equal ones late."""
SINGULAR = 1e-6
"""Relative residual of a solve above which its matrix counts as singular."""
RANK = 1e-10
"""Square of a part, relative to the vector's, below which it depends on others."""

Solve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Reduced:
    """Eigenvalues ``values`` (k,) by their real parts, ``vectors`` ``Q2 z`` (m, k) in the pencil's coordinates.

    ``errors`` are backward errors ``|Q2^t (K - mu M) x| / ((|K| + |mu| |M|) |x|)``; real arrays for a symmetric pencil.
    """

    values: np.ndarray
    vectors: np.ndarray
    errors: np.ndarray


class Reduction:
    """The reduced eigenproblem of a pencil: blocks ``K``, ``C``, ``M`` and the ``kernel`` of ``C^t``."""

    def __init__(self, pencil: MappedPencil, inverse: str = "saddle") -> None:
        """Factor ``C``; raises :class:`InputError` for dependent constraints."""
        if inverse not in INVERSES:
            raise InputError(f"Unknown inverse {inverse!r}: choose one of {', '.join(INVERSES)}.")
        self.inverse, self.symmetric = inverse, pencil.symmetric
        self.K, self.C, self.M = pencil.K, pencil.C, pencil.M
        self.kernel = kernel(self.C, pencil.place)

    def near(self, number: int, target: float) -> Reduced:
        """Return the ``number`` eigenvalues nearest to ``target``, of equally near ones the left.

        With a target below the spectrum they are the left-most ones.  Raises :class:`InputError` for more eigenvalues
        than there are rows, :class:`ConvergenceError` where fewer are found, or where the shifted matrix is singular.
        """
        n = self.kernel.dimension
        if number > n:
            raise InputError(f"{number} eigenvalues of a reduced pencil of size {n}: ask for at most {n}.")
        solve = self.solver(target)

        def T(z: np.ndarray) -> np.ndarray:
            return self.kernel.project(solve(self.M @ self.kernel.expand(z)))

        start = T(generic(np.arange(n)))  # no massless part
        nu, z = krylov(T, n, min(number + SPARE, n), start)
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
        kept = squares > RANK * squares.max(initial=0.0)
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
        """What makes of b (m, ...) the ``x`` in the kernel with ``Q2^t (K - sigma M) x = Q2^t b``.

        Raises :class:`ConvergenceError` where the shifted matrix, or for elimination ``K - sigma M``, is singular.
        """
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
        if not self.C.shape[1]:
            return lambda b: lu.solve(b)
        columns = self.C.toarray()
        border = lu.solve(columns)
        if not abs(shifted @ border - columns).max() < SINGULAR * abs(columns).max():
            raise singular
        capacitance = scipy.linalg.lu_factor(columns.T @ border)

        def solve(b: np.ndarray) -> np.ndarray:
            x = lu.solve(b)
            return np.asarray(x - border @ scipy.linalg.lu_solve(capacitance, columns.T @ x))

        return solve

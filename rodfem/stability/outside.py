r"""A proof that no eigenvalue is missing: bounds of all that is outside of two invariant subspaces.

With bases ``X`` and ``Y`` of a right and a left invariant subspace of ``B = (S - a M)^-1 M``, and the projection ``P =
X N^-1 Y^t M``, ``N = Y^t M X``, the whole of ``B`` is, in the basis ``X`` and in the complement of ``Y``, ::

    ( T   R )        T = N^-1 Y^t M B X,           R = N^-1 Y^t M B (1 - P),
    ( E   C )        E = (1 - P) B X,              C = (1 - P) B (1 - P).

An eigenvalue ``nu`` that is greater than ``|C|`` is one of ``T + R (nu - C)^-1 E``, that is of ``T`` but for ``|R| |E|
/ (|nu| - |C|)``, a product of two residuals, times the condition of its eigenvectors (Bauer & Fike, Numer. Math. 2
(1960) 137).  While that is less than the distance of the eigenvalues of ``T`` from a circle outside of ``|C|``, none
enters the circle as ``E`` and ``R`` vanish: beyond it are as many eigenvalues of ``B`` as of ``T`` (Stewart & Sun,
Matrix Perturbation Theory, 1990, chapter IV).  That of Frobenius in the mass is a norm known from the inverse ``K`` of
``S - a M`` in the rows and columns that have mass: with ``C = K' M`` its square is the trace of ``M K'^t M K'``.
``|C^2|^(1/2)`` is a sharper bound.

Nothing here comes from what was followed but the two bases: ``K`` is solved for anew, column after column.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from rodfem.linalg.chain import Elimination

LARGEST = 400
"""Rows with mass above which the inverse costs more than to solve for the eigenvalues anew."""
SHARP = 0.5
"""The sharper bound is not computed where the other one is below this part of the least eigenvalue inside."""
MARGIN = 0.1
"""Part of the distance between the bound and the eigenvalues inside by which these may be in doubt."""


@dataclass(frozen=True)
class Enclosed:
    """Eigenvalues ``nu`` (p,) of ``T``, a bound of those ``outside``, and that of their doubt.

    The ``doubt`` is ``|R| |E|``, times the condition of the eigenvectors of ``T``.
    """

    nu: np.ndarray
    outside: float
    doubt: float

    def proves(self, number: int) -> bool:
        """Whether ``B`` has as many eigenvalues as the ``number`` greatest that are not less than the last of these."""
        gap = float(np.sort(abs(self.nu))[-number]) - self.outside
        return gap > 0.0 and self.doubt < (MARGIN * gap) ** 2


def enclosed(x: np.ndarray, y: np.ndarray, mass: sp.csr_matrix, factors: Elimination) -> Enclosed | None:
    """Enclose the eigenvalues of the bases ``x`` and ``y`` (n, p); None where too many rows have mass.

    The bases are about orthonormal in the ``mass``, and ``factors`` are those of ``S - a M``.  Raises
    :class:`numpy.linalg.LinAlgError` where ``N`` is singular.
    """
    found = inverse_with_mass(mass, factors.solve)
    if found is None:
        return None
    heavy, inverse, m = found
    x, y = x[heavy], y[heavy]
    x_image, y_image = m @ x, m @ y
    overlap, seen = y.T @ x_image, y_image.T @ inverse
    dual, share = np.linalg.solve(overlap, y.T), np.linalg.solve(overlap, seen)
    t = share @ x_image
    right = inverse @ x_image - x @ t
    left = share - t @ dual
    rest = inverse - x @ share - right @ dual
    nu, w = np.linalg.eig(t)
    residuals = _size(right.T @ (m @ right)) * _size(left @ (m @ left.T))
    outside = _frobenius(m, rest)
    if outside > SHARP * abs(nu).min():
        outside = min(outside, float(np.sqrt(_frobenius(m, rest @ (m @ rest)))))
    return Enclosed(nu, outside, residuals * float(np.linalg.cond(w)))


def inverse_with_mass(
    mass: sp.csr_matrix, solve: Callable[[np.ndarray], np.ndarray], largest: int = LARGEST
) -> tuple[np.ndarray, np.ndarray, sp.csr_matrix] | None:
    """Rows with mass (h,), the inverse that ``solve`` applies and the ``mass`` there (h, h).

    None for more rows than the ``largest`` number.
    """
    heavy, m = _heavy(mass)
    if len(heavy) > largest:
        return None
    units = np.zeros((mass.shape[0], len(heavy)), order="F")
    units[heavy, np.arange(len(heavy))] = 1.0
    return heavy, solve(units)[heavy], m


def _heavy(mass: sp.csr_matrix) -> tuple[np.ndarray, sp.csr_matrix]:
    """Rows with mass, and the mass in them alone."""
    n = mass.shape[0]
    entries = mass.data != 0
    rows, columns = np.repeat(np.arange(n), np.diff(mass.indptr))[entries], mass.indices[entries]
    heavy = np.flatnonzero(np.bincount(rows, minlength=n))
    place = np.zeros(n, dtype=int)
    place[heavy] = np.arange(len(heavy))
    shape = (len(heavy), len(heavy))
    return heavy, sp.csr_matrix((mass.data[entries], (place[rows], place[columns])), shape=shape)


def _size(products: np.ndarray) -> float:
    """Frobenius' norm of vectors with these products."""
    return float(np.sqrt(max(np.trace(products), 0.0)))


def _frobenius(m: sp.csr_matrix, k: np.ndarray) -> float:
    """Frobenius' norm of ``k m``, in ``m``."""
    return float(np.sqrt(max(((m @ k.T).T * (m @ k)).sum(), 0.0)))

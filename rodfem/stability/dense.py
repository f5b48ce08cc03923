"""Eigenvalues of small pencils of the saddle-point form by dense matrices, on the kernel of the constraints."""

from __future__ import annotations

import numpy as np
import scipy.linalg

from rodfem.errors import InputError
from rodfem.linalg.matrices import gathered
from rodfem.stability.blocks import Pencil

FINITE = 1e-13
"""Inverses of shifted eigenvalues below this, relative to the greatest, are those of infinite ones."""


def symmetric_eigenpairs(pencil: Pencil, below: float, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Left-most eigenvalues and vectors (m, k) of a small symmetric pencil, given a number below all of them.

    ``M z = nu (K - below M) z`` on the kernel of the constraints, ``mu = below + 1/nu``: the matrix on the right is
    positive definite there, and the infinite eigenvalues are ``nu = 0``.  Raises :class:`InputError` where fewer than
    ``number`` are finite.
    """
    nu, vectors = _inverted(pencil, below)
    _check_finite(nu, number)
    best = np.argsort(nu)[::-1][:number]
    return below + 1 / nu[best], vectors[:, best]


def check_number(pencil: Pencil, below: float, number: int) -> None:
    """Raise :class:`InputError` where a small symmetric pencil has fewer than ``number`` finite eigenvalues.

    ``below`` is a number below all of them.
    """
    _check_finite(_inverted(pencil, below)[0], number)


def _check_finite(nu: np.ndarray, number: int) -> None:
    """Raise :class:`InputError` where fewer than ``number`` of the inverted eigenvalues ``nu`` (k,) are not zero."""
    finite = int((nu > FINITE * nu.max()).sum())
    if number > finite:
        raise InputError(
            f"The rod has {finite} eigenvalues on this mesh, not {number}: give number={finite} or less, or use more "
            "elements."
        )


def _inverted(pencil: Pencil, below: float) -> tuple[np.ndarray, np.ndarray]:
    """Inverted eigenvalues ``nu`` in ascending order, and the vectors (m, k), of :func:`symmetric_eigenpairs`."""
    K, C, M = (gathered(A).toarray() for A in (pencil.K, pencil.C, pencil.M))
    Z = scipy.linalg.null_space(C.T) if C.shape[1] else np.eye(len(K))
    mass, shifted = Z.T @ M @ Z, Z.T @ (K - below * M) @ Z
    nu, z = scipy.linalg.eigh((mass + mass.T) / 2, (shifted + shifted.T) / 2)
    return nu, Z @ z


def eigenvalues_near(pencil: Pencil, target: float) -> np.ndarray:
    """All finite eigenvalues of a small pencil without symmetry, the more precise the nearer to ``target``.

    LAPACK's QZ algorithm finds ``nu`` of ``M z = nu (K - target M) z`` on the kernel of the constraints, and ``mu =
    target + 1/nu``; the infinite eigenvalues are ``nu = 0``.
    """
    K, C, M = (gathered(A).toarray() for A in (pencil.K, pencil.C, pencil.M))
    Z = scipy.linalg.null_space(C.T) if C.shape[1] else np.eye(len(K))
    above, under = scipy.linalg.eig(Z.T @ M @ Z, Z.T @ (K - target * M) @ Z, right=False, homogeneous_eigvals=True)
    finite = abs(above) > FINITE * abs(above / under).max() * abs(under)
    return np.asarray(target + under[finite] / above[finite])

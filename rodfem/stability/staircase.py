r"""All finite eigenvalues of a small singular pencil ``S x = mu M x`` of dense matrices, by orthogonal reductions.

``M`` is singular (multipliers and all else without inertia), and the infinite eigenvalues come in Jordan blocks, which
round-off turns into large finite ones.  They are removed before any eigenvalue is computed: with bases of the range and
the null space of ``M`` ::

    S = ( S11  S10 )      M = ( M11  0 )
        ( S01  S00 ),         (  0   0 ),

the regular part of ``S00`` is eliminated (static condensation), and each null vector of it is a multiplier with its
constraint ``H x1 = 0``, on whose null space the pencil is projected.  What remains is such a pencil again, of smaller
size, until ``M`` is regular: the staircase of Van Dooren, Linear Algebra Appl. 27 (1979) 103-140, with rank decisions
by singular values.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

from rodfem.tolerances import TINY

RANK = 1e-11
"""Singular values below this, relative to the norm of the pencil's matrices, are zero."""


def split(matrix: np.ndarray, norm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ``U1, s, V1, U0, V0`` with ``matrix = U1 diag(s) V1^t`` and null spaces ``U0^t``, ``V0``.

    Singular values are measured against ``norm``.
    """
    u, s, vt = np.linalg.svd(matrix)
    rank = int((s > RANK * norm).sum())
    return u[:, :rank], s[:rank], vt[:rank].T, u[:, rank:], vt[rank:].T


def kernel(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the null space of a matrix (m, n), of which m may be zero: LAPACK refuses that."""
    return np.asarray(scipy.linalg.null_space(matrix, rcond=RANK)) if matrix.size else np.eye(matrix.shape[1])


def finite_eigenpairs(S: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all finite eigenvalues (complex, sorted by magnitude) and their vectors (n, number).

    Multipliers that drop out of the reduction are zero in the vectors.  Empty for a pencil without inertia.  Raises
    :class:`numpy.linalg.LinAlgError` for a pencil that is singular at every shift.
    """
    stiffness, inertia = (max(float(np.linalg.norm(A, ord=2)), TINY) for A in (S, M))
    back = np.eye(len(S))
    while len(M):
        u1, _, v1, u0, v0 = split(M, inertia)
        if u0.shape[1] == 0:
            break
        p, regular, q, p0, q0 = split(u0.T @ S @ v0, stiffness)
        s01, s10 = u0.T @ S @ v1, u1.T @ S @ v0
        condensed = q @ ((p.T @ s01) / regular[:, None])
        s11 = u1.T @ S @ v1 - s10 @ condensed
        z, w = kernel(p0.T @ s01), kernel((s10 @ q0).T)
        if w.shape != z.shape:  # dependent constraints on one side only: the pencil has no definite eigenvalues
            raise np.linalg.LinAlgError("the pencil is singular for every mu")
        back = back @ ((v1 - v0 @ condensed) @ z)
        S, M = w.T @ s11 @ z, w.T @ u1.T @ M @ v1 @ z
    values, vectors = scipy.linalg.eig(np.linalg.solve(M, S)) if len(M) else (np.zeros(0), np.zeros((0, 0)))
    order = np.argsort(abs(values))
    return np.asarray(values[order], dtype=complex), back @ vectors[:, order]

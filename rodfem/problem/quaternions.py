"""Quaternions (..., 4) as arrays of numbers, scalar first; :mod:`rodfem.forms.rotation` has the same in UFL."""

from __future__ import annotations

import numpy as np

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])  # factors of the components that make the conjugate


def _euler_rodrigues() -> np.ndarray:
    """Coefficients of ``|q|^2 R`` and of ``|q|^2`` in the products ``q_i q_j``: (16, 10)."""
    out = np.zeros((4, 4, 10))
    for i in range(4):
        out[i, i, 9] = 1.0
        out[i, i, [0, 4, 8]] = [1.0 if i in (0, k + 1) else -1.0 for k in range(3)]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):  # R_ij = 2 (q_i q_j - q_0 q_k), R_ji = 2 (q_i q_j + q_0 q_k)
        out[i + 1, j + 1, [3 * i + j, 3 * j + i]] = 2.0
        out[0, k + 1, [3 * i + j, 3 * j + i]] = -2.0, 2.0
    return out.reshape(16, 10)


EULER_RODRIGUES = _euler_rodrigues()


def _hamilton() -> np.ndarray:
    """Coefficients of the components of ``p q`` in the products ``p_i q_j``: (16, 4)."""
    out = np.zeros((4, 4, 4))
    out[0, range(4), range(4)] = out[range(4), 0, range(4)] = 1.0
    out[range(1, 4), range(1, 4), 0] = -1.0
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        out[i, j, k], out[j, i, k] = 1.0, -1.0
    return out.reshape(16, 4)


HAMILTON = _hamilton()


def directors(q: np.ndarray) -> np.ndarray:
    """Rotation matrices of quaternions (..., 4) of any length: (..., 3, 3)."""
    q = np.asarray(q)
    table = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16) @ EULER_RODRIGUES
    return np.asarray((table[..., :9] / table[..., 9:]).reshape(*q.shape[:-1], 3, 3))


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Products ``p q``: the rotation ``q`` in the frame turned by ``p``."""
    pairs = p[..., :, None] * q[..., None, :]
    return np.asarray(pairs.reshape(*pairs.shape[:-2], 16) @ HAMILTON)


def of_vector(vector: np.ndarray) -> np.ndarray:
    """Unit quaternions of rotation vectors (..., 3)."""
    size = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([np.cos(size / 2), vector * np.sinc(size / (2 * np.pi)) / 2], axis=-1)

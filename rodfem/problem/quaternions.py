"""Quaternions (..., 4) as arrays of numbers, scalar first; :mod:`rodfem.forms.rotation` has the same in UFL."""

from __future__ import annotations

import numpy as np

CONJUGATE = np.array([1.0, -1.0, -1.0, -1.0])  # factors of the components that make the conjugate


def _coefficients() -> tuple[np.ndarray, np.ndarray]:
    """Of ``p q`` in the products ``p_i q_j``, (16, 4), and of ``|q|^2 R`` in ``q_a q_b``, (16, 9)."""
    out = np.zeros((4, 4, 4))
    out[0, range(4), range(4)] = out[range(4), 0, range(4)] = 1.0
    out[range(1, 4), range(1, 4), 0] = -1.0
    for i, j, k in ((1, 2, 3), (2, 3, 1), (3, 1, 2)):
        out[i, j, k], out[j, i, k] = 1.0, -1.0
    columns = np.einsum("ajk,kbi->abij", out[:, 1:], out[:, :, 1:] * CONJUGATE[:, None])  # q e_j q*
    return out.reshape(16, 4), columns.reshape(16, 9)


HAMILTON, EULER_RODRIGUES = _coefficients()


def directors(q: np.ndarray) -> np.ndarray:
    """Rotation matrices of quaternions (..., 4) of any length: (..., 3, 3)."""
    q = np.asarray(q)
    pairs = (q[..., :, None] * q[..., None, :]).reshape(*q.shape[:-1], 16)
    squares = np.sum(q * q, axis=-1, keepdims=True)
    return np.asarray((pairs @ EULER_RODRIGUES / squares).reshape(*q.shape[:-1], 3, 3))


def product(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Products ``p q``: the rotation ``q`` in the frame turned by ``p``."""
    pairs = p[..., :, None] * q[..., None, :]
    return np.asarray(pairs.reshape(*pairs.shape[:-2], 16) @ HAMILTON)


def of_vector(vector: np.ndarray) -> np.ndarray:
    """Unit quaternions of rotation vectors (..., 3)."""
    size = np.linalg.norm(vector, axis=-1, keepdims=True)
    return np.concatenate([np.cos(size / 2), vector * np.sinc(size / (2 * np.pi)) / 2], axis=-1)

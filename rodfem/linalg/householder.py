"""Stacks of small orthogonal matrices as products of Householder reflections, all applied at once.

In compact WY form, ``I - V T V^t`` with T upper triangular: R. Schreiber & C. Van Loan, SIAM J. Sci. Stat. Comput. 10
(1989) 53-57.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Reflections:
    """A stack of b orthogonal matrices ``I - V T V^t``, each on its own rows: rows (b, r), V (b, r, c), T (b, c, c)."""

    rows: np.ndarray
    V: np.ndarray
    T: np.ndarray

    def apply(self, x: np.ndarray, *, transposed: bool) -> None:
        """Multiply ``x`` (m,) or (m, w) by all of them, in place."""
        part = x[self.rows].reshape(*self.rows.shape, -1)
        T = np.swapaxes(self.T, 1, 2) if transposed else self.T
        part -= self.V @ (T @ (np.swapaxes(self.V, 1, 2) @ part))
        x[self.rows] = part.reshape(*self.rows.shape, *x.shape[1:])


def factor(rows: np.ndarray, blocks: np.ndarray) -> tuple[Reflections, np.ndarray]:
    """Q-R factorisations of a stack of matrices (b, r, c): the reflections and the factors R (b, min(r, c), c)."""
    h, tau = np.linalg.qr(blocks, mode="raw")
    h = np.swapaxes(h, 1, 2)
    size = tau.shape[1]
    V = np.tril(h[:, :, :size], -1)
    V[:, np.arange(size), np.arange(size)] = 1.0
    V *= (tau != 0)[:, None, :]
    inverse = np.triu(np.swapaxes(V, 1, 2) @ V, 1)
    inverse[:, np.arange(size), np.arange(size)] = 1.0 / np.where(tau != 0, tau, 1.0)
    return Reflections(rows, V, np.linalg.inv(inverse)), np.triu(h[:, :size, :])

r"""Orthonormal basis of the null space of the constraints, in factored form.

A full Q-R factorisation ``C = (Q1 Q2) (R; 0)`` of the constraints' gradients ``C`` (m, p) gives in ``Q2`` (m, m - p) an
orthonormal basis of the kernel of ``C^t``.  ``Q`` is a product of stacks of small orthogonal matrices, each on rows of
its own; no matrix of size m x m is ever made.

* Sparse columns (pointwise constraints), in groups along the rod such that a row couples two neighbouring groups at
  most: cyclic reduction.  The rows between two groups are a *link*.  A link with more rows than it couples columns is
  compressed to as many: the others couple nothing any more, and belong to ``Q2``.  Then every second group is
  eliminated by the rows of its two links; what is left of these is the link between the groups that remain.  Each level
  halves their number, the sum over levels is O(m).  The chain of Givens rotations along the rod of Kumar & Healey
  (2010) needs m consecutive steps for the same work.
* Dense columns (integral constraints), in the kernel of the sparse ones: one Q-R factorisation, products in O(m p).

All groups are made equally wide, and as many as cyclic reduction takes, ``2^k - 1``: a column more has a row of its own
more, which eliminates it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from scipy.linalg.lapack import dormqr

from rodfem.errors import InputError
from rodfem.tolerances import NEGLIGIBLE

NO_REFLECTIONS = np.zeros((0, 0)), np.zeros(0)
Step = tuple[np.ndarray, np.ndarray]
"""Rows (b, r) of a stack of orthogonal matrices, and these (b, r, r)."""


@dataclass(frozen=True)
class Kernel:
    """Basis ``Q2`` (m, m - p) of the kernel of ``C^t``."""

    size: int  # m
    padded: int  # with rows added
    steps: list[Step]  # the factors of Q, first to last
    free: np.ndarray  # rows (k,) on which the kernel of the sparse columns lives
    reflections: tuple[np.ndarray, np.ndarray]  # dgeqrf's factorisation of the dense columns there, and scalars

    @property
    def dimension(self) -> int:
        """Dimension of the kernel."""
        return len(self.free) - len(self.reflections[1])

    def expand(self, z: np.ndarray) -> np.ndarray:
        """``Q2 z`` for ``z`` (m - p,) or (m - p, w)."""
        columns = z.reshape(len(z), -1)
        x = np.zeros((self.padded, columns.shape[1]), dtype=z.dtype)
        dense = np.zeros((len(self.free) - len(z), columns.shape[1]))
        x[self.free] = self._reflected(np.concatenate([dense, columns]), "N")
        for rows, Q in reversed(self.steps):
            x[rows] = Q @ x[rows]
        return x[: self.size].reshape(self.size, *z.shape[1:])

    def project(self, x: np.ndarray) -> np.ndarray:
        """``Q2^t x`` for ``x`` (m,) or (m, w)."""
        z = self._on_free_rows(x.reshape(self.size, -1))
        z = self._reflected(z, "T")[len(self.reflections[1]) :]
        return z.reshape(len(z), *x.shape[1:])

    def _on_free_rows(self, x: np.ndarray) -> np.ndarray:
        """Coordinates (k, w) of ``x`` (m, w) in the kernel of the sparse columns."""
        x = np.concatenate([x, np.zeros((self.padded - self.size, x.shape[1]))])
        for rows, Q in self.steps:
            x[rows] = np.swapaxes(Q, 1, 2) @ x[rows]
        return x[self.free]

    def _reflected(self, x: np.ndarray, trans: str) -> np.ndarray:
        """``Q x`` of the dense columns (``trans`` N), or ``Q^t x`` (T), for real or complex ``x`` (k, w)."""
        if not len(self.reflections[1]):
            return x
        if np.iscomplexobj(x):
            return self._reflected(x.real, trans) + 1j * self._reflected(x.imag, trans)
        return np.asarray(dormqr("L", trans, *self.reflections, x, max(1, 64 * x.shape[1]))[0])


def kernel(C: sp.spmatrix, place: np.ndarray) -> Kernel:
    """Kernel of ``C^t``, for ``C`` (m, p) and arclengths ``place`` (p,) of groups of columns, nan for a dense one."""
    C = sp.csr_matrix(C, copy=True)
    m = C.shape[0]
    scale = float(abs(C.data).max()) if C.nnz else 1.0
    C.data[abs(C.data) < NEGLIGIBLE * scale] = 0.0
    C.eliminate_zeros()
    dense = np.isnan(place)
    found = Kernel(m, m, [], np.arange(m), NO_REFLECTIONS)
    if (~dense).any():
        group = np.unique(place[~dense], return_inverse=True)[1]
        found = _eliminated(C[:, ~dense].tocsr(), group, scale)
    if dense.any():
        (h, tau), R = scipy.linalg.qr(found._on_free_rows(C[:, dense].toarray()), mode="raw")
        _require_independent(R[None], scale)
        found = Kernel(m, found.padded, found.steps, found.free, (h, tau))
    return found


def _eliminated(C: sp.csr_matrix, group: np.ndarray, scale: float) -> Kernel:
    """Kernel of sparse columns ``C`` (m, p), each of a ``group`` (p,), the largest entry of which is ``scale``."""
    rows, left, right, empty = _links(C, group, scale)
    width, steps, free = left.shape[2], list[Step](), [np.setdiff1d(np.arange(C.shape[0]), rows)]
    padded = int(rows.max()) + 1
    while True:
        if rows.shape[1] > 2 * width:
            Q, R = np.linalg.qr(np.concatenate([left, right], axis=2), mode="complete")
            steps.append((rows, Q))
            free.append(rows[:, 2 * width :].ravel())
            rows, left, right = rows[:, : 2 * width], R[:, : 2 * width, :width], R[:, : 2 * width, width:]
        if len(rows) == 1:
            break
        rows = np.concatenate([rows[::2], rows[1::2]], axis=1)
        order = np.argsort(rows, axis=1)  # the empty rows last: no others are rotated into them
        rows, zero = np.take_along_axis(rows, order, axis=1), np.zeros_like(left[::2])
        middle, left, right = (
            np.take_along_axis(np.concatenate(parts, axis=1), order[:, :, None], axis=1)
            for parts in ((right[::2], left[1::2]), (left[::2], zero), (zero, right[1::2]))
        )
        Q, R = np.linalg.qr(middle, mode="complete")
        _require_independent(R, scale)
        steps.append((rows, Q))
        rows, across = rows[:, width:], np.swapaxes(Q[:, :, width:], 1, 2)
        left, right = across @ left, across @ right
    every = np.concatenate([*free, rows.ravel()])
    return Kernel(C.shape[0], padded, steps, every[every < empty], NO_REFLECTIONS)


def _links(C: sp.csr_matrix, group: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Rows (links, rows) of each link, what they couple on its left and right (links, rows, width), and a number."""
    m, width = C.shape[0], int(np.bincount(group).max())
    groups = 2 ** int(np.ceil(np.log2(group.max() + 2))) - 1
    order = np.argsort(group, kind="stable")
    within = np.empty(len(order), dtype=int)
    within[order] = np.arange(len(order)) - np.searchsorted(group[order], group[order])
    missing, column = np.nonzero(np.arange(width) >= np.bincount(group, minlength=groups)[:, None])
    entries = C.tocoo()
    row = np.append(entries.row, m + np.arange(len(missing)))
    of_entry, column = np.append(group[entries.col], missing), np.append(within[entries.col], column)
    data = np.append(entries.data, np.full(len(missing), scale))
    used, row = np.unique(row, return_inverse=True)
    first, last = np.full(len(used), groups), np.zeros(len(used), dtype=int)
    np.minimum.at(first, row, of_entry)
    np.maximum.at(last, row, of_entry)
    if (last - first).max() > 1:
        raise InputError("A row of C couples constraints of more than two neighbouring groups: make larger groups.")
    link = np.where(last == 0, 0, first + 1)  # what couples the first group alone stands before it
    sequence, counts = np.argsort(link, kind="stable"), np.bincount(link, minlength=groups + 1)
    place = np.empty(len(used), dtype=int)
    place[sequence] = np.arange(len(used)) - (np.cumsum(counts) - counts)[link[sequence]]
    shape = groups + 1, int(counts.max())
    empty = m + len(missing)
    rows = empty + np.arange(shape[0] * shape[1]).reshape(shape)
    rows[link, place] = used
    left, right = np.zeros((*shape, width)), np.zeros((*shape, width))
    for table, chosen in ((left, of_entry < link[row]), (right, of_entry == link[row])):
        table[link[row[chosen]], place[row[chosen]], column[chosen]] = data[chosen]
    return rows, left, right, empty


def _require_independent(R: np.ndarray, scale: float) -> None:
    """Raise :class:`InputError` if a factor R (b, r, c) of columns with entries up to ``scale`` is singular."""
    if R.shape[1] < R.shape[2] or (abs(np.diagonal(R, axis1=1, axis2=2)) < NEGLIGIBLE * scale).any():
        raise InputError("Constraints depend on one another: remove those that follow from the others.")

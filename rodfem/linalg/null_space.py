r"""Orthonormal bases of the null space of the constraints, in factored form.

A full Q-R factorisation ``C = (Q1 Q2) (R; 0)`` of the constraints' gradients ``C`` (m, p) gives in ``Q2`` (m, m - p) an
orthonormal basis of the kernel of ``C^t``.  It is kept as Householder reflections, and no matrix of size m x m is ever
made.  Stacks of small ones are applied at once, in compact WY form, ``I - V T V^t`` with T upper triangular: R.
Schreiber & C. Van Loan, SIAM J. Sci. Stat. Comput. 10 (1989) 53-57.

* Dense columns (integral constraints): one block of reflections over all rows, products in O(m p).
* Sparse columns (pointwise constraints), in groups along the rod such that a row couples two neighbouring groups at
  most: cyclic reduction.  The rows between two groups, compressed to as many as they couple columns, are a *link*.
  Every second group is eliminated from its two links by a Q-R factorisation of their rows; what is left of them is
  compressed, and is the link between the groups that remain.  Each level halves their number, all its small
  factorisations are one call, the sum over levels is O(m).  The chain of Givens rotations along the rod of Kumar &
  Healey (2010) needs m consecutive steps for the same work.  Rows that couple nothing any more belong to ``Q2``.

Dense columns are treated after the sparse ones, in the kernel of these.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from rodfem.errors import InputError
from rodfem.tolerances import NEGLIGIBLE


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


@dataclass
class Kernel:
    """Orthonormal basis ``Q2`` (m, m - p) of the kernel of ``C^t``.

    Attributes
    ----------
    size, dimension
        ``m`` and ``m - p``.
    steps
        Reflections whose product is ``Q``, first to last.
    free
        Rows on which the coordinates of the kernel live between the reflections, (m - p,).
    """

    size: int
    steps: list[Reflections] = field(default_factory=list)
    free: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))

    @property
    def dimension(self) -> int:
        """Dimension of the kernel."""
        return len(self.free)

    @property
    def memory(self) -> int:
        """Bytes that the reflections occupy."""
        return sum(a.nbytes for s in self.steps for a in (s.rows, s.V, s.T))

    def expand(self, z: np.ndarray) -> np.ndarray:
        """``Q2 z`` for ``z`` (m - p,) or (m - p, w)."""
        x = np.zeros((self.size, *z.shape[1:]), dtype=z.dtype)
        x[self.free] = z
        for step in reversed(self.steps):
            step.apply(x, transposed=False)
        return x

    def project(self, x: np.ndarray) -> np.ndarray:
        """``Q2^t x`` for ``x`` (m,) or (m, w)."""
        x = x.copy()
        for step in self.steps:
            step.apply(x, transposed=True)
        return x[self.free]


def kernel(C: sp.spmatrix, place: np.ndarray) -> Kernel:
    """Kernel of ``C^t``, for ``C`` (m, p) and the arclengths of its columns' groups (p,), nan for a dense column.

    Raises :class:`InputError` where a constraint depends on the others, or where there are more than unknowns.
    """
    C = sp.csr_matrix(C, copy=True)
    m, p = C.shape
    if p > m:
        raise InputError(f"{p} constraints on {m} unknowns leave no free unknown: use fewer constraints.")
    scale = float(abs(C.data).max()) if C.nnz else 1.0
    C.data[abs(C.data) < NEGLIGIBLE * scale] = 0.0
    C.eliminate_zeros()
    dense = np.isnan(place)
    found = Kernel(m)
    if (~dense).any():
        Chain(C[:, ~dense].tocsr(), np.unique(place[~dense], return_inverse=True)[1], scale, found).eliminate()
    else:
        found.free = np.arange(m)
    if dense.any():
        columns = found.project(C[:, dense].toarray())
        count = columns.shape[1]
        if count > len(found.free):
            raise InputError(f"{p} constraints on {m} unknowns leave no free unknown: use fewer constraints.")
        reflections, R = factor(found.free[None, :], columns[None])
        require_independent(R, scale, int((~dense).sum()) + np.arange(count)[None])
        found.steps.append(reflections)
        found.free = found.free[count:]
    return found


def require_independent(R: np.ndarray, scale: float, columns: np.ndarray) -> None:
    """Raise :class:`InputError` if a factor R (b, c, c) is singular; ``columns`` (b, c) numbers its columns."""
    diagonal = abs(np.diagonal(R, axis1=1, axis2=2))
    if R.shape[1] < R.shape[2] or (diagonal < NEGLIGIBLE * scale).any():
        bad = columns[:, : diagonal.shape[1]][diagonal < NEGLIGIBLE * scale]
        which = f" (number {', '.join(map(str, bad[:5]))} along the rod)" if len(bad) else ""
        raise InputError(f"Constraints depend on one another{which}: remove those that follow from the others.")


class Chain:
    """Cyclic reduction of sparse columns in groups along the rod; fills a :class:`Kernel`.

    Every row has a part for the group on its left and one for the group on its right.  Link ``i`` is the rows between
    the groups at positions ``i - 1`` and ``i`` of those that remain; the first and the last have one neighbour only.
    """

    def __init__(self, C: sp.csr_matrix, group: np.ndarray, scale: float, found: Kernel) -> None:
        """Sort the rows of ``C`` (m, p) into links; ``group`` (p,) numbers the group of each column.

        Rows below round-off of ``scale`` depend on others; null vectors go to ``found``.  Raises :class:`InputError`
        for a row that couples more than two neighbouring groups.
        """
        self.scale, self.kernel = scale, found
        order = np.argsort(group, kind="stable")
        self.widths = np.bincount(group)
        self.starts = np.cumsum(self.widths) - self.widths
        self.column = np.empty(len(order), dtype=int)
        self.column[order] = np.arange(len(order))
        within = self.column - self.starts[group]
        m, widest = C.shape[0], int(self.widths.max())
        row = np.repeat(np.arange(m), np.diff(C.indptr))
        of_entry = group[C.indices]
        first, last = np.full(m, len(self.widths)), np.full(m, -1)
        np.minimum.at(first, row, of_entry)
        np.maximum.at(last, row, of_entry)
        used = last >= 0
        if (last - first)[used].max() > 1:
            raise InputError("A row of C couples constraints of more than two neighbouring groups: make larger groups.")
        self.left, self.right = np.zeros((m, widest)), np.zeros((m, widest))
        right = of_entry > first[row]
        self.left[row[~right], within[C.indices[~right]]] = C.data[~right]
        self.right[row[right], within[C.indices[right]]] = C.data[right]
        outer = used & (first == 0) & (last == 0)  # may stand before the first group: that balances the links
        self.right[outer], self.left[outer] = self.left[outer], 0.0
        link = np.where(outer, 0, first + 1)
        self.free = [np.flatnonzero(~used)]
        rows = np.flatnonzero(used)
        self.rows = rows[np.argsort(link[rows], kind="stable")]
        self.counts = np.bincount(link[rows], minlength=len(self.widths) + 1)
        self.groups = np.arange(len(self.widths))

    def eliminate(self) -> None:
        """Eliminate all groups."""
        self._compress_links()
        while len(self.groups):
            self._halve()
        self.kernel.free = np.concatenate([*self.free, self.rows])

    def _neighbours(self) -> tuple[np.ndarray, np.ndarray]:
        """Widths of the groups on the left and on the right of each link."""
        widths = self.widths[self.groups]
        return np.concatenate([[0], widths]), np.concatenate([widths, [0]])

    def _compress_links(self) -> None:
        """Reduce each link that has more rows than it couples columns."""
        a, b = self._neighbours()
        starts = np.cumsum(self.counts) - self.counts
        kept: list[tuple[np.ndarray, np.ndarray]] = []
        for members, (r, ca, cb) in shapes(self.counts, a, b):
            rows = self.rows[starts[members][:, None] + np.arange(r)]
            kept.append((members, self._compress(rows, ca, cb)))
        self._relink(kept, len(self.counts))

    def _compress(self, rows: np.ndarray, ca: int, cb: int) -> np.ndarray:
        """Rotate rows (b, r) that couple ``ca`` and ``cb`` columns such that ``ca + cb`` of them do; return these."""
        r = rows.shape[1]
        if r <= ca + cb:
            return rows
        if ca + cb:
            blocks = np.concatenate([self.left[rows, :ca], self.right[rows, :cb]], axis=2)
            reflections, R = factor(rows, blocks)
            self.kernel.steps.append(reflections)
            self.left[rows[:, : ca + cb], :ca] = R[:, :, :ca]
            self.right[rows[:, : ca + cb], :cb] = R[:, :, ca:]
        self.free.append(rows[:, ca + cb :].ravel())
        return rows[:, : ca + cb]

    def _halve(self) -> None:
        """Eliminate the groups at even positions."""
        widths = self.widths[self.groups]
        a, b = self._neighbours()
        starts = np.cumsum(self.counts) - self.counts
        even = np.arange(0, len(self.groups), 2)
        one, other = self.counts[even], self.counts[even + 1]
        kept: list[tuple[np.ndarray, np.ndarray]] = []
        for members, (r1, r2, ca, c, cb) in shapes(one, other, a[even], widths[even], b[even + 1]):
            at = even[members]
            before = self.rows[starts[at][:, None] + np.arange(r1)]
            after = self.rows[starts[at + 1][:, None] + np.arange(r2)]
            rows = np.concatenate([before, after], axis=1)
            reflections, R = factor(rows, np.concatenate([self.right[before, :c], self.left[after, :c]], axis=1))
            require_independent(R, self.scale, self.starts[self.groups[at]][:, None] + np.arange(c))
            self.kernel.steps.append(reflections)
            self.right[before], self.left[after] = 0.0, 0.0
            for table, width in ((self.left, ca), (self.right, cb)):
                part = np.ascontiguousarray(table[rows, :width])
                Reflections(np.arange(rows.size).reshape(rows.shape), reflections.V, reflections.T).apply(
                    flat := part.reshape(rows.size, width), transposed=True
                )
                table[rows, :width] = flat.reshape(part.shape)
            kept.append((members, self._compress(rows[:, c:], ca, cb)))
        links = len(even)
        if len(self.groups) % 2 == 0:  # the last link is as it was
            last = self.rows[len(self.rows) - self.counts[-1] :]
            kept.append((np.array([links]), last[None, :]))
            links += 1
        self.groups = self.groups[1::2]
        self._relink(kept, links)

    def _relink(self, kept: list[tuple[np.ndarray, np.ndarray]], links: int) -> None:
        """Store the rows of the new links, given in stacks (members, rows)."""
        self.counts = np.zeros(links, dtype=int)
        for members, rows in kept:
            self.counts[members] = rows.shape[1]
        starts = np.cumsum(self.counts) - self.counts
        self.rows = np.empty(self.counts.sum(), dtype=int)
        for members, rows in kept:
            self.rows[starts[members][:, None] + np.arange(rows.shape[1])] = rows


def shapes(*sizes: np.ndarray) -> list[tuple[np.ndarray, tuple[int, ...]]]:
    """Positions that share all their sizes, and these sizes."""
    kinds, kind = np.unique(np.stack(sizes, axis=1), axis=0, return_inverse=True)
    return [(np.flatnonzero(kind.ravel() == i), tuple(int(v) for v in k)) for i, k in enumerate(kinds)]

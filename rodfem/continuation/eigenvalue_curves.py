"""Which eigenvalue of a sweep goes on from which of the load before: curves of frequencies against the load.

Curves cross where two motions have nothing to do with one another and their eigenvalues pass by each other, and meet
where two become a complex pair.  Eigenvalues alone do not distinguish the two; eigenvectors do.  A vector goes on from
a curve as far as it lies in the span of that curve's vectors at the load before, in the mass: all of them, where an
eigenvalue is multiple.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from rodfem.stability.nonsymmetric import ALIKE, Frequencies, groups, orthonormal, product, squares
from rodfem.tolerances import TINY

STRANGE = 1.0
"""Sum of the share of a vector outside a curve's and of the relative change, above which another curve begins."""


class Curves:
    """Numbers the curves of eigenvalues from one load to the next."""

    def __init__(self, comm: MPI.Comm) -> None:
        """Begin without any curve; the ranks of ``comm`` share the rod."""
        self.comm, self.count = comm, 0
        self._last: Frequencies | None = None
        self._numbers: list[int] = []
        self._basis = np.zeros((0, 0))
        self._span = self._begin = np.zeros(0, dtype=int)

    def numbers(self, found: Frequencies, *, keep: bool = True) -> list[int]:
        """Numbers of the curves of eigenvalues found at a state, which go on from the load before.

        Without ``keep`` the next load goes on from the one before all the same.
        """
        numbers = [-1] * len(found.values)
        last = self._last
        energy = np.maximum(squares(self.comm, found.vectors, found.weighed), TINY)
        if last is not None:
            cost = self._distances(last, found, abs(product(self.comm, self._basis, found.weighed)) ** 2 / energy)
            rows, columns = assignment(cost)
            for i, j, c in zip(rows.tolist(), columns.tolist(), cost[rows, columns].tolist(), strict=True):
                if c < STRANGE:
                    numbers[j] = self._numbers[i]
        fresh = [j for j, number in enumerate(numbers) if number < 0]
        for j in fresh:
            numbers[j] = self.count
            self.count += 1
        if keep:
            self._last, self._numbers = found, numbers
            self._keep(found, energy)
        return numbers

    def _distances(self, last: Frequencies, found: Frequencies, parts: np.ndarray) -> np.ndarray:
        """Share of each vector found outside the span of each one before, plus the relative change of the values.

        ``parts`` are its shares along the vectors of those spans.
        """
        outside = 1.0 - np.minimum(np.add.reduceat(parts, self._begin, axis=0), 1.0)[self._span]
        a, b = last.values[:, None], found.values[None, :]
        return np.asarray(outside + abs(a - b) / np.maximum(np.maximum(abs(a), abs(b)), min(found.one, found.natural)))

    def _keep(self, found: Frequencies, energy: np.ndarray) -> None:
        """Keep a basis of the span of each group of equal eigenvalues, orthonormal in the mass."""
        together = groups(found.values, found.far, ALIKE)
        self._span = np.empty(len(found.values), dtype=int)
        for number, group in enumerate(together):
            self._span[group] = number
        sizes = [len(group) for group in together]
        self._begin = np.cumsum([0, *sizes[:-1]])
        order = [j for group in together for j in group]
        self._basis = (found.vectors / np.sqrt(energy))[:, order]
        for group, begin in zip(together, self._begin.tolist(), strict=True):
            if len(group) > 1:
                spanned = orthonormal(self.comm, found.vectors[:, group], found.weighed[:, group])
                self._basis[:, begin : begin + len(group)] = spanned


def assignment(cost: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns, a pair for each of the fewer, whose entries in ``cost`` (m, k) have the least sum.

    Where the least entries of all of the fewer are in different places they are that.
    """
    m, k = cost.shape
    nearest = cost.argmin(axis=0 if k <= m else 1)
    if len(set(nearest.tolist())) == len(nearest):
        return (nearest, np.arange(k)) if k <= m else (np.arange(m), nearest)
    from scipy.optimize import linear_sum_assignment  # slow to load

    rows, columns = linear_sum_assignment(cost)
    return np.asarray(rows), np.asarray(columns)

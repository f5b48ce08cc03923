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
        self._spans: list[tuple[list[int], np.ndarray]] = []

    def numbers(self, found: Frequencies, *, keep: bool = True) -> list[int]:
        """Numbers of the curves of eigenvalues found at a state, which go on from the load before.

        Without ``keep`` the next load goes on from the one before all the same.
        """
        from scipy.optimize import linear_sum_assignment  # slow to load

        numbers = [-1] * len(found.values)
        last = self._last
        energy = np.maximum(squares(self.comm, found.vectors, found.weighed), TINY)
        if last is not None:
            bases = np.concatenate([basis for _, basis in self._spans], axis=1)
            cost = self._distances(last, found, abs(product(self.comm, bases, found.weighed)) ** 2 / energy)
            for i, j in zip(*linear_sum_assignment(cost), strict=True):
                if cost[i, j] < STRANGE:
                    numbers[j] = self._numbers[i]
        fresh = [j for j, number in enumerate(numbers) if number < 0]
        for j in fresh:
            numbers[j] = self.count
            self.count += 1
        if keep:
            self._last, self._numbers = found, numbers
            self._spans = [(group, self._span(found, group, energy)) for group in groups(found.values, ALIKE)]
        return numbers

    def _distances(self, last: Frequencies, found: Frequencies, parts: np.ndarray) -> np.ndarray:
        """Share of each vector found outside the span of each one before, plus the relative change of the values.

        ``parts`` are its shares along the vectors of those spans.
        """
        outside, begin = np.ones((len(last.values), len(found.values))), 0
        for group, basis in self._spans:
            share = parts[begin : begin + basis.shape[1]].sum(axis=0)
            outside[group] = 1.0 - np.minimum(share, 1.0)
            begin += basis.shape[1]
        a, b = last.values[:, None], found.values[None, :]
        return np.asarray(outside + abs(a - b) / np.maximum(np.maximum(abs(a), abs(b)), found.one))

    def _span(self, found: Frequencies, group: list[int], energy: np.ndarray) -> np.ndarray:
        """Basis of the span of some vectors, orthonormal in the mass."""
        vectors = found.vectors[:, group]
        if len(group) == 1:
            return np.asarray(vectors / np.sqrt(energy[group]))
        return orthonormal(self.comm, vectors, found.weighed[:, group])

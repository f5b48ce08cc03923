"""Which eigenvalue of a sweep goes on from which of the load before: curves of frequencies against the load.

Curves cross where two motions have nothing to do with one another and their eigenvalues pass by each other, and meet
where two become a complex pair.  Eigenvalues alone cannot tell which; their vectors do.  A vector goes on from a curve
as far as it lies in the span of that curve's vectors at the load before, in the mass: all of them, where an eigenvalue
is multiple.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import linear_sum_assignment

from rodfem.stability.vibration import ALIKE, Frequencies, Vibration, groups

STRANGE = 1.0
"""Sum of the share of a vector outside a curve's and of the relative change, above which another curve begins."""


class Curves:
    """Numbers the curves of eigenvalues from one load to the next."""

    def __init__(self, vibration: Vibration) -> None:
        """Begin without any curve."""
        self.vibration, self.count = vibration, 0
        self._last: Frequencies | None = None
        self._numbers: list[int] = []

    def numbers(self, found: Frequencies, *, keep: bool = True) -> list[int]:
        """Numbers of the curves of eigenvalues found at the state last assembled, which go on from the load before.

        Without ``keep`` the next load goes on from the one before all the same.
        """
        numbers = [-1] * len(found.values)
        last = self._last
        if last is not None:
            cost = self._distances(last, found)
            for i, j in zip(*linear_sum_assignment(cost), strict=True):
                if cost[i, j] < STRANGE:
                    numbers[j] = self._numbers[i]
        fresh = [j for j, number in enumerate(numbers) if number < 0]
        for j in fresh:
            numbers[j] = self.count
            self.count += 1
        if keep:
            self._last, self._numbers = found, numbers
        return numbers

    def _distances(self, last: Frequencies, found: Frequencies) -> np.ndarray:
        """Share of each vector found outside the span of each one before, plus the relative change of the values."""
        vibration = self.vibration
        weighed = vibration.weighed(found.vectors)
        energy = np.maximum(vibration.squares(found.vectors, weighed), 1e-300)
        outside = np.ones((len(last.values), len(found.values)))
        for group in groups(last.values, ALIKE):
            basis = vibration.orthonormal(last.vectors[:, group])
            share = (abs(vibration.product(basis, weighed)) ** 2).sum(axis=0) / energy
            outside[group] = 1.0 - np.minimum(share, 1.0)
        a, b = last.values[:, None], found.values[None, :]
        return np.asarray(outside + abs(a - b) / np.maximum(np.maximum(abs(a), abs(b)), 1.0))

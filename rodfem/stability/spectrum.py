"""All eigenvalues ``mu = omega^2`` of a state under loads without a potential: which are real, negative, or complex."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodfem.stability.condensed import ALL, REAL, Condensed, times
from rodfem.tolerances import TINY


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues of a ``condensed`` pencil, nearest to its shift first; ``one`` is their natural size.

    What round-off makes of zero is ``floor``, where it is known (:mod:`rodfem.stability.slow_motions`).
    """

    condensed: Condensed
    one: float
    floor: float = np.inf

    @property
    def complete(self) -> bool:
        """Whether it has all eigenvalues of the mesh."""
        return self.condensed.rank <= ALL

    @cached_property
    def noise(self) -> np.ndarray:
        """What round-off may make of each (k,)."""
        pairs = self.condensed.pairs
        return self.one * pairs.noise / abs(pairs.nu) ** 2

    @cached_property
    def values(self) -> np.ndarray:
        """Eigenvalues (k,), complex; imaginary parts that are round-off are zero."""
        values = self.one * (self.condensed.shift + 1.0 / self.condensed.pairs.nu)
        least = np.maximum(REAL * np.maximum(abs(values), min(self.one, self.floor)), self.noise)
        return np.where(abs(values.imag) <= least, values.real, values).astype(complex)

    @cached_property
    def zero(self) -> float:
        """Magnitude below which an eigenvalue counts as zero."""
        least = REAL * float(abs(self.values).min(initial=np.inf))
        return min(max(REAL * self.one, least), max(self.floor, least))

    @cached_property
    def negative(self) -> np.ndarray:
        """Places (m,) of the real ones that are negative."""
        values = self.values
        return np.flatnonzero((values.imag == 0.0) & (values.real < -np.maximum(self.zero, self.noise)))

    @cached_property
    def upper(self) -> np.ndarray:
        """Places (m,) of those of positive imaginary part, one of each complex pair."""
        return np.flatnonzero(self.values.imag > 0.0)

    @property
    def numbers(self) -> tuple[int, int]:
        """Numbers of negative eigenvalues and of complex pairs."""
        return len(self.negative), len(self.upper)

    @property
    def unstable(self) -> int:
        """Number of eigenvalues that are negative or complex."""
        return len(self.negative) + 2 * len(self.upper)

    @property
    def right(self) -> np.ndarray:
        """Vectors (h, k) of all eigenvalues in the rows with mass."""
        return self.condensed.right

    def coordinates(self, other: Spectrum) -> np.ndarray:
        """Vectors (r, k) of another state's eigenvalues in coordinates in which the mass of this state is one."""
        return times(self.condensed.dual.T, other.right)


def inside(basis: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Shares (k,) of ``vectors`` (r, k) in the span of a real ``basis`` (r, m)."""
    parts = np.linalg.qr(basis)[0].T @ vectors
    return np.asarray((abs(parts) ** 2).sum(axis=0) / np.maximum((abs(vectors) ** 2).sum(axis=0), TINY))

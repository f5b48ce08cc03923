"""A soft mode: an eigenvalue so near zero that its sign may be undecided, with its name and uncertainty.

One whose value is within its uncertainty is undecided: it is not among the negative eigenvalues, and the index is one
of two numbers.  Symmetries are no soft modes: their eigenvalue is zero.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SoftMode:
    """An eigenvalue near zero: what it moves, in words, its ``value`` in the metric, and the ``uncertainty``."""

    name: str
    value: float
    uncertainty: float

    @property
    def decided(self) -> bool:
        """Whether its sign is known."""
        return abs(self.value) > self.uncertainty

    def __str__(self) -> str:
        """Name, value and uncertainty, and whether the sign is decided."""
        doubt = "" if self.decided else ", sign undecided"
        return f"{self.name}, mu = {self.value:.2g} +- {self.uncertainty:.0e}{doubt}"


@dataclass(frozen=True)
class Judgement:
    """Numbers of ``negative``, ``zero`` and ``undecided`` eigenvalues of a state, with its ``soft`` modes.

    Undecided ones within the tolerance of a count are among the zero ones, too.
    """

    negative: int
    zero: int
    undecided: int
    soft: tuple[SoftMode, ...]


def is_stable(negative: int, undecided: int) -> bool | None:
    """Whether a state with so many eigenvalues is stable; None where that is not decided."""
    return False if negative else None if undecided else True


def index_range(negative: int, undecided: int) -> str:
    """Index in words, of which some eigenvalues may be undecided: ``2``, ``0 or 1``, ``0 to 2``."""
    words = {0: "", 1: f" or {negative + 1}"}
    return f"{negative}" + words.get(undecided, f" to {negative + undecided}")

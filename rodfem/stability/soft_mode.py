"""A soft mode: an eigenvalue so near zero that its sign may be undecided.

One within its uncertainty is undecided: the index is one of two numbers.  Symmetries, whose eigenvalue is zero, are no
soft modes.
"""

from __future__ import annotations

from dataclasses import dataclass

ONE_SIDE = "on one side of a kink"
STABILITY = {True: "stable", None: "undecided", False: "unstable"}
"""Words for what :func:`is_stable` says."""


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
        doubt = "" if self.decided else ", sign undecided"
        return f"{self.name}, mu = {self.value:.2g} +- {self.uncertainty:.0e}{doubt}"


@dataclass(frozen=True)
class Judgement:
    """Numbers of ``negative``, ``zero`` and ``undecided`` eigenvalues of a state, with its ``soft`` modes.

    An undecided one within the tolerance of a count is a zero one, too.
    """

    negative: int
    zero: int
    undecided: int
    soft: tuple[SoftMode, ...]


def is_stable(negative: int, undecided: int, kink: str = "") -> bool | None:
    """Whether a state with so many eigenvalues is stable; None where that is not decided, as on a ``kink``."""
    return None if kink else False if negative else None if undecided else True


def index_range(negative: int, undecided: int, kink: str = "") -> str:
    """Index in words, some eigenvalues undecided: ``2``, ``0 or 1``, ``0 to 2``; on a ``kink`` that of one side."""
    words = {0: "", 1: f" or {negative + 1}"}
    index = f"{negative}" + words.get(undecided, f" to {negative + undecided}")
    return f"{index} {ONE_SIDE}" if kink else index


def on_kink(kink: str) -> str:
    """Why stability is undecided on a ``kink``, in a clause."""
    return f"the state is on a kink of the {kink}: the second variation depends on the side"

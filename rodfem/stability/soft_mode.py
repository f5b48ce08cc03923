"""A soft mode: an eigenvalue so near zero that its sign may be undecided.

One within its uncertainty is undecided: the index is one of two numbers.  Symmetries, whose eigenvalue is zero, are no
soft modes.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

ONE_SIDE = "on one side of a kink"
STABLE, PLANAR, UNSTABLE = "stable", "stable in the plane, unstable in space", "unstable"
UNDECIDED = "stability undecided"
WORDS = {True: "stable", None: "undecided", False: "unstable"}
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
        bar = f" +- {self.uncertainty:.0e}" if isfinite(self.uncertainty) else " without a bound of its error"
        return f"{self.name}, mu = {self.value:.2g}{bar}{doubt}"


def stability(negative: int, undecided: int, doubt: str = "", in_space: int | None = None) -> str:
    """:data:`STABLE`, :data:`PLANAR`, :data:`UNDECIDED` or :data:`UNSTABLE`: the one decision that all words follow.

    ``negative`` is the index, or the number of unstable frequencies, ``undecided`` eigenvalues may be negative as well;
    ``in_space`` is the index among all perturbations of a planar rod (None: unknown).  In ``doubt``, as on a kink or
    where a richer mesh has no such state, an index is no decision.
    """
    if doubt:
        return UNDECIDED
    if negative:
        return UNSTABLE
    return UNDECIDED if undecided else PLANAR if in_space else STABLE


def in_short(negative: int, undecided: int, kink: str, doubt: str = "", in_space: int | None = None) -> str:
    """Stability with the index: ``stable``, ``unstable, index 2``, ``stability undecided, index 0 or 1``."""
    kind, index = stability(negative, undecided, kink or doubt, in_space), index_range(negative, undecided, kink)
    number = {STABLE: "", PLANAR: f", index {in_space}"}.get(kind, f", index {index}")
    return kind + number + (f" of the {kink}" if kink else "")


def is_stable(kind: str) -> bool | None:
    """Whether a state of a kind of stability is stable; None if that is undecided."""
    return None if kind == UNDECIDED else kind == STABLE


def index_range(negative: int, undecided: int, kink: str = "") -> str:
    """Index in words, some eigenvalues undecided: ``2``, ``0 or 1``, ``0 to 2``; on a ``kink`` that of one side."""
    words = {0: "", 1: f" or {negative + 1}"}
    index = f"{negative}" + words.get(undecided, f" to {negative + undecided}")
    return f"{index} {ONE_SIDE}" if kink else index


def on_kink(kink: str) -> str:
    """Why stability is undecided on a ``kink``, in a clause."""
    return f"the state is on a kink of the {kink}: the second variation depends on the side"

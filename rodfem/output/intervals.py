"""Intervals of a branch on which stability does not change, and what happens where they meet."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from typing import Any

import numpy as np

from rodfem.output.pieces import PLANAR, STABLE, UNDECIDED, UNSTABLE, Piece, pieces_of
from rodfem.stability.soft_mode import on_kink
from rodfem.tolerances import SAME_SPECIAL

SHARES = (0.5, 0.31)
"""Where in a range energies are compared: those of different states may be the same at one load, of symmetry, say."""
SAME_ENERGY = 1e-3
"""Energies, interpolated linearly between rows, that differ by less than this, relative, may be those of one state."""


@dataclass(frozen=True)
class Interval:
    """Consecutive rows of a ``branch`` of ``diagram.json`` with one ``kind`` of stability, from ``first`` to ``last``.

    ``least`` and ``most`` bound the index, ``in_space`` the index among all perturbations of a planar rod (None where
    it is not known).  Stability is undecided on a ``kink``, of the functions of that name, and where eigenvalues are
    too near zero (``soft``).
    """

    branch: Mapping[str, Any]
    kind: str
    first: int
    last: int
    least: int
    most: int
    in_space: int | None
    kink: str = ""
    soft: bool = False

    @property
    def why(self) -> str:
        """Why stability is undecided, in clauses."""
        soft = "an eigenvalue is too near zero for its sign to be known on this mesh"
        return "; ".join([on_kink(self.kink)] * bool(self.kink) + [soft] * self.soft)

    @property
    def rank(self) -> int:
        """Of two intervals that meet, the one of greater rank has the segment between their rows.

        It is the less stable one, or one that is undecided by an eigenvalue near zero: between a row of known and one
        of undecided index that is undecided, too.
        """
        return 4 if self.kind == UNDECIDED and self.soft else (STABLE, PLANAR, UNDECIDED, UNSTABLE).index(self.kind)

    @property
    def loads(self) -> tuple[float, float]:
        """Load at its first and at its last row."""
        column = self.branch["columns"]["load"]
        return column[self.first], column[self.last]

    @property
    def covers(self) -> tuple[float, float]:
        """Least and greatest load of its rows."""
        column = self.branch["columns"]["load"][self.first : self.last + 1]
        return min(column), max(column)

    def energy(self, load: float) -> float:
        """Stored energy at a load, by linear interpolation between rows."""
        rows = slice(self.first, self.last + 1)
        loads, energies = (np.array(self.branch["columns"][name][rows]) for name in ("load", "energy"))
        order = np.argsort(loads, kind="stable")
        return float(np.interp(load, loads[order], energies[order]))


def intervals_of(branch: Mapping[str, Any]) -> list[Interval]:
    """Intervals of a branch in the order of its rows; none for a branch of one row."""
    groups = groupby(pieces_of(branch), lambda piece: piece.kind)
    return [_joined(branch, kind, list(group)) for kind, group in groups]


def _joined(branch: Mapping[str, Any], kind: str, pieces: Sequence[Piece]) -> Interval:
    indices, space = [piece.negative for piece in pieces], [piece.in_space for piece in pieces]
    known = None if None in space else max(i for i in space if i is not None)
    kink = " and the ".join(dict.fromkeys(piece.kink for piece in pieces if piece.kink))
    soft, ends = any(piece.undecided for piece in pieces), (pieces[0].first, pieces[-1].last)
    return Interval(branch, kind, *ends, min(indices), max(indices), known, kink, soft)


def changes_at(branch: Mapping[str, Any], row: int) -> list[Mapping[str, Any]]:
    """Special points in a row at which the index changes."""
    return [s for s in branch["special"] if s["row"] == row and s["negative_before"] != s["negative_after"]]


def without_stable(stable: Sequence[Interval], low: float, high: float) -> Iterator[tuple[float, float]]:
    """Parts of a range of loads that no stable interval covers, from below."""
    reached = low
    for a, b in sorted(interval.covers for interval in stable):
        if a - reached > SAME_SPECIAL * (high - low):
            yield reached, min(a, high)
        reached = max(reached, b)
    if high - reached > SAME_SPECIAL * (high - low):
        yield reached, high


def coexisting(stable: Sequence[Interval]) -> Iterator[tuple[Interval, Interval, float, float]]:
    """Pairs of stable intervals with a range of loads in common and other energies there: the pair and that range.

    Those of one energy, all along it, are mirror images of each other, or one branch traced twice.
    """
    for one, other in combinations(stable, 2):
        (a, b), (c, d) = one.covers, other.covers
        low, high = max(a, c), min(b, d)
        if high - low > SAME_SPECIAL * max(b - a, d - c):
            places = [low + share * (high - low) for share in SHARES]
            energies = [(one.energy(x), other.energy(x)) for x in places]
            if any(abs(p - q) > SAME_ENERGY * max(abs(p), abs(q)) for p, q in energies):
                yield one, other, low, high


def intervals_in(branches: Sequence[Mapping[str, Any]], kind: str) -> list[Interval]:
    """All intervals of one ``kind`` of a diagram."""
    return [x for branch in branches for x in intervals_of(branch) if x.kind == kind]

"""Stability along the branches of a diagram: pieces of one index, intervals of one kind of stability, ends.

An index is that of the step between two rows.  It is the greater one of both rows, but at a special point that is known
before and after.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby, pairwise
from typing import Any, NamedTuple

import numpy as np

from rodfem.continuation.kinds import FREQUENCY, KINDS
from rodfem.errors import InputError
from rodfem.stability.soft_mode import PLANAR, STABLE, UNDECIDED, UNSTABLE, index_range, on_kink, stability
from rodfem.tolerances import SAME_SPECIAL

COUNTED = {name for name, kind in KINDS.items() if kind.counted or kind.test == FREQUENCY}
"""Kinds whose index before and after is that of the steps next to them."""
COMPLETE = ("", "end of range", "closed loop", "not traced")
"""Ends that need no mark."""
MEETS, SQUEEZED, BEGINS = "meets", "stretch reaches zero", "begins here: "
"""Beginning of an end on another branch, whose points say so; reason of an end at a load that is solved for; beginning
of the note at the first row of a branch that was traced to both sides."""

Branch = Mapping[str, Any]


class Piece(NamedTuple):
    """Rows ``first`` to ``last`` of a branch, with one index between them.

    ``negative`` is the index, of a planar rod in its plane, ``in_space`` that among all perturbations (None where it is
    not known), ``undecided`` the number of eigenvalues that may be negative as well; ``kink`` names functions on a kink
    of which the states are, where the index is that of one side.
    """

    first: int
    last: int
    negative: int
    in_space: int | None
    undecided: int = 0
    kink: str = ""

    @property
    def kind(self) -> str:
        """Stability, of :func:`~rodfem.stability.soft_mode.stability`."""
        return stability(self.negative, self.undecided, self.kink, self.in_space)

    @property
    def label(self) -> str:
        """The index, or its least and greatest value, followed by the index in space in parentheses."""
        index = index_range(self.negative, self.undecided, self.kink)
        return index if self.in_space is None else f"{index} ({self.in_space})"


def pieces_of(branch: Branch) -> list[Piece]:
    """Pieces of a branch of ``diagram.json``, in order."""
    columns = branch["columns"]
    rows = len(columns["load"])
    known = {(row, side): index for row, *sides in _indices(branch) for side, index in enumerate(sides)}
    kink, undecided = columns.get("kink") or [""] * rows, columns.get("undecided") or [0] * rows
    off, steps = _from_neighbours(columns["negative"], kink), []
    for a, b in pairwise(range(rows)):
        on = kink[a] if kink[b] else ""
        own = columns["negative"] if on else off
        ends = [(known.get(end), own[end[0]], undecided[end[0]]) for end in ((a, 1), (b, 0))]
        steps.append((*_index(ends), on))
    return _grouped(steps, _in_space(branch))


def _index(ends: Sequence[tuple[int | None, int, int]]) -> tuple[int, int]:
    """Least index between two rows, and how many eigenvalues may be negative as well.

    Of either end it is known or not, then the index of the row, and the number of undecided eigenvalues there.
    """
    sure, own, undecided = zip(*ends, strict=True)
    least = [b if a is None else a for a, b in zip(sure, own, strict=True)]
    if not any(undecided):
        return max(least), 0
    more = [0 if known is not None else count for known, count in zip(sure, undecided, strict=True)]
    return min(least), max(a + b for a, b in zip(least, more, strict=True)) - min(least)


def _grouped(steps: Sequence[tuple[int, int, str]], space: Sequence[int]) -> list[Piece]:
    """Pieces of steps that are alike: their index, how many may be negative as well, and what is on a kink."""
    most = [max(space[i], space[i + 1], step[0]) if space else None for i, step in enumerate(steps)]
    each = [(least, inside, more, on) for (least, more, on), inside in zip(steps, most, strict=True)]
    groups = [[step for step, _ in group] for _, group in groupby(enumerate(each), lambda step: step[1])]
    return [Piece(group[0], group[-1] + 1, *each[group[0]]) for group in groups]


def _indices(branch: Branch) -> Iterator[tuple[int, int | None, int | None]]:
    """Rows at which the index is known before and after, with both.

    They are singular points, and rows next to them at the same load: a load asked for may be that of a special point,
    where the index of the row itself is not decided.  At the branch point that a branch leaves they are undecided rows,
    too, whose index is that of the next row.
    """
    columns = branch["columns"]
    for point in (point for point in branch.get("special", []) if point["kind"] in COUNTED):
        yield int(point["row"]), point.get("negative_before"), point.get("negative_after")
        yield from _neighbours(columns, point) if point.get("negative_after") is not None else ()
    if branch.get("parent") and columns.get("undecided") and "arclength" in columns:
        near = _at_the_origin(columns["arclength"], columns["undecided"])
        yield from ((row, *2 * (columns["negative"][near[-1] + 1],)) for row in near)


def _at_the_origin(s: Sequence[float], undecided: Sequence[int]) -> list[int]:
    return [row for row in range(1, len(s) - 1) if s[row] - s[0] < SAME_SPECIAL and undecided[row]]


def _neighbours(columns: Mapping[str, Any], point: Mapping[str, Any]) -> Iterator[tuple[int, int, int]]:
    """Rows on either side of a special point at its load, with the index there.

    Decided rows are those of this mesh, on which the load is known to ``located_to``; the error bar, which has the
    error of the mesh in it, covers undecided ones.
    """
    loads, undecided, row = columns["load"], columns.get("undecided"), int(point["row"])
    located = point.get("located_to") or 0.0
    bar = max(point.get("error_estimate") or 0.0, located)
    for step, side in ((-1, "before"), (1, "after")):
        other = row + step
        while 0 <= other < len(loads) and abs(loads[other] - loads[row]) <= (
            bar if undecided and undecided[other] else located
        ):
            yield other, point[f"negative_{side}"], point[f"negative_{side}"]
            other += step


def _from_neighbours(negative: list[int], kink: list[str]) -> list[int]:
    """Index of each row; of one on a kink, where it is that of one side, that of the next row off the kink."""
    negative, rows = list(negative), range(len(kink))
    for a, b in (*pairwise(rows), *pairwise(reversed(rows))):
        negative[a] = negative[b] if kink[a] and not kink[b] else negative[a]
    return negative


def _in_space(branch: Branch) -> list[int]:
    """Index among all perturbations in each row, none where it is not known.

    That of a singular row leaves out the eigenvalues that vanish there, so that the other rows decide.
    """
    column = branch["columns"].get("negative_in_space") or [None]
    singular = {int(point["row"]) for point in branch.get("special", []) if point["kind"] in COUNTED}
    return [] if None in column else [0 if row in singular else index for row, index in enumerate(column)]


# --- intervals of one kind of stability


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
    def resolved(self) -> bool:
        """Whether the mesh resolves one of its states that were examined, if any was."""
        found = [s.get("resolved") for s in self.branch["special"] if self.first <= s["row"] <= self.last]
        return True in found or False not in found

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


def step_between(one: Interval, after: Interval) -> int:
    """First row of the step in which two intervals of a branch meet, if no special point is there."""
    return one.last if after.rank > one.rank else one.last - 1


def unlocated(branches: Sequence[Mapping[str, Any]]) -> Iterator[tuple[float, float]]:
    """Loads of the steps in which stability is lost or won without a special point."""
    for one, after in (pair for branch in branches for pair in pairwise(intervals_of(branch))):
        kinds = one.kind, after.kind
        if STABLE in kinds and UNDECIDED not in kinds and not changes_at(one.branch, one.last):
            step = one.branch["columns"]["load"][step_between(one, after) :][:2]
            yield min(step), max(step)


def without_stable(stable: Sequence[tuple[float, float]], low: float, high: float) -> Iterator[tuple[float, float]]:
    """Parts of a range of loads that no ``stable`` range covers, from below."""
    reached = low
    for a, b in sorted((a, b) for a, b in stable if b > low and a < high):
        if a - reached > SAME_SPECIAL * (high - low):
            yield reached, min(a, high)
        reached = max(reached, b)
    if high - reached > SAME_SPECIAL * (high - low):
        yield reached, high


def coexisting(stable: Sequence[Interval]) -> Iterator[tuple[Interval, Interval, float, float]]:
    """Pairs of stable intervals with a range of loads in common and other energies there: the pair and that range.

    Those of one energy, to what linear interpolation leaves, are mirror images, or one branch twice.  Energies of
    other states may be the same at one load, of symmetry, say, but not at two.
    """
    for one, other in combinations(stable, 2):
        (a, b), (c, d) = one.covers, other.covers
        low, high = max(a, c), min(b, d)
        if high - low > SAME_SPECIAL * max(b - a, d - c):
            energies = [(x.energy(low + share * (high - low)) for x in (one, other)) for share in (0.5, 0.31)]
            if any(abs(p - q) > 1e-3 * max(abs(p), abs(q)) for p, q in energies):
                yield one, other, low, high


def intervals_in(branches: Sequence[Mapping[str, Any]], kind: str) -> list[Interval]:
    """All intervals of one ``kind`` of a diagram."""
    return [x for branch in branches for x in intervals_of(branch) if x.kind == kind]


# --- ends, and the state that is shown


def endings(branch: Branch) -> list[tuple[int, str]]:
    """First and last row of a branch of ``diagram.json``, each with the reason, where it is not the range that ends."""
    notes = "".join(str(special.get("note") or "") for special in branch.get("special", []) if special["row"] == 0)
    begun = notes.partition(BEGINS)[2]
    ends = (0, begun), (len(branch["columns"]["load"]) - 1, str(branch.get("ended") or ""))
    reasons = [(row, re.split(r" at |:| any more", sentence)[0]) for row, sentence in ends]
    return [(row, reason) for row, reason in reasons if not reason.startswith(MEETS) and reason not in COMPLETE]


def is_solved(branch: Branch, special: Mapping[str, Any]) -> bool:
    """Whether the load of the end ``special`` of a branch is solved for: it is not the range that ends there."""
    return (special["row"], SQUEEZED) in endings(branch)


def typical_state(data: Mapping[str, Any]) -> tuple[str, int, str]:
    """Branch, row and words of the state to draw: a stable one well inside a branch that leaves the first one.

    Where none is stable there, one of another branch but the first; else one of least index on a branch that leaves the
    first, said to be unstable; on the first branch only where there is no other.  Raises :class:`InputError` for a
    diagram without states.
    """
    branches = [branch for branch in data["branches"] if branch["columns"]["load"]]
    if not branches:
        raise InputError("The diagram has no states to draw.")
    first = data["branches"][0]["name"]

    def rank(place: tuple[Branch, Piece]) -> tuple[bool, bool, int, int, float]:
        branch, piece = place
        s, aside = branch["columns"]["arclength"], branch["name"] != first
        leaves = branch["parent"] is not None and branch["parent"][0] == first
        length = s[piece.last] - s[piece.first]
        return piece.kind == STABLE and aside, leaves, -piece.negative, -(piece.in_space or 0), length

    alone = [(branches[0], Piece(0, 0, branches[0]["columns"]["negative"][0], None))]
    found = [(branch, piece) for branch in branches for piece in pieces_of(branch)] or alone
    branch, piece = max(found, key=rank)
    columns = branch["columns"]
    s = columns["arclength"]
    wanted = s[piece.first] + 0.6 * (s[piece.last] - s[piece.first])  # well inside
    row = min(range(piece.first, piece.last + 1), key=lambda row: abs(s[row] - wanted))
    index = index_range(piece.negative, piece.undecided, piece.kink)
    words = piece.kind + {STABLE: "", PLANAR: f", index {piece.in_space}"}.get(piece.kind, f", index {index}")
    return branch["name"], row, f"{columns['load'][row]:.4g}, {words}"

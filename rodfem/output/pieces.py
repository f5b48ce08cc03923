"""Stability along the branches of a diagram: pieces of one index, intervals of one kind of stability, ends.

An index is that of the step between two rows.  It is the greater one of both rows, but at a special point that is known
before and after.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any, NamedTuple

from rodfem.continuation.kinds import FREQUENCY, KINDS
from rodfem.errors import InputError
from rodfem.stability.soft_mode import PLANAR, STABLE, UNDECIDED, UNSTABLE, in_short, index_range, stability
from rodfem.tolerances import SAME_SPECIAL

COUNTED = {name for name, kind in KINDS.items() if kind.counted or kind.test == FREQUENCY}
"""Kinds whose index before and after is that of the steps next to them."""
COMPLETE = ("", "end of range", "closed loop", "not traced")  # ends that need no mark
MEETS, SQUEEZED, BEGINS = "meets", "stretch reaches zero", "begins here: "
"""Beginning of an end on another branch, whose points say so; reason of an end at a load that is solved for; beginning
of the note at the first row of a branch that was traced to both sides."""

Branch = Mapping[str, Any]


class Piece(NamedTuple):
    """Rows of a branch with one index, ``negative``, that ``in_space`` (None: unknown), and ``undecided`` eigenvalues.

    On a ``kink``, of the functions of that name, the index is that of one side.
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
    known = {row: sides for row, *sides in _indices(branch)}
    kink, undecided = columns.get("kink") or [""] * rows, columns.get("undecided") or [0] * rows
    own, space, steps = columns["negative"], _in_space(branch), []
    for a, b in pairwise(range(rows)):
        on = kink[a] if kink[b] else ""
        _, after = known.get(a, (None, None))
        before, _ = known.get(b, (None, None))
        least, more = _index([(after, own[a], undecided[a]), (before, own[b], undecided[b])])
        steps.append((least, max(space[a], space[b], least) if space else None, more, on))
    out, first = [], 0
    for step, group in groupby(steps):
        last = first + len([*group])
        out.append(Piece(first, last, *step))
        first = last
    return out


def _index(ends: Sequence[tuple[int | None, int, int]]) -> tuple[int, int]:
    """Least index between two rows, and how many eigenvalues may be negative as well."""
    least = [own if known is None else known for known, own, _ in ends]
    if not any(undecided for *_, undecided in ends):
        return max(least), 0
    most = [a + (undecided if known is None else 0) for a, (known, _, undecided) in zip(least, ends, strict=True)]
    return min(least), max(most) - min(least)


def _indices(branch: Branch) -> Iterator[tuple[int, int | None, int | None]]:
    """Rows at which the index is known before and after, with both: singular points, and rows next to them.

    At the branch point that a branch leaves they are undecided rows, too, whose index is that of the next row.
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
    for side, rows in (("before", range(row - 1, -1, -1)), ("after", range(row + 1, len(loads)))):
        for other in rows:
            if abs(loads[other] - loads[row]) > (bar if undecided and undecided[other] else located):
                break
            yield other, point[f"negative_{side}"], point[f"negative_{side}"]


def _in_space(branch: Branch) -> list[int]:
    """Index among all perturbations in each row, empty where it is not known."""
    column = branch["columns"].get("negative_in_space") or [None]
    return [] if None in column else column


@dataclass(frozen=True)
class Interval:
    """Consecutive rows of a ``branch`` of ``diagram.json`` with one ``kind`` of stability, from ``first`` to ``last``.

    ``least`` and ``most`` bound the index.  Stability is undecided on a ``kink`` and where eigenvalues are too near
    zero (``soft``).
    """

    branch: Branch
    kind: str
    first: int
    last: int
    least: int
    most: int
    in_space: int | None
    kink: str = ""
    soft: bool = False

    @property
    def rank(self) -> int:
        """Of two intervals that meet, the one of greater rank has the segment between their rows."""
        return 4 if self.kind == UNDECIDED and self.soft else (STABLE, PLANAR, UNDECIDED, UNSTABLE).index(self.kind)

    @property
    def loads(self) -> list[float]:
        """Loads of its rows."""
        return list(self.branch["columns"]["load"][self.first : self.last + 1])


def intervals_of(branch: Branch) -> list[Interval]:
    """Intervals of a branch in the order of its rows; none for a branch of one row."""
    out = []
    for kind, group in groupby(pieces_of(branch), lambda piece: piece.kind):
        pieces = list(group)
        indices, space = [piece.negative for piece in pieces], [piece.in_space for piece in pieces]
        known = None if None in space else max(i for i in space if i is not None)
        kink = " and the ".join(dict.fromkeys(piece.kink for piece in pieces if piece.kink))
        soft, ends = any(piece.undecided for piece in pieces), (pieces[0].first, pieces[-1].last)
        out.append(Interval(branch, kind, *ends, min(indices), max(indices), known, kink, soft))
    return out


def endings(branch: Branch) -> list[tuple[int, str]]:
    """First and last row of a branch of ``diagram.json``, each with the reason, where it is not the range that ends."""
    notes = "".join(str(special.get("note") or "") for special in branch.get("special", []) if special["row"] == 0)
    last = len(branch["columns"]["load"]) - 1
    ends = (0, notes.partition(BEGINS)[2]), (last, str(branch.get("ended") or ""))
    reasons = [(row, re.split(r" at |:| any more", sentence)[0]) for row, sentence in ends]
    return [(row, reason) for row, reason in reasons if not reason.startswith(MEETS) and reason not in COMPLETE]


def is_solved(branch: Branch, special: Mapping[str, Any]) -> bool:
    """Whether the load of the end ``special`` of a branch is solved for: it is not the range that ends there."""
    return (special["row"], SQUEEZED) in endings(branch)


def typical_state(data: Mapping[str, Any]) -> tuple[str, int, str]:
    """Branch, row and words of the state to draw: a stable one well inside a branch that leaves the first one.

    Where none is stable there, one of another branch but the first; else one of least index on a branch that leaves the
    first; on the first branch only where there is no other.
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
    branch, piece = max([(branch, piece) for branch in branches for piece in pieces_of(branch)] or alone, key=rank)
    s = branch["columns"]["arclength"]
    wanted = s[piece.first] + 0.6 * (s[piece.last] - s[piece.first])  # well inside
    row = min(range(piece.first, piece.last + 1), key=lambda row: abs(s[row] - wanted))
    words = in_short(piece.negative, piece.undecided, piece.kink, in_space=piece.in_space)
    return branch["name"], row, f"{branch['columns']['load'][row]:.4g}, {words}"

"""Pieces of a diagram's branches: which rows have one index, how a piece is drawn, and where two lie on each other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rodfem.continuation.kinds import BRANCH_POINT, FREQUENCY, KINDS
from rodfem.stability.soft_mode import index_range

Floats = NDArray[np.float64]

STABLE, PLANAR, UNSTABLE = "stable", "stable in the plane, unstable in space", "unstable"
UNDECIDED = "stability undecided"
STYLES: dict[str, dict[str, Any]] = {
    STABLE: {"linestyle": "-", "linewidth": 3.0, "solid_capstyle": "round"},
    PLANAR: {"linestyle": (0, (3.2, 1.0)), "linewidth": 2.4},
    UNDECIDED: {"linestyle": (0, (4.0, 1.2, 1.0, 1.2)), "linewidth": 2.4},
    UNSTABLE: {"linestyle": (0, (1.0, 1.3)), "linewidth": 1.9},
}
COUNTED = {name for name, kind in KINDS.items() if kind.counted or kind.test == FREQUENCY}
"""Kinds whose index before and after is that of the segments beside."""
COINCIDE = 1e-6
"""Arclength within which a row of a branch is at the branch point that it leaves."""
SAME = 2.0
"""Distance in pixels up to which two lines lie on each other."""
APART = 30.0
"""Length in pixels that they must do so for, or else they cross."""


class Piece(NamedTuple):
    """Consecutive segments of a ``branch`` with one index, drawn in one ``colour``.

    ``curve`` (k, 2) has loads and ordinates, ``negative`` is the index, of a planar rod in its plane, ``in_space`` that
    among all perturbations (None where it is not known), ``undecided`` the number of eigenvalues that may be negative
    besides; ``kink`` names functions on a kink of which the states are, where the index is that of one side.
    """

    branch: str
    colour: str
    curve: Floats
    negative: int
    in_space: int | None
    undecided: int = 0
    kink: str = ""

    @property
    def kind(self) -> str:
        """:data:`STABLE`, :data:`PLANAR`, :data:`UNDECIDED` or :data:`UNSTABLE`."""
        if self.kink:
            return UNDECIDED
        if self.negative:
            return UNSTABLE
        if self.undecided:
            return UNDECIDED
        return PLANAR if self.in_space else STABLE

    @property
    def label(self) -> str:
        """The index, or its least and greatest value, followed by the index in space in parentheses."""
        index = index_range(self.negative, self.undecided, self.kink)
        return index if self.in_space is None else f"{index} ({self.in_space})"


def pieces_of(branch: Mapping[str, Any], colour: str) -> Iterator[Piece]:
    """Pieces of a branch of ``diagram.json``, in order; raises ValueError where its columns differ in length."""
    name, columns, special = branch["name"], branch["columns"], branch.get("special", [])
    if not len(columns["load"]) == len(columns["ordinate"]) == len(columns["negative"]):
        raise ValueError(f"columns of branch {name!r} differ in length: try to compute the diagram anew")
    curve = np.column_stack([np.asarray(columns[key], dtype=float) for key in ("load", "ordinate")])
    special = [*special, *_coinciding(curve[:, 0], special), *_at_the_origin(branch)]
    kinks, negative = _kinks(columns)
    ranges = (segment_ranges(x, columns.get("undecided"), special) for x in (columns["negative"], negative))
    indices, undecided = (np.where(kinks != "", on, off) for on, off in zip(*ranges, strict=True))
    space = _in_space(columns.get("negative_in_space"), indices, special)
    changes = np.flatnonzero(np.diff(indices) | np.diff(space) | np.diff(undecided) | (kinks[1:] != kinks[:-1])) + 1
    for a, b in pairwise([0, *changes, indices.size]):
        if b > a:
            in_space = int(space[a]) if space[a] >= 0 else None
            yield Piece(name, colour, curve[a : b + 1], int(indices[a]), in_space, int(undecided[a]), kinks[a])


def _kinks(columns: Mapping[str, Any]) -> tuple[NDArray[np.str_], list[int]]:
    """Functions on a kink of which states between rows (n - 1,) are, those of both rows; and the index in each row.

    That of a row on a kink, which is the index of one side, is that of the row beside it that is off the kink.
    """
    negative, kink = list(columns["negative"]), list(columns.get("kink") or [""] * len(columns["negative"]))
    for a, b in (*pairwise(range(len(kink))), *pairwise(reversed(range(len(kink))))):
        if kink[a] and not kink[b]:
            negative[a] = negative[b]
    return np.array([a if a and b else "" for a, b in pairwise(kink)], dtype=str), negative


def _coinciding(loads: Floats, special: Sequence[Mapping[str, Any]]) -> Iterator[Mapping[str, Any]]:
    """Rows next to special points at the same load to its error bar, as special points at which nothing changes.

    A load asked for may be that of a special point: there the index of the row itself is not decided.
    """
    for point in special:
        if point["kind"] not in COUNTED or point.get("negative_after") is None:
            continue
        bar, row = max(point.get("error_estimate") or 0.0, point.get("located_to") or 0.0), int(point["row"])
        for step, key in ((-1, "negative_before"), (1, "negative_after")):
            other = row + step
            while 0 <= other < len(loads) and abs(loads[other] - loads[row]) <= bar:
                yield {"kind": point["kind"], "row": other, "negative_before": point[key], "negative_after": point[key]}
                other += step


def _at_the_origin(branch: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """The same for undecided rows of a branch at the branch point that it leaves, whose index is that of the next."""
    columns = branch["columns"]
    undecided = columns.get("undecided")
    if not (branch.get("parent") and undecided and "arclength" in columns):
        return
    places = columns["arclength"]
    near = [row for row in range(1, len(places) - 1) if places[row] - places[0] < COINCIDE and undecided[row]]
    for row in near:
        index = columns["negative"][near[-1] + 1]
        yield {"kind": BRANCH_POINT, "row": row, "negative_before": index, "negative_after": index}


def segment_indices(negative: ArrayLike, special: Sequence[Mapping[str, Any]]) -> NDArray[np.int64]:
    """Return the index (n - 1,) between rows; beside singular rows their before and after decide."""
    rows = np.asarray(negative, dtype=np.int64)
    indices = np.maximum(rows[:-1], rows[1:])
    for (key, shift), point in product((("negative_before", -1), ("negative_after", 0)), special):
        segment = int(point["row"]) + shift
        if point["kind"] in COUNTED and point.get(key) is not None and 0 <= segment < indices.size:
            indices[segment] = point[key]
    return indices


def segment_ranges(
    negative: ArrayLike, undecided: ArrayLike | None, special: Sequence[Mapping[str, Any]]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the least index (n - 1,) between rows, and how many eigenvalues besides may be negative there.

    Between rows of which one has ``undecided`` ones it is that of either row; beside singular rows their before and
    after count as in :func:`segment_indices`.
    """
    indices, rows = segment_indices(negative, special), np.asarray(negative, dtype=np.int64)
    more = np.zeros_like(rows) if undecided is None else np.asarray(undecided, dtype=np.int64)
    ends = np.array([[rows[:-1], rows[1:]], [(rows + more)[:-1], (rows + more)[1:]]])  # least and most, left and right
    for (key, side), point in product((("negative_after", 0), ("negative_before", 1)), special):
        segment = int(point["row"]) - side
        if point["kind"] in COUNTED and point.get(key) is not None and 0 <= segment < indices.size:
            ends[:, side, segment] = point[key]
    least, most = ends[0].min(axis=0), ends[1].max(axis=0)
    undecided_there = (more[:-1] + more[1:]) > 0
    return np.where(undecided_there, least, indices), np.where(undecided_there, most - least, 0)


def _in_space(
    column: Sequence[int | None] | None, indices: NDArray[np.int64], special: Sequence[Mapping[str, Any]]
) -> NDArray[np.int64]:
    """Index among all perturbations between rows (n - 1,), -1 where it is not known: the greater one of the two rows.

    That of a singular row leaves out the eigenvalues that vanish there, so that the other row decides; it is never less
    than the index in the plane.
    """
    if column is None or any(x is None for x in column):
        return np.full(indices.size, -1)
    rows = np.array(column, dtype=np.int64)
    rows[[int(point["row"]) for point in special if point["kind"] in COUNTED]] = 0
    return np.maximum(np.maximum(rows[:-1], rows[1:]), indices)


def hidden(upper: Floats, lower: Sequence[Floats]) -> list[Floats]:
    """Parts of a line that lie on others, all given by pixels (k, 2) at equal distances of about two.

    Lines that merely cross, or come from one point, do not lie on each other.
    """
    if not lower:
        return []
    others = np.concatenate(lower)
    near = np.array([np.min(np.sum((others - point) ** 2, axis=1)) <= SAME**2 for point in upper])
    ends = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    parts = [upper[a:b] for a, b in zip(ends[::2], ends[1::2], strict=True)]
    return [part for part in parts if np.sum(np.hypot(*np.diff(part, axis=0).T)) > APART]

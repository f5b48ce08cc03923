"""The state of a diagram that its picture shows."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from rodfem.errors import InputError
from rodfem.stability.soft_mode import index_range, is_stable

INSIDE = 0.6
"""Where on a piece of a branch the state is taken, as a share of the piece's length along the branch."""


@dataclass(frozen=True)
class Stretch:
    """Consecutive rows of a branch that have one index, away from special points: places and numbers of the rows.

    ``branch`` is its name, which ``is_first`` or ``leaves_first``; ``negative`` and ``in_space`` are the index in the
    plane and in space, ``undecided`` eigenvalues may be negative besides, ``kink`` names functions on a kink of
    which the states are; ``places`` (n,) are arclengths of the branch, ``rows`` (n,) numbers.
    """

    branch: str
    leaves_first: bool
    is_first: bool
    negative: int
    in_space: int
    undecided: int
    kink: str
    places: tuple[float, ...]
    rows: tuple[int, ...]

    @property
    def length(self) -> float:
        """Length along the branch."""
        return self.places[-1] - self.places[0]

    @property
    def row(self) -> int:
        """The row nearest to the place :data:`INSIDE` it."""
        wanted = self.places[0] + INSIDE * self.length
        return self.rows[min(range(len(self.rows)), key=lambda i: abs(self.places[i] - wanted))]

    @property
    def rank(self) -> tuple[bool, bool, int, int, float]:
        """The greatest is drawn: stable, then on a branch that leaves the first one, then of least index, then long."""
        stable = not (self.negative or self.in_space or self.undecided or self.kink)
        return stable and not self.is_first, self.leaves_first, -self.negative, -self.in_space, self.length


def typical_state(data: Mapping[str, Any]) -> tuple[str, int, str]:
    """Branch, row and words of the state to draw: a stable one well inside a branch that leaves the first one.

    Where none is stable there, one of another branch but the first; else one of least index on a branch that leaves the
    first, said to be unstable; on the first branch only where there is no other.  Never a special point at which the
    second variation is singular, nor the row in which a branch leaves another.  Raises :class:`InputError` for a
    diagram without states.
    """
    found = [stretch for branch in data["branches"] for stretch in _stretches(branch, data["branches"][0]["name"])]
    if not found:
        raise InputError("The diagram has no states to draw.")
    best = max(found, key=lambda stretch: stretch.rank)
    columns = next(b["columns"] for b in data["branches"] if b["name"] == best.branch)
    index = index_range(best.negative, best.undecided, best.kink)
    words = {True: "stable", None: f"stability undecided, index {index}", False: f"unstable, index {index}"}[
        is_stable(best.negative, best.undecided, best.kink)
    ]
    if best.negative + best.undecided == 0 and best.in_space and not best.kink:
        words = f"stable in the plane, unstable in space, index {best.in_space}"
    return best.branch, best.row, f"{columns['load'][best.row]:.4g}, {words}"


def _stretches(branch: Mapping[str, Any], first: str) -> Iterator[Stretch]:
    columns = branch["columns"]
    rows = range(len(columns["load"]))
    singular = {s["row"] for s in branch["special"] if s["multiplicity"]} | ({0} if branch["parent"] else set())
    space = columns.get("negative_in_space") or [None] * len(rows)
    undecided = columns.get("undecided") or [0] * len(rows)

    kink = columns.get("kink") or [""] * len(rows)

    def known(row: int) -> tuple[int, int, int, str]:
        return columns["negative"][row], space[row] or 0, undecided[row], kink[row]

    def index(row: int) -> tuple[int, int, int, str] | None:
        return None if row in singular else known(row)

    for key, group in groupby(rows, index):
        inside = tuple(group)
        if key is None and len(singular) < len(rows):
            continue
        negative, in_space, open_signs, at_kink = key or known(inside[0])
        yield Stretch(
            branch=branch["name"],
            leaves_first=branch["parent"] is not None and branch["parent"][0] == first,
            is_first=branch["name"] == first,
            negative=negative,
            in_space=in_space,
            undecided=open_signs,
            kink=at_kink,
            places=tuple(columns["arclength"][row] for row in inside),
            rows=inside,
        )

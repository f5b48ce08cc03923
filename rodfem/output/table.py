"""The table of a diagram: each column of a branch, and each entry of a special point, declared once, in ``table.md``.

A row there has the name, type and unit of an entry, what it means, and when it is there.  Files are written
by it, ``docs/files.md`` has it, and so have the glossary, the page, and the tables of other programs.  A new column is
one row there, and the line that computes it in :class:`~rodfem.continuation.branch.Point`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from math import inf, nan
from operator import attrgetter
from typing import Any

import numpy as np

from rodfem.continuation.branch import Branch, NormalForm, Point, SpecialPoint
from rodfem.continuation.observer import Remark
from rodfem.stability.soft_mode import SoftMode

Data = Mapping[str, Any]
Source = Callable[[Any], Any]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+?) \| ([^|]*?) ?\| (.+?) \| ([^|]*?) ?\|$", re.MULTILINE)
PAGE = (files("rodfem.output") / "table.md").read_text(encoding="utf-8")


def _soft(attribute: str) -> Source:
    return lambda point: [plain(getattr(mode, attribute)) for mode in point.soft]


ATTRIBUTES = {
    "ordinate_error_estimate": "ordinate_error",
    "omega2_error_estimate": "omega2_error",
    "followed": "switched",
}
"""Attributes of a special point that have another name than its entries."""
OF_POINT: dict[str, Source] = {
    **{("soft" if name == "name" else f"soft_{name}"): _soft(name) for name in ("name", "value", "uncertainty")},
    "unstable": lambda point: point.negative if point.omega2 else None,
}
OF_SPECIAL: dict[str, Source] = {
    **{name: attrgetter(f"point.{name}") for name in ("load", "ordinate", "energy", "zero")},
    "kind": lambda special: str(special.kind),
    "meets": lambda special: list(special.connects_to) if special.connects_to else None,
    "law": lambda s: None if s.law is None else {name: plain(value) for name, value in asdict(s.law).items()},
}
OF_REMARK: dict[str, Source] = {"sentence": str}
"""Where values come from that are no attributes of their name."""


@dataclass(frozen=True)
class Entry:
    """One column of a branch, or one entry of a special point: ``name``, ``type``, ``unit``, ``words`` and ``where``.

    ``of`` gives its value, None the attribute of its name.
    """

    name: str
    type: str
    unit: str
    words: str
    where: str
    of: Source | None

    @property
    def always(self) -> bool:
        """Whether each branch has it."""
        return not self.where

    def value(self, point: Point | SpecialPoint | Remark) -> Any:
        """What a file has of a point; numbers that are not finite become null."""
        return plain(getattr(point, ATTRIBUTES.get(self.name, self.name)) if self.of is None else self.of(point))

    def kept(self, column: Sequence[Any]) -> bool:
        """Whether a branch has this column: it is always there, or a row has something in it."""
        empty: dict[str, Any] = {"(P, ": [], "null": None, "text": ""}
        nothing = next((value for part, value in empty.items() if part in self.type), 0)
        return self.always or any(value != nothing for value in column)


def _entries(section: str, sources: Mapping[str, Source]) -> tuple[Entry, ...]:
    text = PAGE.split(f"## {section}\n")[1].split("## ")[0]
    return tuple(Entry(a, b, c, d, e, sources.get(a)) for a, b, c, d, e in ROW.findall(text))


COLUMNS, SPECIAL, REMARK = (
    _entries("columns", OF_POINT),
    _entries("special", OF_SPECIAL),
    _entries("remarks", {"sentence": str}),
)
"""Columns of a branch, one entry a row; entries of a special point, and of a warning or a note."""


def plain(value: Any) -> Any:
    """What JSON can hold: numbers that are not finite become null."""
    if value is None or isinstance(value, (int, str, list, dict)):
        return value
    return float(value) if np.isfinite(value) else None


def branch_data(branch: Branch) -> dict[str, Any]:
    """A branch as ``diagram.json`` has it."""
    rows = {id(p): i for i, p in enumerate(branch.points)}
    columns = {entry: [entry.value(point) for point in branch.points] for entry in COLUMNS}
    return {
        "name": branch.name,
        "parent": list(branch.parent) if branch.parent else None,
        "ended": branch.ended,
        "columns": {entry.name: column for entry, column in columns.items() if entry.kept(column)},
        "special": [special_data(special) for special in branch.special],
        "singular_start": branch.singular_start,
        "image": branch.image,
        "unexplained": [{"row": rows[id(u.a)], "before": u.before, "after": u.after} for u in branch.unexplained],
    }


def row_data(point: Point) -> dict[str, Any]:
    """Columns of one point."""
    return {entry.name: entry.value(point) for entry in COLUMNS}


def special_data(special: SpecialPoint) -> dict[str, Any]:
    """A special point as ``diagram.json`` has it."""
    return {entry.name: entry.value(special) for entry in SPECIAL}


def point_values(columns: Mapping[str, Sequence[Any]], row: int) -> dict[str, Any]:
    """Attributes of the point in a row of a file, as :class:`~rodfem.continuation.branch.Point` takes them."""
    found = {name: column[row] for name, column in columns.items()}
    own = [entry for entry in COLUMNS if entry.of is None and entry.name in found]
    known = {e.name: _number(found[e.name]) for e in own if e.always or found[e.name] is not None}
    return known | {"soft": soft_modes(found)}


def soft_modes(row: Data) -> list[SoftMode]:
    """Soft modes of the row of these columns."""
    parts = [row.get(name) or [] for name in ("soft", "soft_value", "soft_uncertainty")]
    return [SoftMode(name, mu, inf if bar is None else bar) for name, mu, bar in zip(*parts, strict=True)]


def special_values(entry: Data) -> dict[str, Any]:
    """Attributes of a special point of a file, as :class:`~rodfem.continuation.branch.SpecialPoint` takes them."""
    read = [e.name for e in SPECIAL if e.of is None and e.name not in ("multiplicity", "resolved", "note")]
    values = {ATTRIBUTES.get(name, name): _number(entry.get(name)) for name in read}
    values |= {"resolved": entry.get("resolved"), "note": entry.get("note") or ""}
    values["connects_to"] = tuple(entry["meets"]) if entry["meets"] else None
    return values | {"law": _law(entry["law"]) if entry["law"] else None}


def _law(law: Data) -> NormalForm:
    return NormalForm(**{name: _number(law[name]) for name in NormalForm.__annotations__ if name in law})


def _number(value: Any) -> Any:
    """Value of a file, in which null stands for what is not finite."""
    return nan if value is None else value

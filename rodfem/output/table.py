"""The table of a diagram, declared once in ``table.md``, and the glossary, ``glossary.md``.

A row of the table has name, type and unit of a column of a branch, or of an entry of a special point, what it means,
and when it is there.  Files, ``docs/files.md``, the glossary, the page and other programs' tables follow it.  A new
column is one row there, and the line that computes it in :class:`~rodfem.continuation.branch.Point`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from functools import partial
from importlib.resources import files
from math import inf, nan
from operator import attrgetter
from typing import Any

import numpy as np

from rodfem.continuation.branch import Branch, NormalForm, Point, SpecialPoint
from rodfem.continuation.kinds import KINDS
from rodfem.continuation.observer import Remark
from rodfem.errors import InputError
from rodfem.stability.soft_mode import SoftMode

Data = Mapping[str, Any]
Source = Callable[[Any], Any]
ROW = re.compile(r"^\| `(\w+)` \| ([^|]+?) \| ([^|]*?) ?\| (.+?) \| ([^|]*?) ?\|$", re.MULTILINE)
PAGE, GLOSSARY = ((files("rodfem.output") / name).read_text(encoding="utf-8") for name in ("table.md", "glossary.md"))


def plain(value: Any) -> Any:
    """What JSON can hold: numbers that are not finite become null."""
    if value is None or isinstance(value, (int, str, list, dict)):
        return value
    if np.ndim(value):
        return [plain(each) for each in value]
    return np.asarray(value).item() if np.isfinite(value) else None


def _soft(attribute: str, point: Point) -> list[Any]:
    return [plain(getattr(mode, attribute)) for mode in point.soft]


ATTRIBUTES = {
    "ordinate_error_estimate": "ordinate_error",
    "omega2_error_estimate": "omega2_error",
    "followed": "switched",
}
"""Attributes of a special point that have another name than its entries."""
OF_POINT: dict[str, Source] = {
    "middle": attrgetter("middle"),
    "soft": partial(_soft, "name"),
    "soft_value": partial(_soft, "value"),
    "soft_uncertainty": partial(_soft, "uncertainty"),
    "reactions": lambda point: [] if point.solver is None else plain(point.reactions.all),
    "unstable": lambda point: point.negative if point.omega2 else None,
}
OF_SPECIAL: dict[str, Source] = {
    **{name: attrgetter(f"point.{name}") for name in ("load", "ordinate", "energy", "zero")},
    "kind": lambda special: str(special.kind),
    "errors": lambda special: {name: plain(bar) for name, bar in special.errors.items()} or None,
    "derivatives": lambda special: {name: [*map(plain, pair)] for name, pair in special.derivatives.items()} or None,
    "densities": lambda special: {name: [*map(plain, pair)] for name, pair in special.densities.items()} or None,
    "meets": lambda special: list(special.connects_to) if special.connects_to else None,
    "law": lambda s: None if s.law is None else {name: plain(value) for name, value in asdict(s.law).items()},
}
"""Where values come from that are no attributes of their name."""


@dataclass(frozen=True)
class Entry:
    """One column of a branch, or one entry of a special point; ``of`` is None where it is the attribute of its name."""

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

    def occurs(self, column: Sequence[Any]) -> bool:
        """Whether a branch has this column: it is always there, or a row has something in it."""
        empty: dict[str, Any] = {"(P, ": [], "null": None, "text": ""}
        nothing = next((value for part, value in empty.items() if part in self.type), 0)
        return self.always or any(value != nothing for value in column)


def _entries(section: str, sources: Mapping[str, Source]) -> tuple[Entry, ...]:
    text = PAGE.split(f"## {section}\n")[1].split("## ")[0]
    return tuple(Entry(a, b, c, d, e, sources.get(a)) for a, b, c, d, e in ROW.findall(text))


COLUMNS, SPECIAL = _entries("columns", OF_POINT), _entries("special", OF_SPECIAL)
REMARK = _entries("remarks", {"sentence": str})
"""Columns of a branch, one entry a row; entries of a special point, and of a warning or a note."""


# --- files


def branch_data(branch: Branch, rates: bool = False) -> dict[str, Any]:
    """A branch as ``diagram.json`` has it, whose eigenvalues may be ``rates`` of decay."""
    rows = {id(p): i for i, p in enumerate(branch.points)}
    values = [[entry.value(point) for entry in COLUMNS] for point in branch.points]  # a state keeps what it derives
    columns = dict(zip(COLUMNS, map(list, zip(*values, strict=True)), strict=True))
    return {
        "name": branch.name,
        "parent": list(branch.parent) if branch.parent else None,
        "ended": branch.ended,
        "columns": {entry.name: column for entry, column in columns.items() if entry.occurs(column)},
        "special": [special_data(special) for special in branch.special],
        "singular_start": branch.singular_start,
        "image": branch.image,
        "unexplained": [{"row": rows[id(u.a)], "before": u.before, "after": u.after} for u in branch.unexplained],
    } | ({"rates": True} if rates else {})


def reactions_by_name(values: Sequence[Any]) -> dict[str, Any]:
    """Components of the ``reactions`` of a row, as the page and tables of other programs have them."""
    places = ["left end", "right end", *(f"attachment {i}" for i in range(1, len(values) - 1))]
    return {
        f"reaction {what} e{axis}, {place}": component
        for place, pair in zip(places, values, strict=False)
        for what, vector in zip(("force", "moment"), pair, strict=True)
        for axis, component in zip("₁₂₃", vector, strict=True)
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
    pairs = {name: tuple(map(_number, pair)) for name, pair in (entry.get("derivatives") or {}).items()}
    values |= {
        "derivatives": pairs,
        "densities": _densities(entry),
        "resolved": entry.get("resolved"),
        "note": entry.get("note") or "",
    }
    values["connects_to"] = tuple(entry["meets"]) if entry["meets"] else None
    return values | {"law": _law(entry["law"]) if entry["law"] else None}


def _densities(entry: Data) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {name: (np.array(s), np.array(means)) for name, (s, means) in (entry.get("densities") or {}).items()}


def _law(law: Data) -> NormalForm:
    return NormalForm(**{name: _number(law[name]) for name in NormalForm.__annotations__ if name in law})


def _number(value: Any) -> Any:
    """Value of a file, in which null stands for what is not finite."""
    return nan if value is None else value


# --- glossary


ENTRIES = dict(line.split(": ", 1) for line in GLOSSARY.split("\n## ", 1)[1].splitlines() if ": " in line)
"""Text of each entry by its names, which are between bars."""
KNOWN = {"kind", *(name for key in ENTRIES for name in key.split(" | "))}
ENTRIES |= {x.name: f"{x.words[:1].upper()}{x.words[1:]}." for x in (*COLUMNS, *SPECIAL) if x.name not in KNOWN}
NAMES = {name: key for key in ENTRIES for name in key.split(" | ")}  # entry of each name


def title(entry: str) -> str:
    """Names of an entry in words, the codes of the terminal among them: ``branch point, BP``."""
    codes = dict.fromkeys(kind.code for name, kind in KINDS.items() if name in entry.split(" | "))
    return ", ".join([*entry.split(" | "), *codes])


def explanation(word: str) -> list[tuple[str, str]]:
    """Titles and texts of a word, several for a code of several kinds; raises :class:`InputError` for other words."""
    found = entries_of(word)
    if not found:
        inside = [name for name in NAMES if word.lower() in name.lower().replace(",", "").split()]
        near = inside[:3] or get_close_matches(word.lower(), NAMES)
        best = f"{' or '.join(near)}, or rodfem explain" if near else "rodfem explain"
        raise InputError(f"There is no entry {word!r}: try {best}, which lists all.")
    return [(title(NAMES[name]), ENTRIES[NAMES[name]]) for name in dict.fromkeys(found)]


def entries_of(word: str) -> list[str]:
    """Names of the entries of a word: those of a code, or its own."""
    found = [name for name, kind in KINDS.items() if kind.code == word.upper()]
    wanted = " ".join(word.lower().split())
    return found or [name for name in NAMES if name.lower() in (wanted, wanted.replace(" ", "_"))]

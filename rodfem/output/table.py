"""The table of a diagram: each column of a branch, and each entry of a special point, declared once.

An entry has its name, type and unit, what it means, when it is there, and where its value comes from.  Files are
written and checked by it, ``docs/files.md`` has it, and so have the glossary, the page, and the tables of other
programs.  A new column is one entry here, and the line that computes it in :class:`~rodfem.continuation.branch.Point`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import inf, isfinite, nan
from typing import Any

import numpy as np

from rodfem.continuation.branch import Branch, NormalForm, Point, SpecialPoint
from rodfem.continuation.kinds import KINDS
from rodfem.stability.soft_mode import SoftMode

Data = Mapping[str, Any]
Test = Callable[[Any], bool]
ALWAYS = object()
"""Value without which no branch has a column."""


@dataclass(frozen=True, eq=False)
class Entry:
    """One column of a branch, or one entry of a special point.

    Attributes
    ----------
    name, type, unit, words, where
        As in ``docs/files.md``; ``words`` may be followed by a full stop and a second sentence.
    of
        Its value, of a point or a special point; None: the attribute of its name.
    empty
        Value of a row that has none: a column with no other values is left out.
    """

    name: str
    type: str
    unit: str
    words: str
    where: str = ""
    of: Callable[[Any], Any] | None = None
    empty: Any = ALWAYS

    def value(self, point: Point | SpecialPoint) -> Any:
        """What a file has of a point; numbers that are not finite become null."""
        return plain(getattr(point, self.name) if self.of is None else self.of(point))


def _soft(attribute: str) -> Callable[[Point], list[Any]]:
    return lambda point: [plain(getattr(mode, attribute)) for mode in point.soft]


WITH_POTENTIAL, WITHOUT, SOME = "loads with a potential", "loads without potential", "a row has some"
COLUMNS = (
    Entry("load", "number (P)", "load", "value of the load"),
    Entry("ordinate", "number (P) or null", "ordinate", "value of the ordinate"),
    Entry(
        *("energy", "number (P) or null", "energy"),
        "stored energy `int W ds`, without the potential of the loads, springs and foundations",
    ),
    Entry("negative", "integer (P)", "1", "index, 0 is stable; under loads without potential as `unstable`"),
    Entry("zero", "integer (P)", "1", "number of eigenvalues that vanish, those of symmetries included"),
    Entry("stretch", "number (P) or null", "1", "least stretch `v3` along the rod"),
    Entry(
        *("slope", "number (P) or null", "1"),
        "load's component of the unit tangent, which changes its sign at a fold; null in a sweep of frequencies",
    ),
    Entry(
        *("drift", "number (P) or null", "metric"),
        "largest drift scalar: the error with which the mesh has the symmetries",
    ),
    Entry("arclength", "number (P) or null", "metric", "length along the branch, in the metric of rotations and load"),
    Entry("error", "number (P) or null", "metric", "size of the last Newton correction"),
    Entry("mesh", "integer (P)", "1", "number of the discretisation in `meshes`, from 0 on"),
    Entry(
        *("potential", "number (P) or null", "energy"),
        "total potential energy V of rod, loads, springs and foundations, up to a constant",
        *(WITH_POTENTIAL, None, None),
    ),
    Entry(
        *("conjugate", "number (P) or null", "energy over load"),
        "`-dV/dload`, what the load does work on",
        *(WITH_POTENTIAL, None, None),
    ),
    Entry(
        *("estimate", "number (P) or null", "1"),
        "estimated error of load and ordinate across the branch, relative to values greater than their `natural` sizes",
        *("with `--accuracy`", None, None),
    ),
    Entry(
        *("spectrum", "number (P, k)", "1/time²", "left-most eigenvalues mu = omega²"),
        *("with `--spectrum`", None, []),
    ),
    Entry(
        *("negative_in_space", "integer (P) or null", "1"),
        "index among all perturbations, also those out of the plane",
        *("planar rods", None, None),
    ),
    Entry(
        *("omega2", "number (P, k, 2)", "1/time²", "eigenvalues omega² nearest zero, real and imaginary part"),
        *(WITHOUT, None, []),
    ),
    Entry(
        *("motion", "text (P, k)", ""),
        "what the rod does in each: bending, torsion, a mixture, a motion without rotation, a rigid motion",
        *(WITHOUT, None, []),
    ),
    Entry(
        *("curve", "integer (P, k)", "1", "number of the curve of frequencies that each is on"),
        *(WITHOUT, None, []),
    ),
    Entry(
        *("undecided", "integer (P)", "1"),
        "number of eigenvalues whose sign is not decided: the index is between `negative` and `negative` + `undecided`",
        *(SOME, None, 0),
    ),
    Entry(
        *("kink", "text (P)", ""),
        "what has a kink at the very state (`equations`; older files name functions), or empty: `negative` is the "
        "index on one side, stability is undecided",
        *("a row is on one", None, ""),
    ),
    Entry(
        *("soft", "text (P, k)", ""),
        "eigenvalues near zero by their motions: sliding along the rod, a rotation, turning of the cross-sections, "
        "bending, torsion",
        *(SOME, _soft("name"), []),
    ),
    Entry("soft_value", "number (P, k)", "metric", "their values, in the metric", SOME, _soft("value"), []),
    Entry(
        *("soft_uncertainty", "number (P, k) or null", "metric"),
        "bounds of the errors of these by round-off, and by the mesh where there are error bars; null: no bound",
        *(SOME, _soft("uncertainty"), []),
    ),
    Entry(
        *("unstable", "integer (P)", "1"),
        "number of eigenvalues omega², of those found, that are negative or complex",
        *(WITHOUT, lambda point: point.negative if point.omega2 else None, None),
    ),
)
"""Columns of a branch, one entry a row; those without a value of rows that have none are always there."""
SPECIAL = (
    Entry(
        *("kind", "text", ""),
        "`branch point`, `fold`, `imperfect bifurcation`, `flutter`, `divergence`, `user` (a load of `--at`), `event` "
        "(named in `note`), `end`",
        of=lambda special: str(special.kind),
    ),
    Entry("load", "number", "load", "value of the load", of=lambda special: special.point.load),
    Entry("ordinate", "number or null", "ordinate", "value of the ordinate", of=lambda special: special.point.ordinate),
    Entry("energy", "number or null", "energy", "as the column", of=lambda special: special.point.energy),
    Entry("row", "integer", "1", "its row in the columns and in `states.h5`"),
    Entry("negative_before", "integer", "1", "index before it along the branch"),
    Entry("negative_after", "integer", "1", "index after it"),
    Entry("zero", "integer", "1", "number of eigenvalues that vanish", of=lambda special: special.point.zero),
    Entry(
        *("multiplicity", "integer", "1"),
        "number of them that cross or touch zero here, which is that of null vectors in `states.h5`",
    ),
    Entry(
        *("error_estimate", "number or null", "load, ordinate"),
        "bound of the error: of the load; at `user` and `end` of the ordinate",
    ),
    Entry(
        *("ordinate_error_estimate", "number or null", "ordinate", "bound of the ordinate's error"),
        of=lambda special: special.ordinate_error,
    ),
    Entry("resolved", "boolean or null", "", "whether the mesh resolves the state; null: not examined"),
    Entry(
        "located_to", "number or null", "load", "uncertainty of the load on this mesh, the error of the mesh left out"
    ),
    Entry(
        *("coupling", "number or null", "1"),
        "cosine between the null vector and the derivative of the equations in the load: zero at a branch point, not "
        "at a fold",
    ),
    Entry(
        *("meets", "place or null", "", "branch on which it is too, and its number among the special points there"),
        of=lambda special: list(special.connects_to) if special.connects_to else None,
    ),
    Entry("followed", "boolean", "", "whether branches were sought from it", of=lambda special: special.switched),
    Entry("omega2", "number or null", "1/time²", "double eigenvalue of flutter, zero of divergence"),
    Entry(
        *("omega2_error_estimate", "number or null", "1/time²", "bound of the error of that of flutter"),
        of=lambda special: special.omega2_error,
    ),
    Entry(
        *("law", "object or null", "", "`load = load_b + coefficient x^power + ...` of a branch that leaves it"),
        of=lambda special: None if special.law is None else {k: plain(v) for k, v in asdict(special.law).items()},
    ),
    Entry(
        *("unfolding", "number or null", "1"),
        "imperfection of the equations there, relative to the metric: round-off, or what takes the point apart",
    ),
    Entry("note", "text or null", "", "what else there is to say"),
)
"""Entries of a special point."""


def plain(value: Any) -> Any:
    """What JSON can hold: numbers that are not finite become null."""
    if value is None or isinstance(value, (int, str, list, dict)):
        return value
    return float(value) if np.isfinite(value) else None


def branch_data(branch: Branch) -> dict[str, Any]:
    """A branch as ``diagram.json`` has it."""
    rows = {id(p): i for i, p in enumerate(branch.points)}
    columns = {entry.name: [entry.value(point) for point in branch.points] for entry in COLUMNS}
    kept = [e.name for e in COLUMNS if e.empty is ALWAYS or any(value != e.empty for value in columns[e.name])]
    return {
        "name": branch.name,
        "parent": list(branch.parent) if branch.parent else None,
        "ended": branch.ended,
        "columns": {name: columns[name] for name in kept},
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
    found = {entry: columns[entry.name][row] for entry in COLUMNS if entry.of is None and entry.name in columns}
    known = {e.name: nan if x is None else x for e, x in found.items() if x is not None or e.empty is ALWAYS}
    parts = [columns[name][row] if name in columns else [] for name in ("soft", "soft_value", "soft_uncertainty")]
    return known | {"soft": [SoftMode(*mode, inf if bar is None else bar) for *mode, bar in zip(*parts, strict=True)]}


def special_values(entry: Data) -> dict[str, Any]:
    """Attributes of a special point of a file, as :class:`~rodfem.continuation.branch.SpecialPoint` takes them."""
    names = {
        "ordinate_error_estimate": "ordinate_error",
        "omega2_error_estimate": "omega2_error",
        "followed": "switched",
    }
    read = [e.name for e in SPECIAL if e.of is None and e.name != "multiplicity"] + [*names]
    values = {names.get(name, name): nan if entry.get(name) is None else entry[name] for name in read}
    law = {name: nan if value is None else value for name, value in (entry["law"] or {}).items()}
    values["law"] = NormalForm(**{x: law[x] for x in NormalForm.__annotations__ if x in law}) if law else None
    values["connects_to"] = (entry["meets"][0], entry["meets"][1]) if entry["meets"] else None
    return values | {"resolved": entry.get("resolved"), "note": entry.get("note") or ""}


def markdown(entries: Sequence[Entry]) -> Iterator[str]:
    """Rows of the table of ``docs/files.md``."""
    for e in entries:
        kind = e.type.replace("place", "text, integer (2)")
        yield f"| `{e.name}` | {kind} | {e.unit} | {e.words} | {e.where} |".replace("|  |", "| |").replace(
            "|  |", "| |"
        )


def _is_count(x: Any) -> bool:
    return isinstance(x, int) and not isinstance(x, bool) and 0 <= x < 2**31


TYPES: dict[str, tuple[Test, str]] = {
    "number": (
        lambda x: isinstance(x, (int, float)) and not isinstance(x, bool) and abs(x) < 1e300 and isfinite(x),
        "a finite number",
    ),
    "integer": (_is_count, "a whole number"),
    "text": (lambda x: isinstance(x, str), "a text"),
    "boolean": (lambda x: isinstance(x, bool), "true or false"),
    "object": (lambda x: isinstance(x, dict), "an object"),
    "place": (
        lambda x: isinstance(x, list) and len(x) == 2 and isinstance(x[0], str) and _is_count(x[1]),
        "a name and a number",
    ),
    "kind": (lambda x: isinstance(x, str) and x in KINDS, f"one of {', '.join(KINDS)}"),
    "name": (
        lambda x: isinstance(x, str) and x not in ("", ".", "..") and "/" not in x and "\0" not in x,
        "a name without slashes",
    ),
}
"""Types, each with its test and in words."""


def test_of(kind: str) -> tuple[Test, str]:
    """Test of a type of :class:`Entry`, of one row where it has a dimension ``P``, and the type in words."""
    base, size, null = re.fullmatch(r"(\w+)(?: \(([^)]*)\))?( or null)?", kind).groups()  # type: ignore[union-attr]
    test, words = TYPES[base]
    sizes = [x for x in (size or "").split(", ") if x not in ("", "P")]
    if null and not sizes:
        return _or_none(test), f"{words} or null"
    test = _or_none(test) if null else test
    for number in reversed(sizes):
        test, words = _all(test, None if number == "k" else int(number)), f"a list of {words.split(' ')[-1]}s"
    return test, words


def _or_none(test: Test) -> Test:
    return lambda x: x is None or test(x)


def _all(test: Test, size: int | None) -> Test:
    return lambda x: isinstance(x, list) and (size is None or len(x) == size) and all(map(test, x))

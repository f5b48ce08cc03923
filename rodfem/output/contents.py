"""Contents of ``diagram.json`` as its readers rely on them: the kind of each entry, declared once.

Rows and special points have what all readers need; other entries that are missing are the matter of each reader.  Those
that are there are of their kind, columns have one length, and rows and meshes that are named exist.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, STATES, read_json
from rodfem.problem.arguments import SHORT

Test = Callable[[Any], bool]
ROW, POINT = ("load", "ordinate"), ("kind", "load", "ordinate", "negative_before", "negative_after", "zero", "row")
"""Entries of every row and of every special point."""


def _is_number(x: Any) -> bool:
    return isinstance(x, (int, float)) and not isinstance(x, bool) and abs(x) < 1e300 and isfinite(x)


def _is_count(x: Any) -> bool:
    return isinstance(x, int) and not isinstance(x, bool) and 0 <= x < 2**31


def _is_text(x: Any) -> bool:
    return isinstance(x, str)


def _is_flag(x: Any) -> bool:
    return isinstance(x, bool)


def _or_none(test: Test) -> Test:
    return lambda x: x is None or test(x)


def _all(test: Test, size: int | None = None) -> Test:
    return lambda x: isinstance(x, list) and (size is None or len(x) == size) and all(map(test, x))


def _named(test: Test) -> Test:
    return lambda x: isinstance(x, dict) and all(map(test, x.values()))


def _is_object(x: Any) -> bool:
    return isinstance(x, dict)


def _is_name(x: Any) -> bool:
    return isinstance(x, str) and x not in ("", ".", "..") and "/" not in x and "\0" not in x


def _is_place(x: Any) -> bool:
    return isinstance(x, list) and len(x) == 2 and isinstance(x[0], str) and _is_count(x[1])


NUMBER, MAYBE = (_is_number, "a finite number"), (_or_none(_is_number), "a finite number or null")
COUNT, TEXT, FLAG = (_is_count, "a whole number"), (_is_text, "a text"), (_or_none(_is_flag), "true, false or null")
OBJECT, OBJECTS = (_is_object, "an object"), (_all(_is_object), "a list of objects")
PLACE = (_or_none(_is_place), "a name and a number, or null")
LENGTHS = (_or_none(_all(_is_number)), "a list of numbers, or null")
Kinds = Mapping[str, tuple[Test, str]]
OF_PARAMETER = ("parameter", "parameter_label", "parameter_words", "parameter_unit")
WORDS = ("scene", "title", *OF_PARAMETER, "ordinate", "ordinate_label", "ordinate_unit")
TOP: Kinds = {
    **dict.fromkeys(WORDS, TEXT),
    **dict.fromkeys(("constants", "natural"), (_named(_is_number), "numbers by name")),
    "range": (_all(_is_number, 2), "two finite numbers"),
    "accuracy": MAYBE,
    "discretization": OBJECT,
    "origin": OBJECT,
    **dict.fromkeys(("meshes", "branches"), (lambda x: x != [] and OBJECTS[0](x), "a list of objects, one or more")),
}
MESH: Kinds = {"formulation": TEXT, "elements": COUNT, "degree": COUNT, "unknowns": COUNT, "vertices": LENGTHS}
BRANCH: Kinds = {
    "name": (_is_name, "a name without slashes"),
    "parent": PLACE,
    "ended": TEXT,
    "columns": (_named(lambda x: isinstance(x, list)), "lists by name"),
    "special": OBJECTS,
    "singular_start": COUNT,
    "image": TEXT,
    "unexplained": OBJECTS,
}
COLUMN: Kinds = {
    **dict.fromkeys(("negative", "zero", "mesh", "unstable"), COUNT),
    "load": NUMBER,
    "undecided": COUNT,
    "kink": TEXT,
    "soft": (_all(_is_text), "a list of texts"),
    "soft_value": (_all(_is_number), "a list of numbers"),
    "soft_uncertainty": (_all(_or_none(_is_number)), "a list of numbers or null"),
    "negative_in_space": (_or_none(_is_count), "a whole number or null"),
    "spectrum": (_all(_is_number), "a list of numbers"),
    "omega2": (_all(_all(_is_number, 2)), "a list of pairs of numbers"),
    "motion": (_all(_is_text), "a list of texts"),
    "curve": (_all(_is_count), "a list of whole numbers"),
    **dict.fromkeys(("ordinate", "energy", "potential", "conjugate", "stretch", "slope"), MAYBE),
    **dict.fromkeys(("drift", "arclength", "error", "estimate"), MAYBE),
}
SPECIAL: Kinds = {
    "kind": (lambda x: isinstance(x, str) and x in KINDS, f"one of {', '.join(KINDS)}"),
    **dict.fromkeys(("row", "negative_before", "negative_after", "multiplicity", "zero"), COUNT),
    "load": NUMBER,
    **dict.fromkeys(("ordinate", "energy", "located_to", "error_estimate", "ordinate_error_estimate"), MAYBE),
    **dict.fromkeys(("coupling", "unfolding", "omega2"), MAYBE),
    **dict.fromkeys(("resolved", "followed"), FLAG),
    "meets": PLACE,
    "law": (_or_none(_is_object), "an object or null"),
    "note": (_or_none(_is_text), "a text or null"),
}
LAW: Kinds = {"kind": TEXT, "coefficient": MAYBE, "power": COUNT, "uncertainty": MAYBE, "side": NUMBER, "of": TEXT}


def read_diagram(path: Path, needs: tuple[str, ...]) -> dict[str, Any]:
    """Read a diagram; raises :class:`InputError` where there is none, or where an entry is not of its kind."""
    data = read_json(path, DIAGRAM, needs)
    check_diagram(data, path)
    return data


def check_diagram(data: Mapping[str, Any], where: Path | str) -> None:
    """Raise :class:`InputError` where an entry of a diagram is not of its kind; ``where`` names the file."""
    _check(data, TOP, where)
    meshes = data.get("meshes", [])
    for mesh in [*meshes, data.get("discretization", {})]:
        _check(mesh, MESH, where)
    for branch in data.get("branches", []):
        here = f"{where}, branch {SHORT.repr(branch.get('name'))},"
        _check(branch, BRANCH, here)
        if "columns" not in branch:
            continue
        rows = _rows(branch["columns"], len(meshes), here)
        if rows:
            _require(branch["columns"], ROW, here)
        for i, special in enumerate(branch.get("special", [])):
            _require(special, POINT, f"{here} special point {i},")
            _check(special, SPECIAL, f"{here} special point {i},")
            _check(special.get("law") or {}, LAW, f"{here} special point {i},")
            if special.get("row", 0) >= rows:
                raise InputError(f"{here} has a special point in row {special['row']} of {rows}: run the scene again.")
        for change in branch.get("unexplained", []):
            _check(change, {"row": COUNT}, here)
            if change.get("row", 0) + 1 >= rows:
                raise InputError(f"{here} has an unexplained change in row {change['row']} of {rows}: run it again.")


def _require(data: Mapping[str, Any], names: Sequence[str], where: str) -> None:
    if missing := [name for name in names if name not in data]:
        raise InputError(f"{where} has no {missing[0]}: run the scene again.")


def _rows(columns: Mapping[str, list[Any]], meshes: int, where: str) -> int:
    """Check the columns of a branch; return their length."""
    lengths = {name: len(column) for name, column in columns.items()}
    rows = max(lengths.values(), default=0)
    if columns and (not rows or min(lengths.values()) < rows):
        raise InputError(f"{where} has columns of the lengths {SHORT.repr(lengths)}: give one length to all.")
    for name, column in columns.items():
        for row in range(rows) if name in COLUMN else ():
            _check({name: column[row]}, {name: COLUMN[name]}, f"{where} row {row},")
    if meshes and max(columns.get("mesh", [0])) >= meshes:
        raise InputError(f"{where} has a row of mesh {max(columns['mesh'])}, of {meshes}: run the scene again.")
    return rows


def _check(data: Mapping[str, Any], kinds: Kinds, where: Path | str) -> None:
    for name, (test, words) in kinds.items():
        if name in data and not test(data[name]):
            raise InputError(
                f"{where} has the {name} {SHORT.repr(data[name])} in the place of {words}: run the scene again."
            )


def check_run(data: dict[str, Any], states: Path) -> None:
    """Raise :class:`InputError` where ``states.h5`` is of another run than the ``data`` of a ``diagram.json``."""
    import h5py

    try:
        with h5py.File(states, "r") as file:
            STATES.check_hdf5(file)
            run = file.attrs.get("run")
    except OSError as trouble:
        raise InputError(f"{states} is no {STATES.name} ({trouble}): give {STATES.file}.") from trouble
    if run != data.get("run"):
        raise InputError(
            f"{states} and the diagram.json beside it are of different runs: keep the files of one run together, or "
            "run the scene again."
        )

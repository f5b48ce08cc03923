"""Contents of ``diagram.json`` as its readers rely on them.

Rows and special points have what all readers need; other entries that are missing are the matter of each reader.  Those
that are there are of their type, columns have one length, and rows and meshes that are named exist.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, STATES, read_json
from rodfem.output.table import COLUMNS, SPECIAL, Test, test_of
from rodfem.problem.arguments import SHORT

ROW, POINT = ("load", "ordinate"), ("kind", "load", "ordinate", "negative_before", "negative_after", "zero", "row")
"""Entries of every row and of every special point."""
Kinds = Mapping[str, tuple[Test, str]]


def _named(kind: str, words: str) -> tuple[Test, str]:
    return lambda x: isinstance(x, dict) and all(map(test_of(kind)[0], x.values())), words


WORDS = ("scene", "title", "parameter", "ordinate", *(f"parameter_{x}" for x in ("label", "words", "unit")))
MORE = (lambda x: x != [] and test_of("object (k)")[0](x), "a list of objects, one or more")
TOP: Kinds = {
    **dict.fromkeys((*WORDS, "ordinate_label", "ordinate_unit"), test_of("text")),
    **dict.fromkeys(("constants", "natural"), _named("number", "numbers by name")),
    "range": (test_of("number (2)")[0], "two finite numbers"),
    "accuracy": test_of("number or null"),
    **dict.fromkeys(("discretization", "origin"), test_of("object")),
    **dict.fromkeys(("meshes", "branches"), MORE),
}
MESH: Kinds = {
    "formulation": test_of("text"),
    **dict.fromkeys(("elements", "degree", "unknowns"), test_of("integer")),
    "vertices": (lambda x: x is None or test_of("number (k)")[0](x), "a list of numbers, or null"),
}
BRANCH: Kinds = {
    "name": test_of("name"),
    "parent": test_of("place or null"),
    **dict.fromkeys(("ended", "image"), test_of("text")),
    "columns": (lambda x: isinstance(x, dict) and all(isinstance(y, list) for y in x.values()), "lists by name"),
    **dict.fromkeys(("special", "unexplained"), test_of("object (k)")),
    "singular_start": test_of("integer"),
}
COLUMN: Kinds = {entry.name: test_of(entry.type) for entry in COLUMNS}
OF_SPECIAL: Kinds = {entry.name: test_of(entry.type) for entry in SPECIAL} | {
    "kind": test_of("kind"),
    "followed": test_of("boolean or null"),
}
LAW: Kinds = {
    **dict.fromkeys(("kind", "of"), test_of("text")),
    **dict.fromkeys(("coefficient", "uncertainty"), test_of("number or null")),
    "power": test_of("integer"),
    "side": test_of("number"),
}


def read_diagram(path: Path, needs: tuple[str, ...]) -> dict[str, Any]:
    """Read a diagram; raises :class:`InputError` where there is none, or where an entry is not of its type."""
    data = read_json(path, DIAGRAM, needs)
    check_diagram(data, path)
    return data


def check_diagram(data: Mapping[str, Any], where: Path | str) -> None:
    """Raise :class:`InputError` where an entry of a diagram is not of its type; ``where`` names the file."""
    _check(data, TOP, where)
    meshes = data.get("meshes", [])
    for mesh in [*meshes, data.get("discretization", {})]:
        _check(mesh, MESH, where)
    for branch in data.get("branches", []):
        here = f"{where}, branch {SHORT.repr(branch.get('name'))},"
        _check(branch, BRANCH, here)
        if "columns" in branch:
            _check_rows(branch, _rows(branch["columns"], len(meshes), here), here)


def _check_rows(branch: Mapping[str, Any], rows: int, where: str) -> None:
    """Check what is in each of so many ``rows`` of a branch."""
    if rows:
        _require(branch["columns"], ROW, where)
    for i, special in enumerate(branch.get("special", [])):
        here = f"{where} special point {i},"
        _require(special, POINT, here)
        _check(special, OF_SPECIAL, here)
        _check(special.get("law") or {}, LAW, here)
        if special.get("row", 0) >= rows:
            raise InputError(f"{where} has a special point in row {special['row']} of {rows}: run the scene again.")
    for change in branch.get("unexplained", []):
        _check(change, {"row": test_of("integer")}, where)
        if change.get("row", 0) + 1 >= rows:
            raise InputError(f"{where} has an unexplained change in row {change['row']} of {rows}: run it again.")


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

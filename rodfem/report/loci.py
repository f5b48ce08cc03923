"""Loci of special points, ``locus-*.json``, as the page draws them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from rodfem.errors import InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.output.digits import with_unit
from rodfem.output.plot_locus import LINES
from rodfem.output.stable_region import stable_region
from rodfem.report.labels import html_of
from rodfem.tolerances import SAME_SPECIAL, unit

NEEDED = ("parameters", "columns", "marks", "start", "labels", "kind", "bounds")
REGION = 120
"""Values of the second parameter at which the page has the bounds of a region."""


def loci_of(folder: Path, data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Loci of a folder in the order of their numbers; raises :class:`InputError` for one of another load."""
    files = sorted(folder.glob("locus-*.json"), key=lambda path: (len(path.name), path.name))
    read = [read_json(path, LOCUS, NEEDED) for path in files]
    found = [_locus(path, one, data) for path, one in zip(files, read, strict=True)]
    return [shown | {"region": _region(one, read)} for shown, one in zip(found, read, strict=True)]


def _region(one: Mapping[str, Any], loci: Sequence[Mapping[str, Any]]) -> list[list[float]] | None:
    """The stable region beside a locus: values of the second parameter, and its two bounds of the load there."""
    same = [other for other in loci if other["parameters"] == one["parameters"]]
    region = stable_region(one, same, REGION)
    return region and [column.tolist() for column in region]


def _special_points(one: Mapping[str, Any], data: Mapping[str, Any]) -> list[list[int]]:
    """Branch and row of each special point of the diagram that the locus passes, by their numbers."""
    return [
        [number, special["row"]]
        for number, branch in enumerate(data["branches"])
        for special in branch["special"]
        if special["kind"] == one["kind"]
        and any(_same(special, place, data.get("natural") or {}) for place in one.get("crossings", ()))
    ]


def _same(special: Mapping[str, Any], place: Sequence[float], natural: Mapping[str, float]) -> bool:
    """Whether a special point has the load and the ordinate of a place, whose ``natural`` sizes an old file lacks."""
    return all(
        abs(special[name] - y) <= SAME_SPECIAL * unit(special[name], y, one=natural.get(name, 1.0))
        for name, y in zip(("load", "ordinate"), place, strict=True)
    )


def _label(one: Mapping[str, Any]) -> str:
    """The second parameter for its axis: in words and with its unit, which a file may lack, and its symbol."""
    words, unit = (str((one.get(name) or ("", ""))[1]).replace("$", "") for name in ("words", "units"))
    symbol = html_of(str(one["labels"][1]), always=True)
    return " ".join(filter(None, (escape(words), symbol, escape(with_unit("", unit).strip()))))


def _locus(path: Path, one: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    load, other = one["parameters"]
    if load != data["parameter"] or other not in data["constants"] or one["kind"] not in LINES:
        raise InputError(f"{path} is no locus of the diagram beside it: keep the files of one run together.")
    columns = one["columns"]
    try:
        x, y = ([float(value) for value in columns[name]] for name in (other, load))
        index = [[int(value) for value in pair] for pair in columns["index"]]
        marks = [(int(mark["row"]), str(mark["kind"])) for mark in one["marks"]]
    except (KeyError, TypeError, ValueError) as trouble:
        raise InputError(f"{path} has columns that are no numbers ({trouble}): run the scene again.") from trouble
    if not len(x) == len(y) == len(index) or any(not 0 <= row < len(x) for row, _ in marks):
        raise InputError(f"{path} has columns of different lengths, or marks outside: run the scene again.")
    return {
        "file": path.name,
        "kind": one["kind"],
        "colour": LINES[one["kind"]][0],
        "x": x,
        "load": y,
        "index": index,
        "marks": [{"row": row, "kind": kind} for row, kind in marks],
        "parameter": other,
        "label": _label(one),
        "special": _special_points(one, data),
        "here": data["constants"][other],
    }

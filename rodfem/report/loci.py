"""Loci of special points, ``locus-*.json``, as the page draws them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from rodfem.errors import InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.output.digits import number, with_unit
from rodfem.output.plot_locus import LINES, in_words, plane_of, stable_region
from rodfem.report.labels import html_of
from rodfem.tolerances import same_special

NEEDED = ("parameters", "columns", "marks", "start", "labels", "kind", "bounds")


def loci_of(folder: Path, data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Loci of a folder in the order of their numbers; raises :class:`InputError` for one of another load."""
    files = sorted(folder.glob("locus-*.json"), key=lambda path: (len(path.name), path.name))
    read = [read_json(path, LOCUS, NEEDED) for path in files]
    found = [_locus(path, one, data) for path, one in zip(files, read, strict=True)]
    return [shown | {"region": _region(one, read)} for shown, one in zip(found, read, strict=True)]


def _region(one: Mapping[str, Any], loci: Sequence[Mapping[str, Any]]) -> list[list[float]] | None:
    """The stable region beside a locus: values of the second parameter, and its two bounds of the load there."""
    same = [other for other in loci if other["parameters"] == one["parameters"]]
    region = stable_region(one, same)
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
    one = natural.get("load", 1.0), natural.get("ordinate", 1.0)
    here = special["load"], special["ordinate"]
    return same_special(here, special.get("located_to") or 0.0, (place[0], place[1]), one)


def _label(one: Mapping[str, Any]) -> str:
    """The second parameter for its axis: in words and with its unit, which a file may lack, and its symbol."""
    words, unit = (str((one.get(name) or ("", ""))[1]).replace("$", "") for name in ("words", "units"))
    symbol = html_of(str(one["labels"][1]), always=True)
    return " ".join(filter(None, (escape(words), symbol, escape(with_unit("", unit).strip()))))


def _readings(one: Mapping[str, Any], places: Iterable[tuple[float, float]]) -> list[list[str]]:
    """Both parameters, the load last, of each row with an error as ``0.3216501 (3e-07)``; empty for others."""
    errors: Sequence[Sequence[Any]] = one["columns"].get("error") or []
    unresolved, found = {*one.get("unresolved", ())}, list[list[str]]()
    for row, (x, y) in enumerate(places):
        pair: Sequence[Any] = errors[row] if row < len(errors) else (None, None)
        resolved = row not in unresolved
        found.append([] if None in pair else [number(x, pair[1], resolved), number(y, pair[0], resolved)])
    return found


def _locus(path: Path, one: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    load, other = one["parameters"]
    if load != data["parameter"] or other not in data["constants"] or one["kind"] not in LINES:
        raise InputError(f"{path} is no locus of the diagram beside it: keep the files of one run together.")
    x, y, index, marks = _rows(path, one)
    return {
        "file": path.name,
        "kind": one["kind"],
        "colour": LINES[one["kind"]][0],
        "x": x,
        "load": y,
        "index": index,
        "readings": _readings(one, zip(x, y, strict=True)),
        "plane": plane_of(one),
        "words": in_words(one),
        "marks": [{"row": row, "kind": kind} for row, kind in marks],
        "parameter": other,
        "label": _label(one),
        "special": _special_points(one, data),
        "here": data["constants"][other],
    }


def _rows(
    path: Path, one: Mapping[str, Any]
) -> tuple[list[float], list[float], list[list[int]], list[tuple[int, str]]]:
    """Second parameter, load, indices and marks of a locus; raises :class:`InputError` where they are none."""
    try:
        x, y = ([float(value) for value in one["columns"][name]] for name in reversed(one["parameters"]))
        index = [[int(value) for value in pair] for pair in one["columns"]["index"]]
        marks = [(int(mark["row"]), str(mark["kind"])) for mark in one["marks"]]
    except (KeyError, TypeError, ValueError) as trouble:
        raise InputError(f"{path} has columns that are no numbers ({trouble}): run the scene again.") from trouble
    if not len(x) == len(y) == len(index) or any(not 0 <= row < len(x) for row, _ in marks):
        raise InputError(f"{path} has columns of different lengths, or marks outside: run the scene again.")
    return x, y, index, marks

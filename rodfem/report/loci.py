"""Loci of special points, ``locus-*.json``, as the page draws them."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from rodfem.errors import InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.output.digits import with_unit
from rodfem.output.plot_locus import LINES
from rodfem.report.labels import html_of

NEEDED = ("parameters", "columns", "marks", "start", "labels", "kind")


def loci_of(folder: Path, data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Loci of a folder in the order of their numbers; raises :class:`InputError` for one of another load."""
    files = sorted(folder.glob("locus-*.json"), key=lambda path: (len(path.name), path.name))
    return [_locus(path, data) for path in files]


def _label(one: Mapping[str, Any]) -> str:
    """The second parameter for its axis: in words and with its unit, which a file may lack, and its symbol."""
    words, unit = (str((one.get(name) or ("", ""))[1]).replace("$", "") for name in ("words", "units"))
    symbol = html_of(str(one["labels"][1]), always=True)
    return " ".join(filter(None, (escape(words), symbol, escape(with_unit("", unit).strip()))))


def _locus(path: Path, data: Mapping[str, Any]) -> dict[str, Any]:
    one = read_json(path, LOCUS, NEEDED)
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
        "here": data["constants"][other],
    }

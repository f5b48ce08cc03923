"""Branches of ``diagram.json``, and loci of special points, as the page draws them: numbers, curves and words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from html import escape
from math import nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.modes.modes import RIGID
from rodfem.output.pieces import endings, pieces_of
from rodfem.output.plot_diagram import between
from rodfem.output.plot_frequencies import SPECIAL, curves, ranges_of, top
from rodfem.output.plot_locus import LINES, in_words, plane_of, stable_region
from rodfem.output.words import number, readings_of, with_unit, words_of
from rodfem.report.markup import html_of, plain
from rodfem.tolerances import NEGLIGIBLE, same_special
from rodfem.writhe import writhe

if TYPE_CHECKING:
    from rodfem.report.rods import Shapes

UNLISTED = ("load", "negative", "zero", "mesh", "unstable", "negative_in_space", "drift", "error")
"""Columns that are no ordinates: the abscissa, counts, and residuals."""
VANISHED = 1e-9
"""Share of the greatest recorded eigenvalue up to which one may be one that vanishes."""
SHORTENING, WRITHE = "end shortening", "writhe"
DERIVED = {
    SHORTENING: "end shortening: length − distance of the ends",
    WRITHE: "writhe: Gauss integral of the centreline, to about 1e-4",
}
"""Ordinates that follow from the shapes, in words."""


def branch_data(
    branch: Mapping[str, Any], shapes: Shapes, colour: str, natural: Mapping[str, float], *, planar: bool = False
) -> dict[str, Any]:
    """A ``branch`` in a ``colour``; ``shapes`` are those of its rows, ``natural`` the sizes of load and ordinate.

    Words of stable rows say whether the rod is ``planar``.
    """
    columns = branch["columns"]
    words = words_of(branch, planar=planar)
    different = list(dict.fromkeys(words))
    ordinates = {name: _clear(columns[name], natural.get(name, 0.0)) for name in _listed(columns)} | _derived(shapes)
    return {
        "name": branch["name"],
        "colour": colour,
        "parent": branch["parent"],
        "ended": branch["ended"],
        "endings": endings(branch),
        "load": columns["load"],
        "negative": columns["negative"],
        "ordinates": ordinates,
        "between": _between(branch, ordinates),
        "readings": readings_of(branch, natural),
        "pieces": [{"rows": [x.first, x.last], "kind": x.kind, "index": x.label} for x in pieces_of(branch)],
        "special": [_special(x) for x in branch["special"]],
        "words": [different.index(each) for each in words],
        "told": [asdict(each) for each in different],
        "spectrum": _spectrum(branch),
        "omega2": _without_noise(columns),
        "frequencies": frequencies_of(branch),
        "unexplained": [change["row"] for change in branch.get("unexplained") or ()],
    }


def frequencies_of(branch: Mapping[str, Any]) -> dict[str, Any] | None:
    """Curves, unstable ranges and special points of a branch; None where no frequencies are recorded."""
    columns = branch["columns"]
    if not columns.get("omega2"):
        return None
    return {
        "curves": [
            {
                "motion": curve.motion,
                "colour": curve.colour,
                "load": plain(curve.loads),
                "rows": curve.rows.tolist(),
                "parts": {"frequency": plain(curve.real)} | {name: plain(part) for name, part in curve.parts.items()},
            }
            for curve in curves(columns, branch["special"])
        ],
        "ranges": [found._asdict() for found in ranges_of(branch)],
        "marks": [
            {"kind": special["kind"], "row": special["row"], "frequency": abs(complex(special["omega2"])) ** 0.5}
            for special in branch["special"]
            if special["kind"] in SPECIAL
        ],
        "top": top(branch, 3),
    }


def _clear(values: Iterable[Any], size: float) -> list[float | None]:
    """Values of an ordinate; zero where they are the round-off of numbers of its natural ``size``."""
    found = np.array([nan if value is None else value for value in values], dtype=float)
    found[abs(found) < NEGLIGIBLE * size] = 0.0
    return plain(found)


def _spectrum(branch: Mapping[str, Any]) -> list[list[float]] | None:
    """Left-most eigenvalues of each row, those that vanish as zero: no more of them than the row's count has."""
    columns = branch["columns"]
    if "spectrum" not in columns:
        return None
    found = [list(values) for values in columns["spectrum"]]
    for values, zero in zip(found, columns["zero"], strict=True):
        for i in sorted(range(len(values)), key=lambda i: abs(values[i]))[:zero]:
            if abs(values[i]) < VANISHED * max(map(abs, values)):
                values[i] = 0.0
    return found


def _without_noise(columns: Mapping[str, Any]) -> list[list[list[float]]] | None:
    """Squared frequencies of each row; those of rigid motions, zero in exact arithmetic, are."""
    if "omega2" not in columns:
        return None
    rows = zip(columns["omega2"], columns["motion"], strict=True)
    return [[[0.0, 0.0] if name == RIGID else value for value, name in zip(*row, strict=True)] for row in rows]


def _between(branch: Mapping[str, Any], ordinates: Mapping[str, Any]) -> dict[str, dict[int, list[list[float]]]]:
    """Loads and values of each ordinate between rows, by the row before, where these are far from each other."""
    more = {**branch, "columns": {**branch["columns"], **ordinates}}
    return {name: {row: found.T.tolist() for row, found in between(more, name).items()} for name in ordinates}


def ordinates_of(data: Mapping[str, Any]) -> list[str]:
    """Ordinates that all branches have, the scene's first."""
    common = [name for name in _listed(data["branches"][0]["columns"])]
    for branch in data["branches"]:
        common = [name for name in common if name in branch["columns"]]
    return [*common, *DERIVED]


def _listed(columns: Mapping[str, Any]) -> Iterable[str]:
    names = [name for name in columns if name not in UNLISTED]
    return sorted((name for name in names if _numbers(columns[name])), key=lambda name: name != "ordinate")


def _numbers(column: Iterable[Any]) -> bool:
    return all(x is None or (isinstance(x, (int, float)) and not isinstance(x, bool)) for x in column)


def _derived(shapes: Shapes) -> dict[str, list[float | None]]:
    length = shapes.s[-1] - shapes.s[0]
    ends = np.linalg.norm(shapes.r[:, -1] - shapes.r[:, 0], axis=1)
    return {
        SHORTENING: plain(length - ends),
        WRITHE: plain(np.array([writhe(CubicSpline(shapes.s, r), (shapes.s[0], shapes.s[-1])) for r in shapes.r])),
    }


def _special(special: Mapping[str, Any]) -> dict[str, Any]:
    kind = KINDS[special["kind"]]
    before, after = special["negative_before"], special["negative_after"]
    return {
        "kind": special["kind"],
        "row": special["row"],
        "index": str(before) if before == after else f"{before}→{after}",
        "law": (special.get("law") or {}).get("kind", ""),
        "note": special.get("note") or "",
        "drawn": bool(kind.marker),
    }


# --- loci
NEEDED = ("parameters", "columns", "marks", "start", "labels", "kind", "bounds")


def loci_of(folder: Path, data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Loci of a folder in the order of their numbers; raises :class:`InputError` for one of another load."""
    files = sorted(folder.glob("locus-*.json"), key=lambda path: (len(path.name), path.name))
    read = [read_json(path, LOCUS, NEEDED) for path in files]
    found = [_locus(path, one, data) for path, one in zip(files, read, strict=True)]
    return [shown | {"region": _region(one, read)} for shown, one in zip(found, read, strict=True)]


def _region(one: Mapping[str, Any], loci: Sequence[Mapping[str, Any]]) -> list[list[float]] | None:
    """The stable region next to a locus: values of the second parameter, and its two bounds of the load there."""
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
        and any(_same(special, place, data["natural"]) for place in one.get("crossings", ()))
    ]


def _same(special: Mapping[str, Any], place: Sequence[float], natural: Mapping[str, float]) -> bool:
    """Whether a special point has the load and the ordinate of a place."""
    here, one = (special["load"], special["ordinate"]), (natural["load"], natural["ordinate"])
    return same_special(here, special.get("located_to") or 0.0, (place[0], place[1]), one)


def _label(one: Mapping[str, Any]) -> str:
    """The second parameter for its axis: in words, with its symbol and its unit."""
    words, unit = (one[name][1].replace("$", "") for name in ("words", "units"))
    symbol = html_of(one["labels"][1], always=True)
    return " ".join(filter(None, (escape(words), symbol, escape(with_unit("", unit).strip()))))


def _readings(one: Mapping[str, Any], places: Iterable[tuple[float, float]]) -> list[list[str]]:
    """Both parameters, the load last, of each row with an error as ``0.3216501 (3e-07)``; empty for others."""
    unresolved, found = {*one.get("unresolved", ())}, list[list[str]]()
    for row, ((x, y), pair) in enumerate(zip(places, one["columns"]["error"], strict=True)):
        resolved = row not in unresolved
        found.append([] if None in pair else [number(x, pair[1], resolved), number(y, pair[0], resolved)])
    return found


def _locus(path: Path, one: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    load, other = one["parameters"]
    if load != data["parameter"] or other not in data["constants"] or one["kind"] not in LINES:
        raise InputError(f"{path} is no locus of the diagram next to it: keep the files of one run together.")
    x, y = (one["columns"][name] for name in (other, load))
    return {
        "file": path.name,
        "kind": one["kind"],
        "colour": LINES[one["kind"]][0],
        "x": x,
        "load": y,
        "index": one["columns"]["index"],
        "readings": _readings(one, zip(x, y, strict=True)),
        "plane": plane_of(one),
        "words": in_words(one),
        "marks": [{"row": mark["row"], "kind": mark["kind"]} for mark in one["marks"]],
        "parameter": other,
        "label": _label(one),
        "special": _special_points(one, data),
        "here": data["constants"][other],
    }

"""Branches of ``diagram.json``, and loci of special points, as the page draws them: numbers, curves, words, labels."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from html import escape, unescape
from html.entities import html5
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from rodfem.continuation.kinds import KINDS
from rodfem.errors import InputError
from rodfem.file_format import LOCUS, read_json
from rodfem.modes.modes import RIGID
from rodfem.output.pieces import endings, pieces_of
from rodfem.output.plot_diagram import dense_rows
from rodfem.output.plot_frequencies import SPECIAL, curves, ranges_of, top
from rodfem.output.plot_locus import LINES, in_words, plane_of, stable_region
from rodfem.output.table import plain
from rodfem.output.words import number, readings_of, with_unit, words_of
from rodfem.tolerances import NEGLIGIBLE, SAME_LOAD, same_special
from rodfem.writhe import writhe

if TYPE_CHECKING:
    from rodfem.report.rods import Shapes

UNLISTED = ("load", "negative", "zero", "mesh", "unstable", "negative_in_space", "drift", "error")
"""Columns that are no ordinates: the abscissa, counts, and residuals."""
VANISHED = 1e-9  # share of the greatest recorded eigenvalue up to which one may be one that vanishes
DERIVED = {
    "end shortening": "end shortening: length − distance of the ends",
    "writhe": "writhe: Gauss integral of the centreline, to about 1e-4",
}
"""Ordinates that follow from the shapes, in words."""
SIGNS = {
    **{"infty": "∞", "partial": "∂", "cdot": "·", "to": "→", "sqrt": "√", "varphi": "φ", "varepsilon": "ε"},
    **dict.fromkeys((",", ";", ":", " ", "quad"), " "),
    **dict.fromkeys(("!", "left", "right", "mathrm", "mathbf", "mathit", "text", "rm", "bf"), ""),
}
"""Commands of TeX and the characters for them, where HTML has no entity of their name."""
ESCAPES = str.maketrans({"<": "\\u003c", ">": "\\u003e", "&": "\\u0026", "\u2028": "\\u2028", "\u2029": "\\u2029"})
"""Characters that could end a script, or begin a comment, as JSON also writes them."""

Data = Mapping[str, Any]


def branch_data(branch: Data, shapes: Shapes, colour: str, data: Data) -> dict[str, Any]:
    """A ``branch`` of the ``data`` of a diagram in a ``colour``; ``shapes`` are those of its rows."""
    columns, natural = branch["columns"], data["natural"]
    words = words_of(branch, planar=bool(data.get("planar")), leaves=_parent(branch, data["branches"]))
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
        "between": _curve(branch, ordinates),
        "readings": readings_of(branch, natural),
        "pieces": [{"rows": [x.first, x.last], "kind": x.kind, "index": x.label} for x in pieces_of(branch)],
        "special": [_special(x) for x in branch["special"]],
        "words": [different.index(each) for each in words],
        "told": [asdict(each) for each in different],
        "spectrum": _spectrum(branch),
        "omega2": _without_noise(columns),
        "rates": bool(branch.get("rates")),
        "frequencies": _frequencies(branch) if columns.get("omega2") else None,
        "unexplained": [change["row"] for change in branch.get("unexplained") or ()],
    }


def _curve(branch: Data, ordinates: Data) -> dict[str, dict[int, list[list[float]]]]:
    """Loads and values of each ordinate between rows, by the row before, where these are far from each other."""
    more = {**branch, "columns": {**branch["columns"], **ordinates}}
    return {name: {row: found.T.tolist() for row, found in dense_rows(more, name).items()} for name in ordinates}


def ordinates_of(data: Data) -> list[str]:
    """Ordinates that all branches have, the scene's first."""
    first, *others = (branch["columns"] for branch in data["branches"])
    return [*(name for name in _listed(first) if all(name in columns for columns in others)), *DERIVED]


def _parent(branch: Data, branches: Sequence[Data]) -> str:
    """Name of the branch from whose branch point this one leaves; empty if its first row is elsewhere."""
    name, number = branch["parent"] or ("", 0)
    found = [x["special"][number]["load"] for x in branches if x["name"] == name and number < len(x["special"])]
    return name if found and np.isclose(found[0], branch["columns"]["load"][0], rtol=SAME_LOAD, atol=0.0) else ""


def _listed(columns: Data) -> list[str]:
    """Columns of numbers that are ordinates, the scene's first."""

    def is_ordinate(name: str) -> bool:
        kinds = {type(x) for x in columns[name]}
        return name not in UNLISTED and kinds <= {int, float, type(None)}

    return sorted(filter(is_ordinate, columns), key=lambda name: name != "ordinate")


def _clear(values: Iterable[Any], size: float) -> list[float | None]:
    """Values of an ordinate; zero where they are the round-off of numbers of its natural ``size``."""
    found = np.array([*values], dtype=float)
    found[abs(found) < NEGLIGIBLE * size] = 0.0
    return plain(found)


def _derived(shapes: Shapes) -> dict[str, list[float | None]]:
    length = shapes.s[-1] - shapes.s[0]
    ends = np.linalg.norm(shapes.r[:, -1] - shapes.r[:, 0], axis=1)
    turns = [writhe(CubicSpline(shapes.s, r), (shapes.s[0], shapes.s[-1])) for r in shapes.r]
    return dict(zip(DERIVED, (plain(length - ends), plain(turns)), strict=True))


def _spectrum(branch: Data) -> list[list[float]] | None:
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


def _without_noise(columns: Data) -> list[list[list[float]]] | None:
    """Squared frequencies of each row; those of rigid motions, zero in exact arithmetic, are."""
    if "omega2" not in columns:
        return None
    rows = zip(columns["omega2"], columns["motion"], strict=True)
    return [[[0.0, 0.0] if name == RIGID else value for value, name in zip(*row, strict=True)] for row in rows]


def _frequencies(branch: Data) -> dict[str, Any]:
    """Curves, unstable ranges and special points of a branch."""
    return {
        "curves": [
            {
                "motion": curve.motion,
                "colour": curve.colour,
                "load": plain(curve.loads),
                "rows": curve.rows.tolist(),
                "parts": {"frequency": plain(curve.real)} | {name: plain(part) for name, part in curve.parts.items()},
            }
            for curve in curves(branch)
        ],
        "ranges": [found._asdict() for found in ranges_of(branch)],
        "marks": [
            {"kind": special["kind"], "row": special["row"], "frequency": abs(complex(special["omega2"])) ** 0.5}
            for special in branch["special"]
            if special["kind"] in SPECIAL
        ],
        "top": top(branch),
    }


def _special(special: Data) -> dict[str, Any]:
    before, after = special["negative_before"], special["negative_after"]
    return {
        "kind": special["kind"],
        "row": special["row"],
        "index": str(before) if before == after else f"{before}→{after}",
        "law": (special.get("law") or {}).get("kind", ""),
        "note": special.get("note") or "",
        "drawn": bool(KINDS[special["kind"]].marker),
        "densities": special.get("densities") or {},
    }


# --- loci


def loci_of(folder: Path, data: Data) -> list[dict[str, Any]]:
    """Loci of a folder in the order of their numbers; raises :class:`InputError` for one of another load."""
    files = sorted(folder.glob("locus-*.json"), key=lambda path: (len(path.name), path.name))
    needed = ("parameters", "columns", "marks", "start", "labels", "kind", "bounds")
    read = [read_json(path, LOCUS, needed) for path in files]
    return [_locus(path, one, read, data) for path, one in zip(files, read, strict=True)]


def _locus(path: Path, one: Data, loci: Sequence[Data], data: Data) -> dict[str, Any]:
    """A locus; its region is the stable one next to it: values of the second parameter, and bounds of the load."""
    load, other = one["parameters"]
    if load != data["parameter"] or other not in data["constants"] or one["kind"] not in LINES:
        raise InputError(f"{path} is no locus of the diagram next to it: keep the files of one run together.")
    x, y = (one["columns"][name] for name in (other, load))
    region = stable_region(one, [each for each in loci if each["parameters"] == one["parameters"]])
    _, words = one["words"]
    _, unit = one["units"]
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
        "label": label_of(words.replace("$", ""), one["labels"][1], unit.replace("$", "")),
        "special": _special_points(one, data),
        "here": data["constants"][other],
        "region": region and [column.tolist() for column in region],
    }


def _special_points(one: Data, data: Data) -> list[list[int]]:
    """Branch and row of each special point of the diagram that the locus passes, by their numbers."""
    natural, out = data["natural"], []
    for order, branch in enumerate(data["branches"]):
        for special in (special for special in branch["special"] if special["kind"] == one["kind"]):
            here, located = (special["load"], special["ordinate"]), special.get("located_to") or 0.0
            places = ((place[0], place[1]) for place in one.get("crossings", ()))
            if any(same_special(here, located, place, (natural["load"], natural["ordinate"])) for place in places):
                out.append([order, special["row"]])
    return out


def _readings(one: Data, places: Iterable[tuple[float, float]]) -> list[list[str]]:
    """Both parameters, the load last, of each row with an error as ``0.3216501 (3e-07)``; empty for others."""
    unresolved, found = {*one.get("unresolved", ())}, list[list[str]]()
    for row, ((x, y), pair) in enumerate(zip(places, one["columns"]["error"], strict=True)):
        resolved = row not in unresolved
        found.append([] if None in pair else [number(x, pair[1], resolved), number(y, pair[0], resolved)])
    return found


# --- labels in TeX as HTML, JSON that closes no element, arrays in base64


def label_of(words: str, symbol: str, unit: str) -> str:
    """HTML of a parameter for its axis: in words, with its symbol and its unit."""
    return " ".join(filter(None, (escape(words), html_of(symbol, always=True), escape(with_unit("", unit).strip()))))


def html_of(label: str, always: bool = False) -> str:
    """HTML of a label with TeX between dollars; ``always``, also of one without dollars, is TeX as a whole."""
    text = escape(label)
    if "$" in text:
        return re.sub(r"\$([^$]*)\$", lambda found: _maths(found[1]), text)
    return _maths(text) if always or "\\" in text else text


def plain_of(label: str, always: bool = False) -> str:
    """The same as text without elements, escaped for none: for buttons and titles."""
    return unescape(re.sub(r"</?(?:sub|sup)>", "", html_of(label, always)))


def _maths(text: str) -> str:
    def raised(found: re.Match[str]) -> str:
        tag = "sub" if found[1] == "_" else "sup"
        return f"<{tag}>{found[2] or found[3]}</{tag}>"

    text = re.sub(r"\\d?frac\{([^{}]*)\}\{([^{}]*)\}", r"\1/\2", text)
    text = re.sub(r"\\([a-zA-Z]+|.) ?", lambda x: SIGNS.get(x[1], html5.get(f"{x[1]};", x[1])), text)
    return re.sub(r"([_^])(?:\{([^{}]*)\}|(.))", raised, text).replace("{", "").replace("}", "")


def packed(array: ArrayLike) -> dict[str, Any]:
    """Shape and values of an array, as ``data.js`` unpacks them: little-endian single precision."""
    values = np.asarray(array, dtype="<f4")
    return {"shape": list(values.shape), "f32": b64encode(values.tobytes()).decode()}


def script_json(data: Any) -> str:
    """JSON that may stand within a script element, whatever its texts are; raises ValueError for nan."""
    return json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":")).translate(ESCAPES)

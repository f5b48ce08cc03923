"""Stability boundaries in a plane of two parameters, drawn from the saved data of loci alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from rodfem.continuation.kinds import BRANCH_POINT, KINDS, USER
from rodfem.file_format import LOCUS
from rodfem.output.sheet import DPI, FONT, HALO, PALETTE, SIZE, STYLE, at_most, mesh_in_words, save, tex

LINES = {name: (PALETTE[kind.line[0]], kind.line[1]) for name, kind in KINDS.items() if kind.line is not None}
"""Colour and dashes by kind."""
POINTS: dict[str, dict[str, Any]] = {
    "start": {**USER.marker, "label": "start"},
    "turns": {"marker": "|", "ms": 9.0, "mec": "black", "mew": 1.4, "label": "turning point"},
    "cusp": {"marker": "^", "ms": 7.5, "mfc": "white", "mec": "black", "mew": 1.4, "label": "cusp"},
    "ends": {"marker": "o", "ms": 6.5, "mfc": "white", "mec": "black", "mew": 1.4, "label": "fold meets branch point"},
}
"""Markers of rows by how what is said of them begins, or for the fold's end how it reads."""

ROOM = 0.1
"""Share of the height above and below the curves, for the indices that stand beside them."""


def draw_locus(loci: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw loci of one scene in the plane of its two parameters, one over the other.

    The first parameter, the load, is upwards.  Beside each curve stand the indices of the equilibria on its two sides
    where they were counted, as ``0|1``.

    Parameters
    ----------
    loci
        Contents of files written by :meth:`rodfem.codim2.locus.Locus.save`, of the same two parameters.
    path
        Picture to write, 7.5 in by 5 in at 200 dpi; the suffix decides the format.

    Returns
    -------
    path
        The picture written; its folder is created where it is missing.

    Raises
    ------
    InputError
        For contents of another or a newer format.
    ValueError
        Without any locus, or if they are not of the same parameters.
    """
    if not loci:
        raise ValueError("There is no locus to draw: give the contents of at least one file.")
    for one in loci:
        LOCUS.check(one, "The locus", ("parameters", "columns", "marks", "start", "labels", "discretization"))
    names = loci[0]["parameters"]
    if any(one["parameters"] != names for one in loci):
        raise ValueError("The loci are of different parameters: draw them one by one.")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        axes.set_axisbelow(True)
        axes.margins(y=ROOM)
        for one in loci:
            kind, columns = one["kind"], one["columns"]
            x, y = (np.asarray(columns[name], dtype=float) for name in reversed(names))
            colour, dashes = LINES[kind]
            axes.plot(x, y, color=colour, linestyle=dashes, linewidth=2.2, label=kind)
            for row, what in [(one["start"], "start"), *((m["row"], m["kind"]) for m in one["marks"])]:
                style = POINTS.get("ends" if BRANCH_POINT in what else what.split()[0])
                if style:
                    axes.plot(x[row], y[row], linestyle="none", zorder=5, path_effects=HALO, **style)
            low, high = columns["index"][len(x) // 2]
            if low >= 0:
                place = (x[len(x) // 2], y[len(x) // 2])
                text = axes.annotate(f"{low}|{high}", place, (6, 6), textcoords="offset points", color=colour)
                text.set(weight="bold", path_effects=HALO)
        axes.set_xlabel(tex(loci[0]["labels"][1], always=True), fontsize=FONT + 3)
        axes.set_ylabel(tex(loci[0]["labels"][0], always=True), fontsize=FONT + 3)
        axes.set_title(tex(loci[0]["title"]))
        handles = {handle.get_label(): handle for handle in axes.get_lines()}
        axes.legend(handles=list(handles.values()), fontsize=8.5)
        figure.supxlabel(_footer(loci), fontsize=FONT - 3, color="0.4", x=0.012, ha="left")
    return save(figure, path)


def _footer(loci: Sequence[Mapping[str, Any]]) -> str:
    """Return the line that names the discretisation and the estimated error, and at how many points it was."""
    errors = [max(e) for one in loci for e in one["columns"]["error"] if e[0] is not None]
    text = mesh_in_words(loci[0]["discretization"])
    points = sum(len(one["columns"]["error"]) for one in loci)
    failed = sum(len(one.get("without_estimate", [])) for one in loci)
    if errors:
        text += f"; curves accurate to {at_most(max(errors))} (estimated at {len(errors)} of {points} points"
        text += f", without success at {failed} more)" if failed else ")"
    elif failed:
        text += f"; the error could not be estimated at any of {failed} points"
    return text

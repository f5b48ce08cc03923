"""Stability boundaries in a plane of two parameters, drawn from the saved data of loci alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rodfem.continuation.kinds import BRANCH_POINT, KINDS, USER
from rodfem.file_format import LOCUS
from rodfem.output.stable_region import in_words, passed, plane_of, stable_region
from rodfem.output.style import DPI, FONT, HALO, PALETTE, SIZE, STYLE, at_most, mesh_in_words, named, save, tex
from rodfem.output.view import POINT

LINES = {name: (PALETTE[kind.line[0]], kind.line[1]) for name, kind in KINDS.items() if kind.line is not None}
"""Colour and dashes by kind."""
POINTS: dict[str, dict[str, Any]] = {
    "start": {**USER.marker, "label": "start"},
    "turns": {"marker": "|", "ms": 9.0, "mec": "black", "mew": 1.4, "label": "turning point"},
    "cusp": {"marker": "^", "ms": 7.5, "mfc": "white", "mec": "black", "mew": 1.4, "label": "cusp"},
    "ends": {"marker": "o", "ms": 6.5, "mfc": "white", "mec": "black", "mew": 1.4, "label": "fold meets branch point"},
}
"""Markers of rows by how what is said of them begins, or for the fold's end how it reads."""

STABLE_SIDE, BAND, STEEP = "#CDE9DF", 60.0, 0.05
"""Colour and width, in pixels, of the shade on the stable side of a curve; vertical component of the unit normal at the
start below which that has no side of the load."""
AFTER, ASIDE = 0.3, 30.0
"""Share of its rows after which the indices of a curve stand, and their distance from it, in pixels."""
LEGEND, BELOW = 3, (0.5, -0.14)
"""Columns of the legend, one less of a rod in its plane, whose words are more, and its place in shares of the axes:
under them, as the whole plane may be shaded."""


def draw_locus(loci: Sequence[Mapping[str, Any]], path: Path) -> Path:
    """Draw loci of one scene in the plane of its two parameters, one over the other.

    The first parameter, the load, is upwards.  Beside each curve stand the indices of the equilibria on its two sides
    where they were counted, as ``0|1``.  The stable side of a curve is shaded as far as the next curve, or the bound of
    the load: there stability is known as far as these curves tell, as no other one was looked for.  Where a curve turns
    back it is shaded next to it.

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
    _check(loci)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        axes.set_axisbelow(True)
        _draw_curves(axes, loci)
        filled = _fill_stable_regions(axes, loci)
        _name(figure, axes, loci)
        figure.draw_without_rendering()
        for one in loci:
            if one not in filled:
                _shade_stable_side(axes, one)
        handles = {handle.get_label(): handle for handle in (*axes.get_lines(), *axes.patches, *axes.collections)}
        columns = LEGEND - 1 if plane_of(loci[0]) else LEGEND
        place = {"ncols": columns, "loc": "upper center", "bbox_to_anchor": BELOW}
        entries = [*handles.values(), *_indices(loci)]
        axes.legend(handles=entries, fontsize=9.5, **place)
        figure.draw_without_rendering()  # the legend has taken its room: pixels are final
        for one in loci:
            _write_indices(axes, one)
    return save(figure, path)


def _check(loci: Sequence[Mapping[str, Any]]) -> None:
    """Raise what :func:`draw_locus` raises for loci that are no picture."""
    if not loci:
        raise ValueError("There is no locus to draw: give the contents of at least one file.")
    for one in loci:
        LOCUS.check(one, "The locus", ("parameters", "columns", "marks", "start", "labels", "discretization"))
    if any(one["parameters"] != loci[0]["parameters"] for one in loci):
        raise ValueError("The loci are of different parameters: draw them one by one.")


def _draw_curves(axes: Axes, loci: Sequence[Mapping[str, Any]]) -> None:
    """Draw the curves with the marks of their rows."""
    for one in loci:
        kind, columns = one["kind"], one["columns"]
        x, y = (np.asarray(columns[name], dtype=float) for name in reversed(one["parameters"]))
        colour, dashes = LINES[kind]
        axes.plot(x, y, color=colour, linestyle=dashes, linewidth=2.2, label=kind)
        for row, what in [(one["start"], "start"), *((m["row"], m["kind"]) for m in one["marks"])]:
            style = POINTS.get("ends" if BRANCH_POINT in what else what.split()[0])
            if style:
                axes.plot(x[row], y[row], linestyle="none", zorder=5, path_effects=HALO, **style)


def _fill_stable_regions(axes: Axes, loci: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Fill the regions that :func:`~rodfem.output.stable_region.stable_region` finds; returns the loci with one."""
    filled = []
    for one in loci:
        if region := stable_region(one, loci):
            axes.fill_between(*region, color=STABLE_SIDE, lw=0, zorder=-1, label=in_words(one))
            filled.append(one)
    return filled


def _indices(loci: Sequence[Mapping[str, Any]]) -> list[Line2D]:
    """Entry of the legend for the indices beside the curves, if there are any."""
    pairs = [pair for one in loci for pair in one["columns"]["index"] if pair[0] >= 0]
    style = {"ls": "none", "marker": r"$\mathbf{i|j}$", "ms": 13, "mfc": "0.3", "mec": "none"}
    return [Line2D([], [], label=f"index{plane_of(loci[0])} on the two sides", **style)] if pairs else []


def _name(figure: Figure, axes: Axes, loci: Sequence[Mapping[str, Any]]) -> None:
    """Name the axes and the picture, and say how it was computed."""
    words, units = (loci[0].get(name, ("", "")) for name in ("words", "units"))
    load, other = (named(*axis) for axis in zip(words, loci[0]["labels"], units, strict=True))
    axes.set_xlabel(other, fontsize=FONT + 1)
    axes.set_ylabel(load, fontsize=FONT + 1)
    axes.set_title(tex(loci[0]["title"]))
    figure.supxlabel(_footer(loci), fontsize=FONT - 3, color="0.4", x=0.012, ha="left")


def _write_indices(axes: Axes, one: Mapping[str, Any]) -> None:
    """Write the indices on both sides beside a curve, off its start."""
    row = round(AFTER * (len(one["columns"]["index"]) - 1))
    low, high = one["columns"]["index"][row]
    if low < 0:
        return
    places = axes.transData.transform(np.column_stack([one["columns"][name] for name in reversed(one["parameters"])]))
    tangent = places[min(row + 1, len(places) - 1)] - places[max(row - 1, 0)]
    normal = np.array([-tangent[1], tangent[0]]) / max(np.hypot(*tangent), POINT)
    normal *= -1.0 if normal[1] < 0.0 else 1.0
    at = axes.transData.inverted().transform(places[row] + ASIDE * np.array([1.5, 1.0]) * normal)
    colour = LINES[one["kind"]][0]
    text = axes.text(*at, f"{low}|{high}", color=colour, weight="bold", ha="center", va="center", zorder=6)
    text.set(path_effects=HALO)


def _shade_stable_side(axes: Axes, one: Mapping[str, Any]) -> None:
    """Shade the side of a locus of branch points on which the index is zero, as far as rows tell: next to the curve.

    The vanishing eigenvalues have one sign to the left of the oriented curve, and the other one to its right, as far as
    another curve crosses it.
    """
    places = axes.transData.transform(np.column_stack([one["columns"][name] for name in reversed(one["parameters"])]))
    along = np.gradient(places, axis=0) if len(places) > 1 else np.zeros_like(places)
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.maximum(np.hypot(*along.T), POINT)[:, None]
    upwards = normals[one["start"], 1]
    if not one.get("lower") or abs(upwards) < STEEP:
        return
    crossings = passed(one)
    sides = np.sign(upwards * one["lower"]) * np.where(crossings % 2, -1.0, 1.0)
    beside = places + BAND * sides[:, None] * normals
    stable = np.array([low == 0 for low, _ in one["columns"]["index"]])
    ends = np.flatnonzero(np.diff(np.concatenate([[-1], np.where(stable, crossings, -1), [-1]])))
    for a, b in pairwise(ends):
        if not stable[a]:
            continue
        outline = np.concatenate([places[a:b], beside[a:b][::-1]])
        axes.fill(
            *axes.transData.inverted().transform(outline).T,
            color=STABLE_SIDE,
            label=f"stable side{plane_of(one)}",
            zorder=0,
        )


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

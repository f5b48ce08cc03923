"""Bifurcation diagrams, drawn from ``diagram.json`` alone."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from rodfem.continuation.kinds import IMPERFECT, KINDS
from rodfem.file_format import DIAGRAM
from rodfem.output.contents import read_diagram
from rodfem.output.endings import endings
from rodfem.output.placement import dense, place_words
from rodfem.output.plot_images import draw_images
from rodfem.output.plot_pieces import COUNTED, STABLE, STYLES, Piece, hidden
from rodfem.output.program import status_of, terse
from rodfem.output.smooth import drawn_pieces
from rodfem.output.style import (
    DPI,
    FONT,
    HALO,
    PALETTE,
    SIZE,
    STYLE,
    at_most,
    axis_label,
    mesh_in_words,
    ordinate_in_words,
    save,
    tex,
)
from rodfem.output.view import POINT

__all__ = ["draw_diagram", "main"]

Floats = NDArray[np.float64]

UNEXPLAINED = "index change unexplained"
SINGULAR = "singular first state, not located"
MARKERS: dict[str, Mapping[str, Any]] = {
    **{name: kind.marker for name, kind in KINDS.items() if kind.marker},
    UNEXPLAINED: {"marker": "^", "ms": 10.5, "mfc": "#F0E442", "mec": "#B3123E", "mew": 1.8},
    SINGULAR: {"marker": "s", "ms": 8.5, "mfc": "#F0E442", "mec": "#B3123E", "mew": 1.8},
}

ENDS = "ends: "
"""Beginning of the words for the end of a branch before the range ends."""
END_MARKER = {"marker": "X", "ms": 8.5, "mfc": "white", "mec": "#B3123E", "mew": 1.3}
SHAPES = ("", "^", "<", "v", ">", "p", "h")
"""Marks along the curves of branches, another one whenever the hues are used up."""
HUES, APART, TINY_MARK = 7, 0.08, 5.0
"""Hues of the palette that are told apart at a glance; distance of marks over the diagonal of the axes; their size."""


NOTE: dict[str, Any] = {"ha": "center", "color": "0.4", "fontsize": FONT - 1}
"""Style of a remark inside the axes."""


def draw_diagram(diagram: Mapping[str, Any], path: Path) -> Path:
    """Draw every branch as ordinate against load, with its stability and its special points.

    Stable parts are solid, unstable ones dotted, each with the number of negative eigenvalues beside it; those of a
    planar rod that are stable in its plane but not in space are dashed, those whose stability is undecided dashes and
    dots, with the least and the greatest index.  Where a stable and another part lie on each
    other, the other one is drawn inside the stable one.  A segment in which the index changes without a special point
    that says so has a mark of warning, and so has a first state that is singular.  Images of branches by a symmetry of
    the scene, of the opposite ordinate, are thin lines: they were not traced.

    Parameters
    ----------
    diagram
        Contents of ``diagram.json``; loads and ordinates are nondimensional.
    path
        Picture to write, 7.5 in by 5 in at 200 dpi; the suffix decides the format (.png, .pdf, .svg).

    Returns
    -------
    path
        The picture written; its folder is created where it is missing.

    Raises
    ------
    InputError
        If these are contents of another or a newer format.
    ValueError
        If there are no branches, if columns of one differ in length, or if the format is unknown.
    KeyError
        If an entry of ``diagram.json`` is missing.
    """
    return save(figure_of(diagram), path)


def figure_of(diagram: Mapping[str, Any]) -> Figure:
    """Figure of a diagram, as :func:`draw_diagram` writes it; raises :class:`ValueError` as that does."""
    DIAGRAM.check(diagram, "The diagram")
    branches = diagram.get("branches")
    if not branches:
        raise ValueError("the diagram has no branches: expected those of a diagram.json; try that of a scene")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI)
        figure.set_layout_engine("constrained", rect=(0.006, 0.04, 0.984, 0.95))
        axes = figure.add_subplot(axisbelow=True)
        handles, pieces, points = _draw_branches(axes, branches)
        axes.margins(0.05, 0.08)
        if _is_flat(branches):
            axes.set_ylim(-1.0, 1.0)
            if len(branches) > 1:
                axes.text(
                    0.5,
                    0.25,
                    "the ordinate is zero all over: another one tells branches apart",
                    transform=axes.transAxes,
                    **NOTE,
                )
        axes.set_xlabel(axis_label(diagram), fontsize=FONT + 1)
        axes.set_ylabel(tex(ordinate_in_words(diagram)))
        title = figure.suptitle(tex(diagram["title"]), fontsize=FONT + 2)
        footer = figure.text(0.012, 0.013, _footer(diagram), color="0.4", fontsize=FONT - 3)
        for text in (title, footer):  # one line each: shrink what is too long
            width = text.get_window_extent().width / figure.bbox.width
            text.set_fontsize(text.get_fontsize() * min(1.0, 0.97 / max(width, POINT)))
        axes.autoscale_view()  # otherwise done when it is drawn: until then pixels are those of other limits
        _uncover(axes, pieces)
        place_words(axes, handles[: len(branches)], handles[len(branches) :], pieces, points)
    return figure


def _is_flat(branches: Sequence[Mapping[str, Any]]) -> bool:
    """Whether the ordinate is zero all over, to the error bars that special points have of it: as of a straight rod."""
    bars = [point.get("ordinate_error_estimate") for branch in branches for point in branch.get("special", [])]
    error = max((bar for bar in bars if bar is not None), default=0.0)
    return all(abs(x) <= error for branch in branches for x in branch["columns"]["ordinate"])


def _draw_branches(
    axes: Axes, branches: Sequence[Mapping[str, Any]]
) -> tuple[list[Line2D], list[Piece], dict[str, Floats]]:
    """Draw all curves and special points; return the legend's handles, the pieces and the points per kind."""
    handles: list[Line2D] = []
    pieces: list[Piece] = []
    found: dict[str, list[tuple[float, float]]] = {}
    for number, (branch, colour) in enumerate(zip(branches, cycle(PALETTE), strict=False)):
        new = list(drawn_pieces(branch, colour))
        pieces += new
        shape = SHAPES[number // HUES % len(SHAPES)]
        handles.append(Line2D([], [], ls="", marker=shape or "s", ms=8, color=colour, label=branch["name"]))
        if shape:
            places = (branch["columns"][key] for key in ("load", "ordinate"))
            axes.plot(*places, ls="", marker=shape, ms=TINY_MARK, color=colour, markevery=APART, zorder=3)
        if not new:
            axes.plot(branch["columns"]["load"], branch["columns"]["ordinate"], ".", color=colour, markersize=9)
        for point in branch.get("special", []):
            found.setdefault(point["kind"], []).append((point["load"], point["ordinate"]))
        found.setdefault(UNEXPLAINED, []).extend(_unexplained(branch))
        for row, reason in endings(branch):
            place = tuple(branch["columns"][key][row] for key in ("load", "ordinate"))
            found.setdefault(f"{ENDS}{reason}", []).append(place)
        if branch.get("singular_start"):
            found.setdefault(SINGULAR, []).append(tuple(branch["columns"][key][0] for key in ("load", "ordinate")))
    for piece in sorted(pieces, key=lambda piece: -piece.negative):  # the stable ones on top: see _uncover
        axes.plot(*piece.curve.T, color=piece.colour, **STYLES[piece.kind])
    drawn = {piece.kind for piece in pieces}
    handles += [Line2D([], [], color="0.45", label=kind, **style) for kind, style in STYLES.items() if kind in drawn]
    in_space = any(piece.in_space is not None for piece in pieces)
    text = "negative eigenvalues" + (" in the plane (in space)" if in_space else "")
    if pieces:
        handles.append(Line2D([], [], ls="", marker="$n$", ms=6, color="0.3", label=text))
    handles += draw_images(axes, branches, [PALETTE[i % len(PALETTE)] for i in range(len(branches))])
    kinds = [*MARKERS, *(kind for kind in found if kind.startswith(ENDS))]
    points = {kind: np.unique(np.array(found[kind], float), axis=0) for kind in kinds if found.get(kind)}
    for kind, places in points.items():
        marker = MARKERS.get(kind, END_MARKER)
        style = {"linestyle": "none", "zorder": 5, "label": _kind_label(kind, branches), **marker}
        handles += axes.plot(*places.T, path_effects=HALO, **style)
    return handles, pieces, points


def _unexplained(branch: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Middles of the segments in which the index changes without a special point that says so."""
    load, ordinate = (branch["columns"][key] for key in ("load", "ordinate"))
    rows = [int(change["row"]) for change in branch.get("unexplained") or ()]
    return [((load[i] + load[i + 1]) / 2, (ordinate[i] + ordinate[i + 1]) / 2) for i in rows]


def _kind_label(kind: str, branches: Sequence[Mapping[str, Any]]) -> str:
    """Return the legend's words for a kind of special point; of imperfect bifurcations with their unfolding."""
    values = [
        abs(point["unfolding"])
        for branch in branches
        for point in branch.get("special", [])
        if point["kind"] == kind == IMPERFECT and point.get("unfolding") is not None
    ]
    if not values:
        return str(MARKERS.get(kind, END_MARKER).get("label", kind))
    words = dict.fromkeys(f"{value:.0e}" for value in (min(values), max(values)))
    return f"{kind}, unfolding {' to '.join(words)}"


def _uncover(axes: Axes, pieces: Sequence[Piece]) -> None:
    """Draw what is not stable once more, within stable lines that lie on it."""
    stable = [dense(axes, piece.curve)[0] for piece in pieces if piece.kind == STABLE]
    for piece in pieces:
        for part in hidden(dense(axes, piece.curve)[0], stable) if piece.kind != STABLE else ():
            line = axes.transData.inverted().transform(part)
            axes.plot(*line.T, color="white", linewidth=2.0, solid_capstyle="butt", zorder=2.5)
            axes.plot(*line.T, color=piece.colour, **STYLES[piece.kind] | {"linewidth": 1.5}, zorder=2.6)


def _footer(diagram: Mapping[str, Any]) -> str:
    """Return the line that names the discretisation and the accuracy of the special points."""
    d = diagram.get("discretization")
    parts = [mesh_in_words(d)] if d else []
    if d and diagram.get("accuracy"):
        parts = [f"{d['formulation']} formulation, {len(diagram['meshes'])} meshes of up to {d['unknowns']} unknowns"]
    special = [point for branch in diagram["branches"] for point in branch.get("special", [])]
    counted = [point for point in special if point["kind"] in COUNTED]
    coarse = sum(point.get("resolved") is False for point in special)
    errors = [None if point.get("resolved") is False else point.get("error_estimate") for point in counted]
    known = [abs(error) for error in errors if error is not None and math.isfinite(error)]
    if known:
        share = f" (of {len(known)} out of {len(errors)})" if len(known) < len(errors) else ""
        parts.append(f"error of the loads of special points at most {at_most(max(known))}{share}")
    if coarse:
        parts.append(f"{coarse} of {len(special)} special points not resolved by the mesh")
    return "; ".join(parts)


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the diagram named on the command line, that of the process by default; returns 0, or 2 after a sentence."""
    parser = terse(
        argparse.ArgumentParser(prog="python -m rodfem.output.plot_diagram", description="Draw a bifurcation diagram.")
    )
    parser.add_argument("diagram", type=Path, help="diagram.json of a scene")
    parser.add_argument("--output", type=Path, help="picture to write (default: the same name with .png)")
    given = parser.parse_args(arguments)

    def draw() -> Path:
        diagram = read_diagram(given.diagram, ("title", "parameter_label", "ordinate", "branches"))
        return draw_diagram(diagram, given.output or given.diagram.with_suffix(".png"))

    return status_of(draw, given.diagram)


if __name__ == "__main__":
    sys.exit(main())

"""Bifurcation diagrams, drawn from ``diagram.json`` alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle, pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator, CubicHermiteSpline
from scipy.spatial import KDTree

from rodfem.continuation.kinds import KINDS
from rodfem.output import style
from rodfem.output.pieces import COUNTED, Piece, endings, pieces_of
from rodfem.output.style import END, FONT, HALO, LINES, PALETTE
from rodfem.output.words import greatest_error, mesh_in_words
from rodfem.stability.soft_mode import STABLE
from rodfem.tolerances import TINY

Floats = NDArray[np.float64]
Branches = Sequence[Mapping[str, Any]]

UNEXPLAINED = "index change unexplained"
SINGULAR = "singular first state, not located"
MARKERS: dict[str, Mapping[str, Any]] = {
    **{name: kind.marker for name, kind in KINDS.items() if kind.marker},
    UNEXPLAINED: {"marker": "^", **style.WARNING},
    SINGULAR: {"marker": "s", **style.WARNING},
}
ENDS = "ends: "  # beginning of the words for the end of a branch before the range ends
SHAPES, HUES = ("", "^", "<", "v", ">", "p", "h"), 7
"""Marks along the curves of branches, another one whenever the hues that differ at a glance are used up."""
GAP = 11.0  # pixels between an index and lines
SEEN = 2e-4  # distance from the chord above which a step is no straight line, in parts of the branch's range


class Line(NamedTuple):
    """A piece of a branch in its colour, with its ``curve`` (k, 2) of loads and ordinates."""

    piece: Piece
    colour: str
    curve: Floats


def draw_diagram(diagram: Mapping[str, Any], path: Path) -> Path:
    """Draw every branch as ordinate against load, with its stability and its special points."""
    return style.save(figure_of(diagram), path)


def figure_of(diagram: Mapping[str, Any], given: Axes | None = None) -> Figure:
    """Figure of a diagram, as :func:`draw_diagram` writes it, or that of axes that are ``given``: it is drawn there."""
    branches = diagram["branches"]
    with matplotlib.rc_context(style.STYLE):
        figure, axes = style.sheet(diagram["title"], _subtitle(diagram), given)
        handles, lines = draw_branches(axes, branches)
        axes.margins(0.05, 0.08)
        if given is None and _is_flat(branches):
            axes.set_ylim(-1.0, 1.0)
            if len(branches) > 1:
                words = "the ordinate is zero all over: another one tells branches apart"
                axes.annotate(words, (0.5, 0.25), xycoords="axes fraction", ha="center", color="0.4")
        axes.set_xlabel(style.axis_label(diagram), fontsize=FONT + 1)
        axes.set_ylabel(style.tex(style.ordinate_in_words(diagram)))
        style.explain(axes, handles)
        _write_indices(axes, lines, [tuple(place) for handle in handles for place in handle.get_xydata()])
    return figure


def _is_flat(branches: Branches) -> bool:
    """Whether the ordinate is zero all over, to the error bars that special points have of it: as of a straight rod."""
    bars = [point.get("ordinate_error_estimate") or 0.0 for b in branches for point in b.get("special", [])]
    return all(abs(x) <= max([0.0, *bars]) for b in branches for x in b["columns"]["ordinate"])


def draw_branches(axes: Axes, branches: Branches) -> tuple[list[Line2D], list[Line]]:
    """Draw all curves and special points; return the legend's handles and the lines."""
    handles, lines = list[Line2D](), list[Line]()
    hues, behind = _free(axes, branches[0]["name"])
    for number, (branch, colour) in enumerate(zip(branches, cycle(hues), strict=False)):
        new = [Line(piece, colour, curve) for piece, curve in drawn(branch)]
        lines += new
        shape = SHAPES[number // HUES % len(SHAPES)]
        handles.append(Line2D([], [], ls="", marker=shape or "s", ms=8, color=colour, label=branch["name"] + behind))
        if shape or not new:
            places = _places(branch).T
            axes.plot(*places, ls="", marker=shape or "o", ms=5.0, color=colour, markevery=0.08, zorder=3)
    for line in sorted(lines, key=lambda line: line.piece.kind != STABLE):
        upper = {} if line.piece.kind == STABLE else {"path_effects": style.RIM, "zorder": 2.5}  # where two lines lie
        axes.plot(*line.curve.T, color=line.colour, **LINES[line.piece.kind] | upper)
    return handles + _kinds(lines) + _draw_images(axes, branches, hues) + _draw_marks(axes, branches), lines


def _kinds(lines: Sequence[Line]) -> list[Line2D]:
    """Handles of the legend for the kinds of lines, and for their indices."""
    kinds = {line.piece.kind for line in lines}
    words = "negative eigenvalues" + " in the plane (in space)" * any(x.piece.in_space is not None for x in lines)
    index = [Line2D([], [], ls="", marker="$n$", ms=6, color="0.3", label=words)] * bool(lines)
    return [Line2D([], [], color="0.45", label=kind, **LINES[kind]) for kind in LINES if kind in kinds] + index


def _draw_images(axes: Axes, branches: Branches, hues: Sequence[str]) -> list[Line2D]:
    """Draw the images of branches by a symmetry, of the opposite ordinate, that are no branches themselves."""
    out = []
    for branch, colour in zip(branches, cycle(hues), strict=False):
        if branch.get("image") and not is_traced(branch, branches):
            for piece, curve in drawn(branch):
                axes.plot(*(curve * [1.0, -1.0]).T, color=colour, **LINES[piece.kind] | style.THIN)
            out.append(Line2D([], [], color="0.45", label=f"image, not traced: {branch['image']}", **style.THIN))
    return out


def _free(axes: Axes, name: str) -> tuple[Sequence[str], str]:
    """Hues that no other diagram in the axes has, and a number for the names of branches, the first of a ``name``."""
    used, times = {line.get_color() for line in axes.get_lines()}, 1
    while name + f" ({times})" * (times > 1) in style.entries_of(axes):
        times += 1
    return [colour for colour in PALETTE if colour not in used] or PALETTE, f" ({times})" * (times > 1)


def is_traced(branch: Mapping[str, Any], branches: Branches) -> bool:
    """Whether a branch passes where the image of this one has its middle."""
    curves = [_places(each) for each in branches]
    size = np.ptp(np.concatenate(curves), axis=0)
    middle = _places(branch)[len(branch["columns"]["load"]) // 2] * [1.0, -1.0]
    share = np.linspace(0.0, 1.0, 50)[:, None]
    lines = [(a + share * (b - a)).reshape(-1, 2) for c in curves for a, b in pairwise(c)]
    off = (np.concatenate([middle[None] + size, *lines]) - middle) / np.where(size > 0, size, 1.0)
    return bool(np.hypot(*off.T).min() < 0.01)  # of the ranges of load and ordinate


def _places(branch: Mapping[str, Any]) -> Floats:
    """Loads and ordinates (rows, 2)."""
    return np.column_stack([np.asarray(branch["columns"][key], dtype=float) for key in ("load", "ordinate")])


def _draw_marks(axes: Axes, branches: Branches) -> list[Line2D]:
    """Draw special points, warnings and ends, each place of a kind once; return the handles."""
    found: dict[str, list[tuple[float, float]]] = {kind: [] for kind in MARKERS}
    for kind, place in (mark for branch in branches for mark in _marks(branch)):
        found.setdefault(kind, []).append(place)
    handles = list[Line2D]()
    for kind, places in found.items():
        if places and (kind in MARKERS or kind.startswith(ENDS)):
            look = {"linestyle": "none", "zorder": 5, **MARKERS.get(kind, END)}
            handles += axes.plot(*np.unique(places, axis=0).T, path_effects=HALO, **{"label": kind, **look})
    return handles


def _marks(branch: Mapping[str, Any]) -> Iterator[tuple[str, tuple[float, float]]]:
    """Kind and place of all marks of a branch; those of steps that nothing explains are in their middle."""
    places = _places(branch)
    yield from ((point["kind"], (point["load"], point["ordinate"])) for point in branch.get("special", []))
    for row in (int(change["row"]) for change in branch.get("unexplained") or ()):
        yield UNEXPLAINED, tuple(places[row : row + 2].mean(axis=0))
    yield from ((f"{ENDS}{reason}", tuple(places[row])) for row, reason in endings(branch))
    if branch.get("singular_start"):
        yield SINGULAR, tuple(places[0])


# --- words


def _write_indices(axes: Axes, lines: Sequence[Line], marks: Sequence[tuple[float, float]]) -> None:
    """Write the index of each line where there is most room: a short line has none, unless it is the only one."""
    curves = [dense(axes, line.curve) for line in lines]
    taken, written = [*curves, *([axes.transData.transform(marks)] if marks else [])], set[tuple[str, str]]()
    for line, curve in sorted(zip(lines, curves, strict=True), key=lambda pair: -len(pair[1])):
        half = np.array([0.33 * len(line.piece.label) + 0.1, 0.45]) * FONT * axes.figure.dpi / 72
        places, tree = _label_places(curve, half), KDTree(np.concatenate(taken))
        corner = np.array([*product((-1, 0, 1), repeat=2)]) * half
        room = np.array([min(tree.query(place + corner)[0].min(), GAP) for place in places])
        inside = np.all((places - half > axes.bbox.min) & (places + half < axes.bbox.max), axis=1)
        best = int(np.argmax(np.where(inside, room, -1.0)))
        name = line.colour, line.piece.label
        if (inside[best] and room[best] > GAP / 2 and len(curve) > 15) or name not in written:
            written.add(name)
            taken.append(places[best] + corner)
            at = axes.transData.inverted().transform(places[best])
            look = {"ha": "center", "va": "center", "weight": "bold", "zorder": 6, "path_effects": HALO}
            axes.annotate(line.piece.label, tuple(at), color=line.colour, in_layout=False, **look)


def dense(axes: Axes, curve: Floats) -> Floats:
    """Points (k, 2) on a curve, in pixels, at equal distances of about two."""
    pixels = axes.transData.transform(curve)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))])
    along = np.linspace(0.0, lengths[-1], max(2, int(lengths[-1] / 2.0) + 1))
    return np.column_stack([np.interp(along, lengths, pixels[:, k]) for k in (0, 1)])


def _label_places(curve: Floats, half: Floats) -> Floats:
    """Places (k, 2) for a word of ``half`` (2,) pixels next to a curve (n, 2), those in its middle first."""
    rows = ((0.5 + np.array([0, 0.15, -0.15, 0.3, -0.3, 0.4, -0.4])) * (len(curve) - 1)).round().astype(int)
    tangent = curve[np.minimum(rows + 4, len(curve) - 1)] - curve[np.maximum(rows - 4, 0)]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.maximum(np.hypot(*tangent.T), TINY)[:, None]
    normal *= np.where(normal[:, 1] < 0, -1.0, 1.0)[:, None]
    away = normal * (abs(normal) @ half + GAP)[:, None]
    return np.stack([curve[rows] + away, curve[rows] - away], axis=1).reshape(-1, 2)


def _subtitle(diagram: Mapping[str, Any]) -> str:
    """Return the line that names the discretisation and the accuracy of the special points."""
    d, special = diagram.get("discretization"), [s for b in diagram["branches"] for s in b.get("special", [])]
    mesh = mesh_in_words(d) if d else ""
    if d and diagram.get("accuracy"):
        mesh = f"{d['formulation']} formulation, {len(diagram['meshes'])} meshes of up to {d['unknowns']} unknowns"
    coarse = sum(point.get("resolved") is False for point in special)
    rest = f"{coarse} of {len(special)} special points not resolved by the mesh" * bool(coarse)
    error = greatest_error("the loads of special points", [s for s in special if s["kind"] in COUNTED])
    return "; ".join(filter(None, [mesh, error, rest]))


# --- branches between their rows


def dense_rows(branch: Mapping[str, Any], name: str) -> dict[int, Floats]:
    """Loads and values of a column between rows, (7, 2), by the row before, of the steps that are no straight lines.

    A long step, as the first one from a branch point, would show as a chord.  The load is the cubic Hermite spline of
    its values and slopes ``dP/ds``: at a pitchfork ``P_0 + c s^2``, as it is there.  The slopes of other columns are
    Akima's, which keep corners.  ``branch`` is one of ``diagram.json``, ``name`` that of the column.
    """
    columns = branch["columns"]
    s, slopes, loads, values = (np.array(columns[x], dtype=float) for x in ("arclength", "slope", "load", name))
    if len(s) < 3 or not np.isfinite([s, slopes, loads, values]).all() or (np.diff(s) <= 0).any():
        return {}
    shares = np.linspace(0.0, 1.0, 9)[1:-1]
    places = s[:-1, None] + shares * np.diff(s)[:, None]
    curves = CubicHermiteSpline(s, loads, slopes)(places), Akima1DInterpolator(s, values)(places)
    seen, smooth = np.zeros(len(places), dtype=bool), np.ones(len(places), dtype=bool)
    for rows, curve in zip((loads, values), curves, strict=True):
        off = abs(curve - rows[:-1, None] - shares * np.diff(rows)[:, None]).max(axis=1)
        seen |= off > SEEN * np.ptp(rows)
        smooth &= off <= np.maximum(0.5 * abs(np.diff(rows)), 150 * SEEN * np.ptp(rows))
    return {int(row): np.column_stack([curve[row] for curve in curves]) for row in np.flatnonzero(seen & smooth)}


def drawn(branch: Mapping[str, Any]) -> list[tuple[Piece, Floats]]:
    """Pieces of a branch, each with its curve (k, 2) of loads and ordinates, with points between rows."""
    rows, more, found = _places(branch), dense_rows(branch, "ordinate"), []
    for piece in pieces_of(branch):
        parts = [part for i in range(piece.first, piece.last) for part in (rows[i : i + 1], more.get(i, rows[:0]))]
        found.append((piece, np.vstack([*parts, rows[piece.last]])))
    return found

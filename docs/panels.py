"""Small diagrams for the pages: branches with their index and special points, or frequencies, in given axes."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from rodfem.output.pieces import PLANAR, STABLE, UNSTABLE, endings
from rodfem.output.plot_diagram import ENDS, dense_rows
from rodfem.output.plot_frequencies import draw_into
from rodfem.output.style import END, HALO, PALETTE, axis_label

MARKERS: dict[str, dict[str, Any]] = {
    "branch point": {"marker": "o", "mfc": "white"},
    "fold": {"marker": "D", "mfc": "black"},
}
PARTS = (0.5, 0.7, 0.3, 0.85, 0.15)
"""Places of the number of a piece, in parts of its length on paper: the first that is clear of other numbers."""
CLEAR = 18.0
"""Pixels between two numbers."""
COUNT, IN_SPACE = "negative eigenvalues", " in the plane (in space)"
"""What numbers at curves are, in the legend."""
ROOM, LEAST = 0.15, 1e-9
"""Share of the height that is kept free above and below, and pixels below which a curve has no direction."""


def draw(axes: Axes, found: Mapping[str, Any], signs: tuple[int, ...] = (1,), width: float = 2.4) -> None:
    """Draw a diagram, the contents ``found`` of a ``diagram.json``, with the ``signs`` of its ordinate.

    Lines of a ``width`` in points are solid where the index is zero, dashed where it is zero in the plane only.
    """
    labels: list[tuple[str, str, np.ndarray]] = []
    for branch, colour in zip(found["branches"], 3 * PALETTE, strict=False):
        if branch["columns"].get("omega2"):
            continue
        load, ordinate = (np.array(branch["columns"][x]) for x in ("load", "ordinate"))
        for rows, index, in_space in pieces(branch):
            style = ":" if index else "--" if in_space else "-"
            curve = smooth(np.column_stack([load, ordinate]), rows, dense_rows(branch, "ordinate"))
            for sign in signs if np.ptp(ordinate) else (1,):
                axes.plot(curve[:, 0], sign * curve[:, 1], style, color=colour, linewidth=width)
            text = f"{index} ({in_space})" if in_space != index else f"{index}"
            labels.append((text, colour, curve))
        for row, _ in endings(branch):
            for sign in signs if ordinate[row] else (1,):
                style = {"ls": "none", "zorder": 5} | END | {"ms": 2.7 * width}
                axes.plot(load[row], sign * ordinate[row], **style)
        for special in branch["special"]:
            for sign in signs if special["kind"] in MARKERS else ():
                style = {"mec": "black", "mew": 0.6 * width, "ms": 3 * width} | MARKERS[special["kind"]]
                axes.plot(special["load"], sign * special["ordinate"], ls="none", zorder=5, **style)
    if waves := swept(found):
        draw_into(axes, waves)
        axes.set_xlabel(axis_label(found))
        return
    axes.margins(y=ROOM)
    axes.autoscale_view()  # the directions of curves on paper depend on the limits
    written: list[np.ndarray] = []
    for text, colour, places in labels:
        _write(axes, text, colour, places, 6 * width, written)
    axes.set_xlabel(axis_label(found))


def smooth(places: np.ndarray, rows: slice, more: Mapping[int, np.ndarray]) -> np.ndarray:
    """Places (n, 2) of the ``rows`` of a branch with the points in between, ``more``, by the row before."""
    return np.vstack([part for i in range(rows.start, rows.stop) for part in
                      (places[i : i + 1], *([more[i]] if i in more and i + 1 < rows.stop else []))])  # fmt: skip


def legend_of(found: Mapping[str, Any]) -> list[Artist]:
    """Entries of a legend for what :func:`draw` draws of a diagram."""
    parts = [part for branch in found["branches"] for part in pieces(branch)]
    if waves := swept(found):
        return draw_into(Figure().subplots(), waves)
    styles = {STABLE: "-", PLANAR: "--", UNSTABLE: ":"}
    kinds = {UNSTABLE if index else PLANAR if in_space else STABLE for _, index, in_space in parts}
    out: list[Artist] = [
        Line2D([], [], color="0.3", ls=style, lw=2.0, label=kind) for kind, style in styles.items() if kind in kinds
    ]
    both = any(index != in_space for _, index, in_space in parts)
    mark, size, words = (r"$n\,(m)$", 24, IN_SPACE) if both else ("$n$", 6, "")
    out.append(Line2D([], [], ls="none", marker=mark, ms=size, color="0.3", label=f"{COUNT}{words}"))
    special = {special["kind"] for branch in found["branches"] for special in branch["special"]}
    for kind, style in MARKERS.items():
        if kind in special:
            out.append(Line2D([], [], ls="none", mec="black", ms=7, label=kind, **style))
    reasons = dict.fromkeys(reason for branch in found["branches"] for _, reason in endings(branch))
    return out + [Line2D([], [], ls="none", label=f"{ENDS}{reason}", **END) for reason in reasons]


def _write(axes: Axes, text: str, colour: str, places: np.ndarray, distance: float, written: list[np.ndarray]) -> None:
    """Write a ``text`` above the middle of a curve of ``places`` (n, 2), at a ``distance`` from it in points.

    Elsewhere, or not at all, where it is nearer than :data:`CLEAR` to others that were ``written``, by their places.
    """
    on_paper = axes.transData.transform(places)
    along = np.cumsum(np.hypot(*np.diff(on_paper, axis=0, prepend=on_paper[:1]).T))
    for part in PARTS:
        middle = np.array([np.interp(part * along[-1], along, column) for column in on_paper.T])
        row = min(max(int(np.searchsorted(along, part * along[-1])), 1), len(along) - 1)
        x, y = on_paper[row] - on_paper[row - 1]
        normal = np.array([-y, x]) / max(np.hypot(x, y), LEAST) * (-1.0 if x < 0 else 1.0)
        place = middle + distance * normal * axes.figure.dpi / 72
        if all(np.hypot(*(place - other)) > CLEAR for other in written):
            written.append(place)
            offset = {"xytext": tuple(distance * normal), "textcoords": "offset points", "ha": "center", "va": "center"}
            at = axes.transData.inverted().transform(middle)
            axes.annotate(text, tuple(at), color=colour, path_effects=HALO, **offset)
            return


def pieces(branch: Mapping[str, Any]) -> list[tuple[slice, int, int]]:
    """Rows of each part of a branch with one index, that index, and the one in space."""
    columns = branch["columns"]
    index = columns["negative"]
    in_space = columns.get("negative_in_space") or index
    special = {s["row"] for s in branch["special"] if s["kind"] != "user"}
    both = list(zip(index, in_space, strict=True))
    changed = {
        i for i in range(2, len(index)) if both[i] != both[i - 1] and not special & {i, i - 1}
    }  # 0: the parent's
    cuts = sorted({0, len(index) - 1} | special | changed)
    return [(slice(a, b + 1), *both[(a + b) // 2 if b > a + 1 else b]) for a, b in pairwise(cuts)]


def swept(found: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Branches of a diagram that have frequencies."""
    return [branch for branch in found["branches"] if branch["columns"].get("omega2")]

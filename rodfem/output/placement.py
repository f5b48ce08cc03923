"""Where words stand in a diagram: the legend in an empty corner, names and indices beside their curves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.transforms import Bbox
from numpy.typing import NDArray

from rodfem.output.plot_pieces import Piece
from rodfem.output.style import DPI, FONT, HALO
from rodfem.output.view import POINT

Floats = NDArray[np.float64]

ROOM = 100.0
"""Cost of a place above which there is no room for a word."""
MOST_INSIDE = 8
"""Branches up to which the legend may stand inside the axes."""
LARGEST, HIGH = 8.5, 195.0
"""Size of the font of a legend at most, and that of all its lines together, in points."""
HEIGHT = FONT * DPI / 72.0
"""Height of a line of text in pixels."""
GAPS = (6.0, 10.0, 16.0)
"""Distances of a word from its curve, in pixels: beyond its halo."""
NAME = 0.8
"""Size of the name of a branch relative to that of an index."""


def dense(axes: Axes, curve: Floats) -> tuple[Floats, float]:
    """Return points (k, 2) on a curve at equal distances of about two pixels, and its length, in pixels."""
    pixels = axes.transData.transform(curve)
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(pixels, axis=0).T))])
    along = np.linspace(0.0, lengths[-1], max(2, int(lengths[-1] / 2.0) + 1))
    return np.column_stack([np.interp(along, lengths, pixels[:, k]) for k in (0, 1)]), float(lengths[-1])


def place_words(
    axes: Axes, branches: list[Line2D], others: list[Line2D], pieces: Sequence[Piece], points: dict[str, Floats]
) -> None:
    """Place the legend, the index of each piece, and the names of branches: at the curves, or all in the legend.

    Parameters
    ----------
    axes
        Where all curves are drawn.
    branches, others
        Handles of the legend: for each branch, and what else it explains.
    pieces
        All that is drawn of the branches.
    points
        Loads and ordinates (k, 2) of special points by kind, which words do not cover.
    """
    few = len(branches) <= MOST_INSIDE
    for handles in (others, branches + others) if few else (branches + others,):
        box, obstacles = _place_legend(axes, handles, pieces, points, few)
        words = _Words(axes, [box], obstacles)
        words.indices(pieces, all_of_them=few)
        if handles is not others or words.names(pieces):
            return
        words.remove()


class _Words:
    """Words that have been placed at curves: boxes that are taken, in pixels."""

    def __init__(self, axes: Axes, taken: list[Bbox], obstacles: Floats) -> None:
        """Nothing is placed yet, but boxes are ``taken``; ``obstacles`` (k, 2) are pixels of curves and marks."""
        self.axes, self.taken, self.obstacles = axes, taken, obstacles
        self.texts: list[Any] = []

    def remove(self) -> None:
        """Take all words away."""
        for text in self.texts:
            text.remove()

    def indices(self, pieces: Sequence[Piece], *, all_of_them: bool) -> None:
        """Write the index beside each piece, near its middle and off everything else.

        ``all_of_them``: each index of a branch once even where there is no room.
        """
        seen = set()
        for curve, length, piece in self._longest_first(pieces):
            needed = (piece.branch, piece.label) not in seen
            seen.add((piece.branch, piece.label))
            cost, box = self._best(curve, piece.label, 1.0)
            if (needed and all_of_them) or (cost < ROOM and length > 1.6 * HEIGHT):  # else no room
                self._write(box, piece.label, piece.colour, weight="bold")

    def names(self, pieces: Sequence[Piece]) -> bool:
        """Write the name of each branch at its longest piece with room; returns whether all have some."""
        waiting = {piece.branch for piece in pieces}
        for curve, length, piece in self._longest_first(pieces):
            if piece.branch in waiting and length > HEIGHT:
                cost, box = self._best(curve, piece.branch, NAME)
                if cost < ROOM:
                    waiting.remove(piece.branch)
                    self._write(box, piece.branch, piece.colour, fontsize=NAME * FONT)
        return not waiting

    def _longest_first(self, pieces: Sequence[Piece]) -> list[tuple[Floats, float, Piece]]:
        curves = [(*dense(self.axes, piece.curve), piece) for piece in pieces]
        return sorted(curves, key=lambda item: -item[1])

    def _best(self, curve: Floats, word: str, size: float) -> tuple[float, Bbox]:
        """Cost and box of the best place for a word of a relative size beside a curve (k, 2), in pixels."""
        half = np.array([0.33 * size * HEIGHT * len(word) + 6.0, 0.38 * size * HEIGHT + 6.0])
        best, chosen = math.inf, self.taken[0]
        for share, gap, side in product(np.linspace(0.1, 0.9, 13), GAPS, (1.0, -1.0)):
            middle = round(share * (len(curve) - 1))
            tangent = curve[min(middle + 4, len(curve) - 1)] - curve[max(middle - 4, 0)]
            normal = side * np.array([-tangent[1], tangent[0]]) / max(math.hypot(*tangent), POINT)
            centre = curve[middle] + normal * (np.abs(normal) @ half + gap)
            box = Bbox([centre - half, centre + half])
            cost = 40.0 * abs(share - 0.5) + 0.3 * gap + 2.0 * (normal[1] < 0.0)
            cost += 10.0 * _inside(box, self.obstacles) + 1e3 * sum(box.overlaps(other) for other in self.taken)
            cost += 1e4 * (_inside(self.axes.bbox, box.get_points()) < 2)
            best, chosen = min((best, chosen), (cost, box), key=lambda choice: choice[0])
        return best, chosen

    def _write(self, box: Bbox, word: str, colour: str, **style: Any) -> None:
        self.taken.append(box)
        x, y = self.axes.transData.inverted().transform((box.min + box.max) / 2.0)
        text = self.axes.text(x, y, word, color=colour, ha="center", va="center", **style)
        text.set(zorder=6, in_layout=False, path_effects=HALO)
        self.texts.append(text)


def _inside(box: Bbox, points: Floats) -> int:
    """Return how many of the points (k, 2) lie in the box."""
    return int(np.count_nonzero(np.all((points > box.min) & (points < box.max), axis=1)))


def _place_legend(
    axes: Axes, handles: list[Line2D], pieces: Sequence[Piece], points: dict[str, Floats], inside: bool
) -> tuple[Bbox, Floats]:
    """Put the legend into an empty corner if ``inside``, or to the right; its box and all covered pixels (k, 2).

    ``axes``, ``pieces`` and ``points`` are those of :func:`place_words`, ``handles`` all of the legend.
    """
    around = np.array(list(product((-14.0, -7.0, 0.0, 7.0, 14.0), repeat=2)))
    font = min(LARGEST, HIGH / len(handles))
    beside: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.015, 1.0), "borderaxespad": 0.0}

    def drawn(**style: Any) -> tuple[Bbox, Floats]:
        legend = axes.legend(handles=handles, fontsize=font, markerscale=font / LARGEST, **style)
        axes.figure.draw_without_rendering()
        lines = [dense(axes, piece.curve)[0] for piece in pieces]
        marks = [axes.transData.transform(at) + around for places in points.values() for at in places]
        return legend.get_window_extent().padded(8.0), np.concatenate([np.empty((0, 2)), *lines, *marks])

    if not inside:
        return drawn(**beside)
    first, obstacles = drawn(loc="upper left")
    # inside the axes a legend moves nothing else: the other corners are known without drawing
    right = axes.bbox.x0 + axes.bbox.x1 - first.x0 - first.x1
    down = axes.bbox.y0 + axes.bbox.y1 - first.y0 - first.y1
    for corner, x, y in (
        ("upper left", 0.0, 0.0), ("upper right", right, 0.0), ("lower left", 0.0, down), ("lower right", right, down)
    ):  # fmt: skip
        box = first.translated(x, y)
        if not _inside(box, obstacles):
            if corner != "upper left":
                axes.legend(handles=handles, fontsize=font, markerscale=font / LARGEST, loc=corner)
            return box, obstacles
    return drawn(**beside)

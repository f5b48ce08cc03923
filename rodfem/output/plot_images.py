"""The other side of symmetric pitchfork bifurcations: images of branches by a symmetry of the scene, as thin lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from rodfem.output.plot_pieces import STYLES
from rodfem.output.smooth import drawn_pieces

Floats = NDArray[np.float64]

THIN, PALE = 0.9, 0.75
"""Width and opacity of the line of an image."""
NEAR = 0.01
"""Distance from an image, relative to the ranges of load and ordinate, up to which a branch is that image."""
IMAGE = "image, not traced: "
"""Beginning of the words for an image."""


def draw_images(axes: Axes, branches: Sequence[Mapping[str, Any]], colours: Sequence[str]) -> list[Line2D]:
    """Draw the images of all branches that have one and whose image is no branch itself; returns the legend's handles.

    ``branches`` are those of ``diagram.json``, in these ``colours``.
    """
    found: dict[str, Line2D] = {}
    for branch, colour in zip(branches, colours, strict=True):
        if not branch.get("image") or is_traced(branch, branches):
            continue
        for piece in drawn_pieces(branch, colour):
            style = STYLES[piece.kind] | {"linewidth": THIN, "alpha": PALE}
            axes.plot(*(piece.curve * [1.0, -1.0]).T, color=colour, **style)
        words = f"{IMAGE}{branch['image']}"
        found.setdefault(words, Line2D([], [], color="0.45", lw=THIN, label=words))
    return list(found.values())


def is_traced(branch: Mapping[str, Any], branches: Sequence[Mapping[str, Any]]) -> bool:
    """Whether a branch passes where the image of this one has its middle."""
    size = np.ptp(np.concatenate([_curve(each) for each in branches]), axis=0)
    curve = _curve(branch) * [1.0, -1.0]
    middle = curve[len(curve) // 2]
    return any(_distance(middle, line, np.where(size > 0, size, 1.0)) < NEAR for line in _lines(branches))


def _lines(branches: Sequence[Mapping[str, Any]]) -> Iterator[Floats]:
    yield from (curve for curve in map(_curve, branches) if len(curve) > 1)


def _curve(branch: Mapping[str, Any]) -> Floats:
    return np.column_stack([np.asarray(branch["columns"][key], dtype=float) for key in ("load", "ordinate")])


def _distance(point: Floats, line: Floats, size: Floats) -> float:
    """Distance of a point from a polygonal line (k, 2), where ``size`` (2,) is that of the axes."""
    start, along = line[:-1] / size, np.diff(line, axis=0) / size
    off = point / size - start
    share = np.clip(np.sum(off * along, axis=1) / np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny), 0.0, 1.0)
    return float(np.hypot(*(off - share[:, None] * along).T).min())

"""Pictures of a lesson: a notebook shows them, a script writes them into ``results/course``."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpi4py import MPI

from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.output.pieces import STABLE
from rodfem.output.plot_diagram import drawn
from rodfem.output.style import DPI, HALO, LINES, PALETTE, STYLE, save

if TYPE_CHECKING:
    from rodfem.continuation.branch import Point
    from rodfem.diagram.diagram import Diagram

FOLDER = Path("results") / "course"
"""Where a script's pictures are."""
SIZES = {1: (6.5, 4.0), 2: (7.2, 3.8), 3: (8.2, 3.4)}
"""Width and height in inches of figures with so many axes."""


BESIDE = {"textcoords": "offset points", "va": "top", "fontsize": "small", "zorder": 4}
"""How the words for a special point stand beside it."""


def panels(number: int, x: str, y: str, equal: bool = False) -> list[Axes]:
    """Return so many axes side by side in a new figure.

    Parameters
    ----------
    number
        How many.
    x, y
        Labels; ``y`` is that of the first.
    equal
        Whether shapes are true to scale.
    """
    with matplotlib.rc_context(STYLE | {"axes.prop_cycle": matplotlib.cycler(color=PALETTE[1:])}):
        drawn = Figure(figsize=SIZES[number], layout="constrained").subplots(1, number, sharey=True, squeeze=False)[0]
        for one in drawn:
            one.set(xlabel=x, ylabel=y if one is drawn[0] else "")
            one.spines[["top", "right"]].set_visible(False)
            if equal:
                one.set_aspect("equal")
            if number > 1:
                one.locator_params(nbins=5)
    return list(drawn)


def axes(x: str, y: str, equal: bool = False) -> Axes:
    """Axes of a new figure with labels ``x`` and ``y``; ``equal`` draws shapes true to scale."""
    return panels(1, x, y, equal)[0]


def equilibria(diagrams: Mapping[str, Diagram], x: str, y: str) -> Axes:
    """Draw diagrams, stable parts solid, others dotted, with the loads of folds and branch points; returns the axes.

    Parameters
    ----------
    diagrams
        By their names in the legend, which one alone does not need.
    x, y
        Labels: of the load, and of the ordinate.
    """
    on = axes(x, y)
    for (label, diagram), colour in zip(diagrams.items(), PALETTE, strict=False):
        for branch in diagram.data["branches"]:
            for piece, curve in drawn(branch):
                on.plot(*curve.T, color=colour, **LINES[piece.kind])
        for branch, special in ((b, s) for b in diagram for s in b.special if s.kind in (FOLD, BRANCH_POINT)):
            place, load = (special.point.load, special.point.ordinate), np.mean([p.load for p in branch.points])
            on.plot(*place, linestyle="none", zorder=5, path_effects=HALO, **special.kind.marker)
            side = 1 if special.kind == FOLD and special.point.load > load else -1
            text = on.annotate(f"{special.kind}\n{special.point.load:.6g}", place, (10 * side, -5), **BESIDE)
            text.set(ha="left" if side > 0 else "right", path_effects=HALO)
        if len(diagrams) > 1:
            on.plot([], [], color=colour, lw=LINES[STABLE]["linewidth"], label=label)
            on.legend(frameon=False, loc="upper left")
    return on


def shapes(
    on: Axes,
    diagram: Diagram,
    states: Mapping[str, Point],
    corner: tuple[float, float, float, float] = (0.03, 0.44, 0.44, 0.42),
    right: tuple[float, float, float] = (0, 0, 1),
    up: tuple[float, float, float] = (-1, 0, 0),
) -> None:
    """Mark states of a diagram on its curves, and draw their centrelines in a corner, each in the colour of its mark.

    Parameters
    ----------
    on
        Axes in which :func:`equilibria` has drawn the diagram.
    diagram
        What was traced.
    states
        Points of the diagram by what they are called.
    corner
        Left and lower end, width and height of the corner, in parts of the axes.
    right, up
        Directions of space.
    """
    inset = on.inset_axes(corner)
    inset.set(aspect="equal", xticks=(), yticks=(), facecolor="none")
    inset.spines[:].set_visible(False)
    for (words, point), colour in zip(states.items(), PALETTE[1:], strict=False):
        r = diagram.solvers[point.mesh].shape.sample(point.x)["r"]
        inset.plot(r @ np.array(right), r @ np.array(up), color=colour, lw=2.6, label=words, solid_capstyle="round")
        inset.plot(*(r[[0, -1]] @ np.array([right, up]).T).T, "s", color="0.4", ms=4, zorder=4)
        on.plot(point.load, point.ordinate, "o", ms=8, mfc=colour, mec="white", mew=1.3, zorder=6)
    below = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "ncols": len(states)}
    inset.legend(frameon=False, fontsize="small", handlelength=1.2, columnspacing=1.0, **below)


def show(figure: Figure, name: str) -> None:
    """Display a figure in a notebook; elsewhere the first rank writes it into the file ``results/course/name.png``."""
    if "ipykernel" in sys.modules:
        from IPython.display import Image, display

        png = BytesIO()
        figure.savefig(png, dpi=DPI // 2, format="png")
        display(Image(png.getvalue()))
    elif MPI.COMM_WORLD.rank == 0:
        save(figure, FOLDER / f"{name}.png")

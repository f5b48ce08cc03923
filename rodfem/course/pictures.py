"""Pictures of a lesson: a notebook shows them, a script writes them into ``results/course``."""

from __future__ import annotations

import sys
from io import BytesIO
from pathlib import Path

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpi4py import MPI

from rodfem.output.sheet import DPI, PALETTE, STYLE, save

FOLDER = Path("results") / "course"
"""Where a script's pictures are."""
SIZE = (6.5, 4.0)
"""Width and height in inches."""


def axes(x: str, y: str, equal: bool = False) -> Axes:
    """Axes of a new figure with labels ``x`` and ``y``; ``equal`` draws shapes true to scale."""
    with matplotlib.rc_context(STYLE | {"axes.prop_cycle": matplotlib.cycler(color=PALETTE[1:])}):
        drawn = Figure(figsize=SIZE, layout="constrained").subplots()
        drawn.set(xlabel=x, ylabel=y)
        drawn.spines[["top", "right"]].set_visible(False)
        if equal:
            drawn.set_aspect("equal")
    return drawn


def show(figure: Figure, name: str) -> None:
    """Display a figure in a notebook; elsewhere the first rank writes it into the file ``results/course/name.png``."""
    if "ipykernel" in sys.modules:
        from IPython.display import Image, display

        png = BytesIO()
        figure.savefig(png, dpi=DPI // 2, format="png")
        display(Image(png.getvalue()))
    elif MPI.COMM_WORLD.rank == 0:
        save(figure, FOLDER / f"{name}.png")

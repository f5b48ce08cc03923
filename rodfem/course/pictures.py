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
SIZES = {1: (6.5, 4.0), 2: (8.5, 4.0), 3: (9.5, 3.6)}
"""Width and height in inches of figures with so many axes."""


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
    return list(drawn)


def axes(x: str, y: str, equal: bool = False) -> Axes:
    """Axes of a new figure with labels ``x`` and ``y``; ``equal`` draws shapes true to scale."""
    return panels(1, x, y, equal)[0]


def show(figure: Figure, name: str) -> None:
    """Display a figure in a notebook; elsewhere the first rank writes it into the file ``results/course/name.png``."""
    if "ipykernel" in sys.modules:
        from IPython.display import Image, display

        png = BytesIO()
        figure.savefig(png, dpi=DPI // 2, format="png")
        display(Image(png.getvalue()))
    elif MPI.COMM_WORLD.rank == 0:
        save(figure, FOLDER / f"{name}.png")

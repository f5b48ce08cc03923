"""The pictures of docs/paper.md: what rodfem draws for the figures of Kumar & Healey (2010).

    python docs/figures.py        # runs the four demos into results/paper, and draws docs/paper/figure-*.png

Diagrams are those of the demos.  Those of figures 5 and 8 have both signs of the displacement: an equilibrium and its
image under a symmetry of the scene have the same load and the same index.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import h5py
import matplotlib
import matplotlib.image
import numpy as np
from matplotlib.figure import Figure
from panels import draw, legend_of

from rodfem.output.plot_diagram import draw_diagram
from rodfem.output.plot_frequencies import draw_frequencies
from rodfem.output.render import draw_shape, view_in
from rodfem.output.style import STYLE, axis_label

HOME = Path(__file__).parents[1]
RESULTS, PICTURES = HOME / "results" / "paper", HOME / "docs" / "paper"
LOADS = {"cord": (40.0, 20.0), "hemitropic": (0.2, 0.5, 0.9), "ruler": (3.0, 6.0), "follower": ()}
"""Loads of the user points of each demo."""
SHAPES = {
    3: ("cord", (("straight", 60.0), ("branch 1", 40.0), ("branch 1.2", 20.0))),
    6: ("hemitropic", (("branch 1", 0.2), ("branch 1", 0.5), ("branch 1", 0.9))),
    9: ("ruler", (("plane", 3.0), ("branch 1", 6.0), ("branch 1", 12.0))),
}
"""Figure: demo, and the states whose shapes it has, by branch and load."""
DPI, WIDTH, TITLE = 150, 12.0, 0.3
"""Dots per inch; width of three states, and height of their titles, in inches."""
PANEL, PANELS = (900, 760), {"ruler": (760, 860)}
"""Pixels of the picture of one state, and for the rods for which they are others."""
RADII = {"ruler": 0.017}
"""Mean radii of rods that are drawn thicker than by default."""
MARGIN, WHITE = 24, 250
"""Pixels around what is cropped, and brightness from which on a pixel is white."""


def main() -> None:
    """Run the demos and draw all pictures."""
    for name, loads in LOADS.items():
        at = ["--at", *map(str, loads)] if loads else []
        output = ["--no-figures", "--output", str(RESULTS / name)]
        subprocess.run(
            [sys.executable, "-m", "rodfem", "run", str(HOME / "demos" / f"{name}.py"), *at, *output], check=True
        )
    draw_diagram(diagram("cord"), PICTURES / "figure-2.png")
    both_signs(diagram("hemitropic"), "signed displacement of the mid point", PICTURES / "figure-5.png")
    both_signs(diagram("ruler"), "signed tip displacement out of the plane", PICTURES / "figure-8.png")
    draw_frequencies(diagram("follower"), PICTURES / "figure-11.png")
    for number, (name, states) in SHAPES.items():
        shapes(name, states, PICTURES / f"figure-{number}.png")


def diagram(name: str) -> dict[str, Any]:
    """Contents of the ``diagram.json`` of a demo."""
    found: dict[str, Any] = json.loads((RESULTS / name / "diagram.json").read_text())
    return found


def both_signs(found: dict[str, Any], label: str, path: Path) -> None:
    """Draw a diagram with both signs of its ordinate, which is ``label``."""
    with matplotlib.rc_context(STYLE | {"font.size": 13.0}):
        figure = Figure(figsize=(9.0, 5.0), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        draw(axes, found, signs=(1, -1))
        axes.set(ylabel=label, title=found["title"])
        axes.legend(handles=legend_of(found), loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=11)
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path)


def shapes(name: str, states: Sequence[tuple[str, float]], path: Path) -> None:
    """Draw states of a demo, each by its branch and load, beside each other, all as the last one is looked at."""
    file, found = RESULTS / name / "states.h5", diagram(name)
    with h5py.File(file) as known:
        rows = [int(np.argmin(abs(known[f"branches/{branch}/load"][:] - load))) for branch, load in states]
    view = view_in(file, states[-1][0], rows[-1])
    pictures = []
    with tempfile.TemporaryDirectory() as folder:
        for (branch, _), row in zip(states, rows, strict=True):
            kept = {"caption": "", "size": PANELS.get(name, PANEL), "view": view, "radius": RADII.get(name)}
            picture = draw_shape(file, branch, row, Path(folder, "shape.png"), **kept)
            pictures.append(cropped(matplotlib.image.imread(picture)))
    tallest = max(len(picture) / len(picture[0]) for picture in pictures)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, WIDTH / len(states) * tallest + TITLE), dpi=DPI, layout="constrained")
        for axes, picture, (branch, load), row in zip(
            figure.subplots(1, len(states)), pictures, states, rows, strict=True
        ):
            index = next(b["columns"]["negative"][row] for b in found["branches"] if b["name"] == branch)
            axes.imshow(picture)
            axes.set_axis_off()
            axes.set_anchor("N")
            axes.set_title(f"{branch}, {axis_label(found)} = {load:g}, index {index}", fontsize=12)
        figure.savefig(path)


def cropped(picture: np.ndarray) -> np.ndarray:
    """A picture (height, width, 3 or 4) without the white rows above and below what is in it."""
    dark = np.flatnonzero((255 * picture[:, :, :3].min(axis=2) < WHITE).any(axis=1))
    return picture[max(dark[0] - MARGIN, 0) : dark[-1] + MARGIN]


if __name__ == "__main__":
    main()

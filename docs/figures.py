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
from rodfem.output.render import draw_shape, read_state
from rodfem.output.style import STYLE, axis_label

HOME = Path(__file__).parents[1]
RESULTS, PICTURES = HOME / "results" / "paper", HOME / "docs" / "paper"
LOADS = {"cord": (40.0, 20.0), "hemitropic": (0.2, 0.5, 0.9), "ruler": (3.0, 6.0), "follower": ()}
"""Loads of the user points of each demo."""
SHAPES = {
    "figures-1-4-7-10": (
        ("cord", "straight", 60.0),
        ("hemitropic", "straight", 0.0),
        ("ruler", "plane", 3.0),
        ("follower", "straight", 25.0),
    ),
    "figure-3": (("cord", "straight", 60.0), ("cord", "branch 1", 40.0), ("cord", "branch 1.2", 20.0)),
    "figure-6": tuple(("hemitropic", "branch 1", load) for load in (0.2, 0.5, 0.9)),
    "figure-9": (("ruler", "plane", 3.0), ("ruler", "branch 1", 6.0), ("ruler", "branch 1", 12.0)),
}
"""Picture: the states whose shapes it has, by demo, branch and load."""
DPI, WIDTH, TITLE = 150, 12.0, 0.3
"""Dots per inch; width of all states, and height of their titles, in inches."""
PANEL, PANELS, FLAT = (900, 760), {"ruler": (760, 860)}, (720, 420)
"""Pixels of the picture of one state, for the rods for which they are others, and for straight rods."""
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
    for name, states in SHAPES.items():
        shapes(states, PICTURES / f"{name}.png")


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


def shapes(states: Sequence[tuple[str, str, float]], path: Path) -> None:
    """Draw states of demos, each by its demo, branch and load, beside each other, as the last of its demo is seen."""
    pictures, rows = [], [row_of(*state) for state in states]
    views = {
        name: read_state(RESULTS / name / "states.h5", branch, row).view()
        for (name, branch, _), row in zip(states, rows, strict=True)
    }
    panels = {name: PANELS.get(name, PANEL) if len(views) == 1 else FLAT for name in views}
    with tempfile.TemporaryDirectory() as folder:
        for (name, branch, _), row in zip(states, rows, strict=True):
            kept = {"caption": "", "size": panels[name], "view": views[name], "radius": RADII.get(name)}
            picture = draw_shape(RESULTS / name / "states.h5", branch, row, Path(folder, "shape.png"), **kept)
            pictures.append(cropped(matplotlib.image.imread(picture)))
    tallest = max(len(picture) / len(picture[0]) for picture in pictures)
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, WIDTH / len(states) * tallest + TITLE), dpi=DPI, layout="constrained")
        for axes, picture, (name, branch, load), row in zip(
            figure.subplots(1, len(states)), pictures, states, rows, strict=True
        ):
            found = diagram(name)
            index = next(b["columns"]["negative"][row] for b in found["branches"] if b["name"] == branch)
            axes.imshow(picture)
            axes.set_axis_off()
            axes.set_anchor("N")
            title = found["title"] if len(views) > 1 else f"{branch}, {axis_label(found)} = {load:g}, index {index}"
            axes.set_title(title, fontsize=12)
        figure.savefig(path)


def row_of(name: str, branch: str, load: float) -> int:
    """Row of a branch of a demo whose load is nearest to ``load``."""
    with h5py.File(RESULTS / name / "states.h5") as known:
        return int(np.argmin(abs(known[f"branches/{branch}/load"][:] - load)))


def cropped(picture: np.ndarray) -> np.ndarray:
    """A picture (height, width, 3 or 4) without the white rows above and below what is in it."""
    dark = np.flatnonzero((255 * picture[:, :, :3].min(axis=2) < WHITE).any(axis=1))
    return picture[max(dark[0] - MARGIN, 0) : dark[-1] + MARGIN]


if __name__ == "__main__":
    main()

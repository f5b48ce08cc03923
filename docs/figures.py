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
from rodfem.output.render import draw_shape
from rodfem.output.sheet import STYLE

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
DPI, PANEL = 150, (600, 640)
"""Dots per inch of a diagram, and pixels of the picture of one of three states."""


def main() -> None:
    """Run the demos and draw all pictures."""
    for name, loads in LOADS.items():
        at = ["--at", *map(str, loads)] if loads else []
        output = ["--no-figures", "--output", str(RESULTS / name)]
        subprocess.run([sys.executable, str(HOME / "demos" / f"{name}.py"), *at, *output], check=True)
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
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.0), dpi=DPI, layout="constrained")
        axes = figure.subplots()
        draw(axes, found, signs=(1, -1))
        axes.set(ylabel=label, title=found["title"])
        axes.legend(handles=legend_of(found), loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9)
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path)


def shapes(name: str, states: Sequence[tuple[str, float]], path: Path) -> None:
    """Draw states of a demo, each by its branch and load, beside each other."""
    file = RESULTS / name / "states.h5"
    panels = []
    with tempfile.TemporaryDirectory() as folder:
        for branch, load in states:
            with h5py.File(file) as found:
                row = int(np.argmin(abs(found[f"branches/{branch}/load"][:] - load)))
            caption = f"{branch}, λ = {load:g}"
            picture = draw_shape(file, branch, row, Path(folder, "shape.png"), caption=caption, size=PANEL)
            panels.append(matplotlib.image.imread(picture))
    matplotlib.image.imsave(path, np.concatenate(panels, axis=1))


if __name__ == "__main__":
    main()

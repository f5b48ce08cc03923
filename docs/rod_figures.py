"""The pictures of docs/rods.md: a sheet of small diagrams for each section, of the scenes that its blocks define.

python docs/rod_figures.py        # traces all scenes of the page, and draws docs/rods/*.png
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from panels import draw, legend_of

from rodfem import Discretization, Plan, Scene, trace
from rodfem.output.sheet import STYLE

DOCS = Path(__file__).parent
COLUMNS, DPI, MOST_ENTRIES = 3, 110, 4
MOST_BRANCHES = 6
"""Branches up to which a small diagram has all of them, and otherwise those alone that leave the first one."""


def main() -> None:
    """Trace the scenes of each section and draw its sheet."""
    for section, scenes in sections(DOCS / "rods.md").items():
        sheet(scenes, DOCS / "rods" / f"{section}.png")


def sections(page: Path) -> dict[str, dict[str, Scene]]:
    """Scenes of a page by the anchor of their section, and by their name there."""
    names: dict[str, Any] = {}
    found: dict[str, dict[str, Scene]] = {}
    for part in re.split(r"^## ", page.read_text(), flags=re.MULTILINE):
        known = set(names)
        for block in re.findall(r"```python\n(.*?)```", part, flags=re.DOTALL):
            exec(block, names)
        title = re.sub(r"[^\w\- ]", "", part.partition("\n")[0].lower()).replace(" ", "-")
        new = {name: x for name, x in names.items() if name not in known and isinstance(x, Scene)}
        found |= {title: new} if new else {}
    return found


def first_switches(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """A diagram without what leaves its side branches, if it has many."""
    if len(data["branches"]) <= MOST_BRANCHES:
        return data
    first = data["branches"][0]["name"]
    kept = [b for b in data["branches"] if b["parent"] is None or b["parent"][0] == first]
    return {**data, "branches": kept}


def sheet(scenes: Mapping[str, Scene], path: Path) -> None:
    """Draw the diagrams of ``scenes`` beside each other."""
    rows = ceil(len(scenes) / COLUMNS)
    with matplotlib.rc_context(STYLE | {"font.size": 9.0}):
        figure = Figure(figsize=(10.0, 2.7 * rows + 0.5), dpi=DPI, layout="constrained")
        handles: list[Line2D] = []
        places = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
        for axes, (name, scene) in zip(places, scenes.items(), strict=False):
            diagram = trace(scene, Discretization("auto", 8, 6), Plan(error_bars=False))
            found = first_switches(diagram.data)
            draw(axes, found, width=1.6)
            handles += legend_of(found)
            axes.set(title=name, ylabel=r"$\omega$" if not scene.conservative else scene.ordinate.name)
        for axes in places[len(scenes) :]:
            axes.set_axis_off()
        entries = {handle.get_label(): handle for handle in handles}
        columns = min(len(entries), MOST_ENTRIES)
        room = 0.25 * (ceil(len(entries) / columns) + 0.4) / figure.get_size_inches()[1]
        figure.get_layout_engine().set(rect=(0, room, 1, 1 - room))
        figure.legend(handles=list(entries.values()), loc="lower center", ncols=columns, frameon=False)
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path)


if __name__ == "__main__":
    main()

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
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from panels import draw, legend_of

from rodfem import Branch, Diagram, Discretization, Plan, Ring, Scene, trace
from rodfem.output.sheet import STYLE, symbol_of, tex
from rodfem.output.view import sign_of, view_of

DOCS = Path(__file__).parent
COLUMNS, DPI, MOST_ENTRIES = 2, 110, 4
WIDTHS = [2.6, 1.0]
"""Of a diagram, and of the shape beside it."""
FIRST_STEP = (0.25, 0.5, 0.75)
"""Places of more rows on the first step of a branch, in parts of its ordinate; it is a parabola, nearly."""
STILL = 1e-3
"""Ordinate below which a state has not moved."""
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
    """Draw the diagrams of ``scenes`` beside each other, each with the shape of a stable state."""
    rows = ceil(len(scenes) / COLUMNS)
    with matplotlib.rc_context(STYLE | {"font.size": 9.0}):
        figure = Figure(figsize=(10.0, 2.9 * rows + 0.6), dpi=DPI, layout="constrained")
        handles: list[Artist] = []
        grid = figure.add_gridspec(rows, 2 * COLUMNS, width_ratios=COLUMNS * WIDTHS)
        for number, (name, scene) in enumerate(scenes.items()):
            row, column = divmod(number, COLUMNS)
            diagram = traced(scene)
            found = first_switches(diagram.data)
            state = shown(diagram)
            last = 2 * column + (1 if state else 2)
            axes = figure.add_subplot(grid[row, 2 * column : last])
            draw(axes, found, width=1.6)
            handles += legend_of(found)
            axes.set_title(name, family="monospace")
            if scene.conservative:
                axes.set_ylabel(scene.ordinate.name)
            if state:
                shape(figure.add_subplot(grid[row, last]), diagram, *state)
        entries = {handle.get_label(): handle for handle in handles}
        columns = min(len(entries), MOST_ENTRIES)
        room = 0.25 * (ceil(len(entries) / columns) + 0.4) / figure.get_size_inches()[1]
        figure.get_layout_engine().set(rect=(0, room, 1, 1 - room))
        figure.legend(handles=list(entries.values()), loc="lower center", ncols=columns, frameon=False)
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path)


def traced(scene: Scene) -> Diagram:
    """Diagram of a scene, with rows of their own on the first step of each branch, which would be drawn as a chord."""
    found = trace(scene, Discretization("auto", 8, 6), Plan(error_bars=False))
    starts = [b.points[:2] for b in found if b.parent and len(b.points) > 1]
    loads = {p.load + (q.load - p.load) * t**2 for p, q in starts for t in FIRST_STEP}
    return found.again(at=tuple(sorted(loads))) if loads else found


def shown(diagram: Diagram) -> tuple[Branch, int] | None:
    """Branch and row of the state that is drawn: a stable one, of a side branch if there is one.

    It is some way along a side branch, at the end of the first one.  Where no state that moves is stable it is the
    one that has moved most, of the first side branch.
    """
    if not diagram.scene.conservative:
        return None
    stable = [(b, i) for b in diagram for i, p in enumerate(b.points) if p.negative == 0 and abs(p.ordinate) > STILL]
    side = [(b, i) for b, i in stable if b is not diagram[0]]
    if chosen := side or stable:
        rows = [(b, i) for b, i in chosen if b is chosen[0][0]]
        return rows[2 * len(rows) // 3 if side else -1]
    branch = next(iter(diagram.branches[1:]), None)
    return branch and (branch, max(range(len(branch.points)), key=lambda i: abs(branch.points[i].ordinate)))


def shape(axes: Axes, diagram: Diagram, branch: Branch, row: int) -> None:
    """Draw the centreline of a state, and of the first one in grey, as :mod:`rodfem.output.view` looks at it.

    Gravity is along -e3.
    """
    first, point = diagram[0].points[0], branch.points[row]
    lines = [diagram.solvers[p.mesh].shape.sample(p.x)["r"] for p in (first, point)]
    if isinstance(diagram.scene.ends, Ring):  # it may be anywhere
        lines = [r - r.mean(axis=0) for r in lines]
    moved, down = lines[1] - lines[0], None if diagram.scene.distributed is None else np.array([0.0, 0.0, -1.0])
    right, up, _ = view_of(lines[0], moved, down=down)
    up = up * sign_of(moved[np.argmax(abs(moved @ up))] @ up) if down is None else up  # of two images the upper one
    for r, style in zip(lines, ({"color": "0.75", "lw": 2.0}, {"color": "#7ea6cf", "lw": 3.0}), strict=True):
        axes.plot(r @ right, r @ up, solid_capstyle="round", **style)
        axes.plot(r[0] @ right, r[0] @ up, "s", color="0.45", ms=4)
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.set_axis_off()
    scene = diagram.scene
    symbol = tex(symbol_of(scene.parameters[scene.load].label or scene.load), always=True)
    index = f"index {point.negative}"
    axes.set_title(f"{symbol} = {point.load:.3g}, {index}", fontsize=8.5, color="0.3")


if __name__ == "__main__":
    main()

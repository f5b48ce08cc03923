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
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from panels import COUNT, IN_SPACE, draw, legend_of

from rodfem import Branch, Diagram, Discretization, Plan, Ring, Scene, trace
from rodfem.output.glyphs import Look, glyphs_of, sign_of
from rodfem.output.render import view_of
from rodfem.output.style import STYLE, symbol_of, tex
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import Setting
from rodfem.problem.supports import distributed_on, foundation_of, supports_of

DOCS = Path(__file__).parent
COLUMNS, DPI, MOST_ENTRIES, LONG = 2, 110, 4, 40
WIDTHS = [2.2, 1.25]
"""Of a diagram, and of the shape beside it."""
FONT, SLENDER = 11.0, 45.0
"""Points of the text; the rod's length over the radius to which supports and loads are drawn."""
FIRST = {"color": "0.75", "lw": 2.5}
"""How the first state is drawn."""
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
    with matplotlib.rc_context(STYLE | {"font.size": FONT}):
        figure = Figure(figsize=(10.5, 3.3 * rows + 0.7), dpi=DPI, layout="constrained")
        handles: list[Artist] = []
        grid = figure.add_gridspec(rows, 2 * COLUMNS, width_ratios=COLUMNS * WIDTHS)
        for number, (name, scene) in enumerate(scenes.items()):
            row, column = divmod(number, COLUMNS)
            diagram = traced(scene)
            found = first_switches(diagram.data)
            state = shown(diagram)
            last = 2 * column + (1 if state else 2)
            axes = figure.add_subplot(grid[row, 2 * column : last])
            draw(axes, found, width=2.0)
            handles += legend_of(found)
            axes.set_title(name, family="monospace")
            if scene.conservative:
                axes.set_ylabel(scene.ordinate.name)
            if state:
                shape(figure.add_subplot(grid[row, last]), diagram, *state)
                handles.append(Line2D([], [], **FIRST, label="first state"))
        entries = {handle.get_label(): handle for handle in handles}
        if COUNT + IN_SPACE in entries:
            entries.pop(COUNT, None)
        columns = min(len(entries), MOST_ENTRIES if max(map(len, entries)) < LONG else MOST_ENTRIES - 2)
        room = 0.29 * (ceil(len(entries) / columns) + 0.4) / figure.get_size_inches()[1]
        figure.get_layout_engine().set(rect=(0, room, 1, 1 - room))
        figure.legend(handles=list(entries.values()), loc="lower center", ncols=columns, frameon=False)
        path.parent.mkdir(exist_ok=True)
        figure.savefig(path)


def traced(scene: Scene) -> Diagram:
    """Diagram of a scene."""
    return trace(scene, Discretization("auto", 8, 6), Plan(error_bars=False))


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
    """Draw a state with its supports and loads, and the first one in grey, in the directions of ``view_of``.

    Gravity is along -e3.
    """
    scene, first, point = diagram.scene, diagram[0].points[0], branch.points[row]
    samples = [diagram.solvers[p.mesh].shape.sample(p.x) for p in (first, point)]
    lines = [sample["r"] for sample in samples]
    if isinstance(scene.ends, Ring):  # it may be anywhere
        lines = [r - r.mean(axis=0) for r in lines]
    moved, down = lines[1] - lines[0], None if scene.distributed is None else np.array([0.0, 0.0, -1.0])
    right, up, _ = view_of(lines[0], moved, down=down)
    up = up * sign_of(moved[np.argmax(abs(moved @ up))] @ up) if down is None else up  # of two images the upper one
    view = np.array([right, up, np.cross(right, up)])
    for r, style in zip(lines, (FIRST, {"color": "#5b8fc4", "lw": 4.0}), strict=True):
        axes.plot(r @ right, r @ up, solid_capstyle="round", zorder=2, **style)
    setting = Setting(
        supports=tuple(supports_of(scene, samples[1]).values()),
        distributed=distributed_on(scene, point.load) if scene.distributed is not None else None,
        foundation=foundation_of(scene, samples[1]) if scene.potential is not None else None,
    )
    s = samples[1]["s"]
    look = Look(float(np.ptp(s)) / SLENDER, view)
    solids = glyphs_of(setting, s, (lines[1], directors(samples[1]["q"])), look)
    for solid in solids:
        corners = solid.points[solid.triangles] @ view.T
        shade = PolyCollection(
            list(corners[:, :, :2]), facecolors=solid.color, edgecolors=solid.color, lw=0.3, zorder=3
        )
        axes.add_collection(shade)
        axes.update_datalim(corners[:, :, :2].reshape(-1, 2))
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.set_axis_off()
    symbol = tex(symbol_of(scene.parameters[scene.load].label or scene.load), always=True)
    index = f"{point.negative} ({point.negative_in_space})" if point.negative_in_space else f"{point.negative}"
    words = "stable" if index == "0" else f"index {index}"
    axes.set_title(f"{symbol} = {point.load:.3g}, {words}", fontsize=FONT - 1, color="0.3")


if __name__ == "__main__":
    main()

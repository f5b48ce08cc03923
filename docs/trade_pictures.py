"""Pictures of pages of docs/trades that need nothing but shapes: the program of the page, and its states.

python docs/trade_pictures.py        # runs the programs, and draws docs/trades/{arch,drill-string,tendons,dna}.png
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import rodfem
from rodfem import Discretization, Plan

TRADES, DPI = Path(__file__).parent / "trades", 110
GREY, COLOURS = "0.6", ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728")


def main() -> None:
    """Draw the four."""
    for name, draw in (("arch", arch), ("drill-string", drill_string), ("tendons", tendons), ("dna", minicircle)):
        page, names = (TRADES / f"{name}.md").read_text(), dict[str, Any]()
        exec(re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)[0], names)
        draw(names).savefig(TRADES / f"{name}.png", dpi=DPI, bbox_inches="tight")


def in_space(figure: Figure, elevation: float, azimuth: float) -> Any:
    """Axes without ticks, seen from two angles in degrees."""
    axes: Any = figure.add_subplot(projection="3d")
    axes.view_init(elevation, azimuth)
    axes.set_axis_off()
    return axes


def drawn(axes: Any, r: np.ndarray, **style: Any) -> None:
    """Draw a centreline (m, 3), with ``e3`` to the right and ``e1`` down."""
    axes.plot(r[:, 2], r[:, 1], -r[:, 0], solid_capstyle="round", **style)


def at(points: Iterable[Any], load: float) -> Any:
    """The point whose load is nearest to one."""
    return min(points, key=lambda point: abs(point.load - load))


def arch(names: dict[str, Any]) -> Figure:
    """The arch at rest, and where it has turned over."""
    strip = names["arch"](names["E"] * names["thickness"] * names["width"] ** 3 / 12, 10.0)
    diagram = rodfem.trace(strip, Discretization(elements=8), Plan(depth=1, error_bars=False))
    figure = Figure(figsize=(6.0, 3.2), layout="constrained")
    axes = in_space(figure, 22.0, -62.0)
    drawn(axes, diagram[0].points[0].r, color=GREY, linewidth=4, label="at rest")
    points = diagram[1].points
    for load, colour in zip((2.95, 3.3, 4.0), COLOURS, strict=False):
        point = at(points, load)
        drawn(axes, point.r, color=colour, linewidth=3, label=f"M = {point.load:.2f} N m, index {point.negative}")
    axes.set_aspect("equal")
    axes.dist = 7
    axes.legend(loc="upper center", ncols=2, frameon=False, bbox_to_anchor=(0.5, 0.25))
    return figure


def drill_string(names: dict[str, Any]) -> Figure:
    """Shapes just after the first two critical weights, of the short and of the long string."""
    figure = Figure(figsize=(6.0, 3.4), layout="constrained")
    for axes, (length, elements) in zip(figure.subplots(1, 2), ((8.0, 8), (50.0, 40)), strict=True):
        plan = Plan(depth=1, error_bars=False)
        diagram = rodfem.trace(names["string"](length), Discretization(elements=elements), plan)
        for branch, colour in zip(diagram.branches[1:3], COLOURS, strict=False):
            point = branch.points[1]
            axes.plot(point.r[:, 0], point.r[:, 2], color=colour, linewidth=2.5)
            axes.plot([], [], color=colour, label=f"F = {branch.points[0].load:.4f}")
        axes.axvline(0.0, color=GREY, linewidth=0.8, zorder=0)
        axes.set_title(f"l = {length:g}", fontsize="medium")
        axes.set_xlabel("deflection")
        axes.legend(frameon=False, loc="upper center", fontsize="small", bbox_to_anchor=(0.5, -0.2))
    figure.axes[0].set_ylabel("height above the bit")
    return figure


def tendons(names: dict[str, Any]) -> Figure:
    """The robot at growing tensions, with its tendons at the last one."""
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = in_space(figure, 18.0, -40.0)
    points = rodfem.trace(names["robot"]("part", 1.0, names["pulled"]), plan=Plan(depth=0, error_bars=False))[0].points
    for share in (0.0, 0.25, 0.5, 1.0):
        point = at(points, share)
        colour = "#1f77b4" if share == 1.0 else GREY
        axes.plot(*point.r.T, color=colour, linewidth=3)
        axes.text(*point.r[-1], f"  {point.load:.0%}", color=colour)
    for (x, y), end, colour in (((0.0, 0.01), 0.2, "#d62728"), ((0.00866, -0.005), 0.4, "#ff7f0e")):
        inside = point.s <= end + 1e-9
        tendon = point.r + x * point.directors[:, 0] + y * point.directors[:, 1]
        axes.plot(*tendon[inside].T, color=colour, linewidth=1.2)
    axes.set_aspect("equal")
    axes.dist = 7
    return figure


def minicircle(names: dict[str, Any]) -> Figure:
    """The ring with its first link, half way, and where it snaps."""
    figure = Figure(figsize=(6.0, 3.0), layout="constrained")
    axes, points, fold = in_space(figure, 35.0, -60.0), names["diagram"][0].points, names["fold"]
    for n, colour in zip((0.0, 1.0, fold.point.load), (GREY, *COLOURS), strict=False):
        point = at((*points[: fold.row + 1], fold.point), n)
        r = 1e9 * (point.r - point.r.mean(axis=0))
        r = r @ np.linalg.svd(r, full_matrices=False)[2].T
        axes.plot(*r.T, color=colour, linewidth=3, label=f"n = {point.load:.2f}")
    axes.set_aspect("equal")
    axes.dist = 7
    axes.legend(loc="upper center", ncols=3, frameon=False, bbox_to_anchor=(0.5, 0.2))
    return figure


if __name__ == "__main__":
    main()

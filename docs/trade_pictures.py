"""Pictures of pages of docs/trades that need nothing but shapes: the program of the page, and its states.

python docs/trade_pictures.py        # runs the programs of five pages, and draws their pictures
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.interpolate import CubicSpline

import rodfem
from rodfem import Discretization, Plan

TRADES, DPI = Path(__file__).parent / "trades", 110
GREY, COLOURS = "0.6", ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728")


def main() -> None:
    """Draw the five."""
    pages = {
        "arch": arch,
        "drill-string": drill_string,
        "tendons": tendons,
        "dna": minicircle,
        "../real-rods": real_rods,
    }
    for name, draw in pages.items():
        page, names = (TRADES / f"{name}.md").read_text(), dict[str, Any]()
        blocks = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
        for block in blocks if name.startswith("..") else blocks[:1]:
            exec(block, names)
        draw(names).savefig(TRADES / f"{name}.png", dpi=DPI)


def in_space(figure: Figure, elevation: float, azimuth: float) -> Any:
    """Axes without ticks, seen from two angles in degrees."""
    axes: Any = figure.add_subplot(projection="3d")
    axes.view_init(elevation, azimuth)
    axes.set_axis_off()
    return axes


def framed(axes: Any, zoom: float) -> None:
    """Equal scales along all axes, and less white around."""
    limits = np.array([axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d()])
    axes.set_box_aspect(np.ptp(limits, axis=1), zoom=zoom)


def band(axes: Any, edges: tuple[np.ndarray, np.ndarray], colour: str, label: str) -> None:
    """Draw a strip between two edges (m, 3), with ``e3`` to the right and ``e1`` down."""
    one, other = (np.column_stack([r[:, 2], r[:, 1], -r[:, 0]]) for r in edges)
    quads = np.stack([one[:-1], one[1:], other[1:], other[:-1]], axis=1)
    axes.add_collection3d(Poly3DCollection(quads, facecolor=colour, edgecolor="0.25", linewidth=0.2))
    axes.plot(*one.T, color=colour, linewidth=1)
    axes.plot(*other.T, color=colour, linewidth=1, label=label)


def at(points: Iterable[Any], load: float) -> Any:
    """The point whose load is nearest to one."""
    return min(points, key=lambda point: abs(point.load - load))


def arch(names: dict[str, Any]) -> Figure:
    """The arch at rest, and where it has turned over."""
    strip = names["arch"](names["E"] * names["thickness"] * names["width"] ** 3 / 12, 10.0)
    diagram = rodfem.trace(strip, Discretization(elements=8), Plan(depth=1, error_bars=False))
    figure = Figure(figsize=(7.0, 3.6))
    axes = in_space(figure, 24.0, -58.0)
    axes.set_position((0.0, -0.35, 1.0, 1.7))
    shown = [(diagram[0].points[0], GREY, "at rest")]
    for load, colour in zip((2.95, 3.3, 4.0), COLOURS, strict=False):
        point = at(diagram[1].points, load)
        shown.append((point, colour, f"M = {point.load:.2f} N m, index {point.negative}"))
    for point, colour, label in shown:
        half = names["width"] / 2 * point.directors[:, 0]
        band(axes, (point.r - half, point.r + half), colour, label)
    every = np.concatenate([point.r for point, _, _ in shown])[:, [2, 1, 0]] * (1, 1, -1)
    for limit, values in zip((axes.set_xlim3d, axes.set_ylim3d, axes.set_zlim3d), every.T, strict=True):
        limit(values.min() - names["width"], values.max() + names["width"])
    framed(axes, 1.1)
    figure.legend(loc="lower center", ncols=2, frameon=False)
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
    """The robot with its discs and tendons, at rest, pulled, and with a force on its tip."""
    figure = Figure(figsize=(6.0, 4.4))
    axes = in_space(figure, 16.0, -55.0)
    axes.set_position((-0.05, -0.06, 1.1, 1.2))
    plan, around = Plan(depth=0, error_bars=False), np.linspace(0.0, 2 * np.pi, 41)
    circle = 0.012 * np.column_stack([np.cos(around), np.sin(around)])
    forces = [None, *(force for force, _ in names["TIPS"])]
    for force, colour in zip(forces, (GREY, "black", *COLOURS), strict=False):
        scene = names["robot"]("part", 1.0, names["pulled"], force or (0.0, 0.0, 0.0))
        point = rodfem.trace(scene, plan=plan)[0].points[0 if force is None else -1]
        said = "at rest" if force is None else "pulled"
        said += f", 1 N along e{1 + force.index(1.0)}" if force and any(force) else ""
        axes.plot(*point.r.T, color=colour, linewidth=2.5, label=said)
        for i in range(0, len(point.s), max(1, len(point.s) // 12)):
            axes.plot(*(point.r[i] + circle @ point.directors[i, :2]).T, color=colour, linewidth=0.8)
        for place, end in (((0.0, 0.01), 0.2), (names["lower"], 0.4)):
            inside = point.s <= end + 1e-9
            cable = point.r + np.array(place) @ point.directors[:, :2]
            axes.plot(*cable[inside].T, color=colour, linewidth=0.8)
    framed(axes, 1.2)
    figure.legend(loc="lower center", ncols=3, frameon=False, fontsize="small")
    return figure


def minicircle(names: dict[str, Any]) -> Figure:
    """The two strands of the ring with its first link, half way, and where it snaps."""
    figure = Figure(figsize=(7.0, 2.8))
    points, fold = names["diagram"][0].points, names["fold"]
    for i, n in enumerate((0.0, 1.0, fold.point.load)):
        axes = in_space(figure, 50.0, -60.0)
        axes.set_position((0.33 * i, 0.0, 0.33, 0.95))
        point = at((*points[: fold.row + 1], fold.point), n)
        s = np.linspace(*names["minicircle"].interval, 600)
        r, across = (CubicSpline(point.s, values)(s) for values in (1e9 * point.r, point.directors[:, :2]))
        turned = 2 * np.pi * 9 * s / s[-1]  # about a turn in ten base pairs
        out = np.column_stack([np.cos(turned), np.sin(turned)])[:, None] @ across
        turn = np.linalg.svd(r - r.mean(axis=0), full_matrices=False)[2].T
        for sign, colour in ((1.0, COLOURS[0]), (-1.0, COLOURS[1])):
            axes.plot(*((r - r.mean(axis=0) + sign * out[:, 0]) @ turn).T, color=colour, linewidth=2)
        framed(axes, 1.3)
        axes.set_title(f"n = {point.load:.2f}", fontsize="medium", y=0.92)
    return figure


def real_rods(names: dict[str, Any]) -> Figure:
    """Force against displacement: the spring, the catheter and the cable, before and after they buckle."""
    figure = Figure(figsize=(9.0, 3.0), layout="constrained")
    spring, catheter, cable = figure.subplots(1, 3)
    of = {
        spring: (names["spring"], lambda p: (1e3 * (0.16 - p.r[-1, 2]), p.reactions.left.force[2])),
        catheter: (names["catheter"], lambda p: (1e3 * (0.06 - p.r[-1, 2]), 1e3 * p.load)),
        cable: (names["cable"], lambda p: (p.load, 1e3 * p.reactions.right.moment[2])),
    }
    for axes, (scene, pair) in of.items():
        diagram = rodfem.trace(scene, plan=Plan(depth=1, error_bars=False))
        for branch, colour in zip(diagram.branches[:2], COLOURS, strict=False):
            for one, other in pairwise(branch.points):
                axes.plot(*zip(pair(one), pair(other), strict=True), "-" if other.stable else ":", color=colour)
    spring.set(title="spring", xlabel="compression, mm", ylabel="force, N")
    catheter.set(title="catheter", xlabel="shortening, mm", ylabel="push, mN")
    cable.set(title="cable", xlabel="turn, rad", ylabel="torque, mN m")
    return figure


if __name__ == "__main__":
    main()

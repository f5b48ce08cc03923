"""Figures of the page: error against time, and cost against size."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from benchmarks.speed.run import PAPER
from benchmarks.store import Store
from benchmarks.targets import TARGETS, Target

Row = dict[str, Any]

COLOURS = {1: "#d55e00", 2: "#e69f00", 3: "#f0c000", 4: "#009e73", 5: "#3aa6a0", 6: "#0072b2", 8: "#7a3fa0"}
"""Colour for each degree."""
FLOOR = 1e-14
"""An error of zero is drawn here."""
COLUMNS = 4
"""Columns of a legend."""
AUTO_NAMES = {"follower": ("flutter",), "hemitropic": ("hemitropic", "hemitropic-half")}
PEER_BRANCH = {"flutter": "mu1, mu2"}


def peers(store: Store, scene: str, branch: str) -> dict[str, list[Row]]:
    """AUTO's rows for a branch, by problem."""
    out = {}
    for problem in AUTO_NAMES.get(scene, (scene,)):
        rows = [r for r in store.rows("auto") if r["scene"] == problem]
        rows = [r for r in rows if r["name"] == PEER_BRANCH.get(problem, branch)]
        if rows:
            out[problem] = rows
    return out


def series(axes: Axes, rows: Iterable[Row], time: Callable[[Row], float], error: Callable[[Row], float | None]) -> None:
    """A line for each formulation and degree: filled if reduced, hollow if pointwise; the paper's point is a star."""
    groups: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        if error(row) is not None:
            groups.setdefault((row["formulation"], row["degree"]), []).append(row)
    for (formulation, degree), group in sorted(groups.items()):
        group.sort(key=lambda r: r["elements"])
        reduced, colour = formulation == "reduced", COLOURS[degree]
        x, y = [1e3 * time(r) for r in group], [max(error(r) or 0.0, FLOOR) for r in group]
        style = {"linestyle": "-" if reduced else ":", "marker": "o", "markersize": 4, "linewidth": 1}
        label = f"rodfem P{degree}, {formulation}"
        axes.loglog(x, y, color=colour, markerfacecolor=colour if reduced else "white", label=label, **style)
        for a, b, row in zip(x, y, group, strict=True):
            if (row["elements"], degree) == PAPER:
                label = f"the paper's: 150 P1, midpoint rule ({formulation})"
                face = colour if reduced else "white"
                axes.loglog(a, b, "*", color=colour, markerfacecolor=face, markersize=12, label=label, linestyle="none")


def auto(axes: Axes, store: Store, scene: str, branch: str, x: Callable[[Row], float], target: str) -> None:
    """AUTO's points for one target."""
    for problem, rows in peers(store, scene, branch).items():
        found = sorted(
            (1e3 * x(r), max(r["errors"][target], FLOOR)) for r in rows if r["errors"].get(target) is not None
        )
        half = problem.endswith("-half")
        if found:
            times, errors = zip(*found, strict=True)
            face = "white" if half else "black"
            label = "AUTO-07p, half the rod" if half else "AUTO-07p"
            axes.loglog(times, errors, "s--", color="black", markerfacecolor=face, markersize=5, label=label)


def scipy(axes: Axes, store: Store, scene: str, branch: str) -> None:
    """Points of scipy's solve_bvp."""
    rows = sorted((r for r in store.rows(f"bvp/{scene}/{branch}")), key=lambda r: -r["tolerance"])
    if rows:
        x, y = [1e3 * r["seconds"] for r in rows], [r["error"] for r in rows]
        axes.loglog(x, y, "^-.", color="grey", markersize=5, label="scipy solve_bvp")


def finish(figure: Figure, panels: Sequence[Axes], path: Path, time: str) -> str:
    """Name the axes, one legend for all panels below them, save."""
    entries: dict[str, Any] = {}
    for axes in panels:
        axes.grid(True, which="major", linewidth=0.4)
        axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.tick_params(labelsize=8)
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    figure.suptitle(f"Relative error against {time}", fontsize=11)
    order = sorted(entries, key=lambda x: (not x.startswith("rodfem"), "pointwise" in x, x))
    below = 0.2 * (1 + -(-len(order) // COLUMNS)) / figure.get_size_inches()[1]
    figure.get_layout_engine().set(rect=(0, below, 1, 1 - below))
    figure.legend([entries[x] for x in order], order, loc="lower center", ncols=COLUMNS, fontsize=8)
    figure.savefig(path)
    return path.name


def targets(special: bool) -> list[tuple[str, str, Target]]:
    """Scene, branch and target of each panel: special points, or states at a load."""
    return [
        (scene, branch, target)
        for scene, branches in TARGETS.items()
        for branch, found in branches.items()
        for target in found
        if (target.at is None) == special and (special or scene != "follower")
    ]


def work_precision(store: Store, path: Path, special: bool) -> str | None:
    """Error of special points against the time of the branch, or of states against the time of an accepted point."""
    panels = targets(special)
    rows = store.rows("branches")
    if not rows:
        return None
    columns = 4 if special else 3
    lines = -(-len(panels) // columns)
    figure = Figure(figsize=(4.0 * columns, 3.0 * lines + 1.2), dpi=110, layout="constrained")
    grid = figure.subplots(lines, columns, squeeze=False).ravel()
    for axes, (scene, branch, target) in zip(grid, panels, strict=False):
        mine = [r for r in rows if r["scene"] == scene and r["branch"] == branch]
        name = target.name

        def cost(r: Row) -> float:
            return float(r["seconds"] if special else r["following"] / r["points"])

        series(axes, mine, cost, lambda r, name=name: r["errors"].get(name))  # type: ignore[misc]
        auto(axes, store, scene, branch, cost, name)
        if not special:
            scipy(axes, store, scene, branch)
        axes.set_title(f"{scene}, {branch}\n{name}", fontsize=9)
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    words = (
        "ms for the whole branch, special points and index included"
        if special
        else "ms per accepted point, index included"
    )
    return finish(figure, grid[: len(panels)], path, words)


def eigenvalues(store: Store, path: Path) -> str | None:
    """Error of left-most eigenvalues against the time of one judgement."""
    rows = store.rows("eigenvalues")
    names = list(dict.fromkeys(r["name"] for r in rows))
    if not names:
        return None
    figure = Figure(figsize=(13.0, 4.4), dpi=110, layout="constrained")
    grid = figure.subplots(1, len(names), squeeze=False).ravel()
    for axes, name in zip(grid, names, strict=True):
        series(axes, [r for r in rows if r["name"] == name], lambda r: r["seconds"], lambda r: r["error"])
        axes.set_title(name, fontsize=9)
    return finish(figure, grid, path, "ms for one judgement")


def growth(store: Store, path: Path) -> str | None:
    """Time and memory against the number of unknowns."""
    rows = store.rows("growth")
    if not rows:
        return None
    figure = Figure(figsize=(12.0, 4.0), dpi=110, layout="constrained")
    grid = figure.subplots(1, 3)
    for axes, key, words in zip(
        grid,
        ("equilibrium", "count", "memory"),
        ("s for one equilibrium", "s for one index", "MB"),
        strict=True,
    ):
        for formulation, colour in (("reduced", "#0072b2"), ("pointwise", "#d55e00")):
            for state, mark in (("straight", "o-"), ("buckled", "s--")):
                found = sorted(
                    (r["unknowns"], r[key]) for r in rows if (r["formulation"], r["state"]) == (formulation, state)
                )
                if found:
                    axes.loglog(*zip(*found, strict=True), mark, color=colour, label=f"{state}, {formulation}")
        axes.grid(True, linewidth=0.4)
        axes.set(xlabel="unknowns", ylabel=words)
    grid[0].legend(fontsize=8)
    figure.savefig(path)
    return path.name


def draw(store: Store, folder: Path) -> dict[str, str]:
    """Draw what there are measurements for; names of the files."""
    found = {
        "equilibria": work_precision(store, folder / "speed-equilibria.png", special=False),
        "special": work_precision(store, folder / "speed-special.png", special=True),
        "eigenvalues": eigenvalues(store, folder / "speed-eigenvalues.png"),
        "growth": growth(store, folder / "speed-growth.png"),
    }
    return {key: name for key, name in found.items() if name}

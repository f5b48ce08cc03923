"""Figures of the page, drawn from its tables: error against time, and cost against size.

The page is all that they need, so that they can be drawn anew without a measurement: ``python -m benchmarks.speed
--pictures``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from math import ceil
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

from benchmarks.speed.run import PAPER
from benchmarks.store import Store
from benchmarks.targets import TARGETS, Target
from rodfem.output.style import STYLE

Row = dict[str, Any]
Table = list[list[str]]
Page = Mapping[str, Sequence[Table]]

FIGURES = {
    "equilibria": "speed-equilibria.png", "special": "speed-special.png", "eigenvalues": "speed-eigenvalues.png",
    "growth": "speed-growth.png",
}  # fmt: skip
"""Names of the files."""
COLOURS = {1: "#d55e00", 2: "#e69f00", 3: "#a6a000", 4: "#009e73", 5: "#3aa6a0", 6: "#0072b2", 8: "#7a3fa0"}
"""Colour for each degree."""
MARKS = {1: "X", 2: "P", 3: "<", 4: "D", 5: ">", 6: "o", 8: "h"}
SIZES = {"X": 6.0, "P": 6.0, "D": 4.6, "h": 6.0}
"""Mark for each degree, and sizes of those that are not 5 points wide: degrees never show by colour alone."""
FLOOR, LOWEST = 1e-15, 3e-16
"""An error of zero is drawn here; the least error on the axes."""
COLUMNS, WIDE, HIGH, DPI = 3, 3.9, 3.4, 110
"""Panels side by side, the size of one in inches, dots per inch."""
LINE = 0.24
"""Height of a line of a legend in inches."""
AUTO_NAMES = {"follower": ("flutter",), "hemitropic": ("hemitropic", "hemitropic-half")}
PEER_BRANCH = {"flutter": "mu1, mu2"}
REDUCED = "reduced"
DEGREE = "rodfem, degree {}"
HALF = "half the rod"
UNKNOWN = "beyond the references"
KNOWN = r"differ from the table by at most (\S+):\s+errors\s+below"
"""What the page says about the accuracy of the references."""
JUDGED = "rod", "discretisation"
"""First columns of the table of all judgements."""


def peers(store: Store, scene: str, branch: str) -> dict[str, list[Row]]:
    """AUTO's rows for a branch, by problem."""
    out = {}
    for problem in AUTO_NAMES.get(scene, (scene,)):
        rows = [r for r in store.rows("auto") if r["scene"] == problem]
        rows = [r for r in rows if r["name"] == PEER_BRANCH.get(problem, branch)]
        if rows:
            out[problem] = rows
    return out


def read(text: str) -> dict[str, list[Table]]:
    """Tables of a page in Markdown by the title of their section: rows of cells, the head first, without its rule."""
    found: dict[str, list[Table]] = {}
    title, last = "", ""
    for line in text.splitlines():
        if line.startswith("#"):
            title = line.lstrip("# ")
        if line.startswith("|"):
            if not last.startswith("|"):
                found.setdefault(title, []).append([])
            cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
            if not all(re.fullmatch(":?-+:?", cell) for cell in cells):
                found[title][-1].append(cells)
        last = line
    return found


def rows_of(page: Page, section: str, *head: str) -> list[list[str]]:
    """Rows of the table of a section whose first columns have these names; empty where there is none."""
    return [row for table in page.get(section, ()) if tuple(table[0][: len(head)]) == head for row in table[1:]]


def discretisation(words: str) -> tuple[int, int, str]:
    """Elements, degree and formulation, as in ``10 P6 reduced``."""
    elements, degree, formulation = words.split()
    return int(elements), int(degree.removeprefix("P")), formulation


def series(axes: Axes, points: Iterable[tuple[str, float, float]]) -> None:
    """Errors against times by discretisation, those of one degree joined in the order of their elements.

    Those of the reduced formulation, with filled marks; of the pointwise one, with hollow marks, where there is no
    other.  The paper's discretisation is a star, in either formulation.
    """
    groups: dict[tuple[str, int], list[tuple[int, float, float]]] = {}
    for words, time, error in points:
        elements, degree, formulation = discretisation(words)
        groups.setdefault((formulation, degree), []).append((elements, time, max(error, FLOOR)))
    joined = REDUCED if any(formulation == REDUCED for formulation, _ in groups) else "pointwise"
    for (formulation, degree), group in sorted(groups.items(), reverse=True):
        places = [(time, error) for _, time, error in sorted(group)]
        colour = COLOURS[degree]
        style: dict[str, Any] = {"color": colour, "markerfacecolor": colour if formulation == REDUCED else "white"}
        if formulation == joined:
            label = DEGREE.format(degree) if formulation == REDUCED else "_"
            mark = MARKS[degree]
            size = SIZES.get(mark, 5.0)
            axes.loglog(*zip(*places, strict=True), f"{mark}-", lw=1.8, ms=size, label=label, zorder=4, **style)
        for elements, time, error in group:
            if (elements, degree) == PAPER:
                style |= {"mec": "black", "mew": 0.7, "ms": 13, "label": "_", "zorder": 6}
                axes.loglog(time, error, "*", **style)


def others(axes: Axes, page: Page, scene: str, branch: str, special: bool) -> None:
    """AUTO's points of a branch, and for states those of scipy's solve_bvp."""
    column, styles = (8 if special else 7), {"": ("s--", "black"), HALF: ("s:", "white")}
    for half, (line, face) in styles.items():
        rows = [r for r in rows_of(page, "Beside AUTO-07p", "scene") if r[0].split()[0] == scene and r[1] == branch]
        found = sorted((float(r[column]), float(r[4])) for r in rows if r[3] and ("half" in r[0]) == bool(half))
        if found:
            style = {"color": "black", "markerfacecolor": face, "ms": 5.5, "lw": 1.3, "zorder": 5}
            axes.loglog(*zip(*found, strict=True), line, label=", ".join(filter(None, ("AUTO-07p", half))), **style)
    rows = [] if special else [r for r in rows_of(page, "Beside scipy", "scene") if r[:2] == [scene, branch]]
    if rows:
        found = sorted((float(r[6]), float(r[3])) for r in rows)
        axes.loglog(*zip(*found, strict=True), "^-.", color="0.45", ms=6, lw=1.3, label="scipy solve_bvp", zorder=5)


def targets(special: bool) -> list[tuple[str, str]]:
    """Scene and branch of each panel: those with special points, or with states at a load."""

    def wanted(target: Target) -> bool:
        return (target.at is None) == special

    return [
        (scene, branch)
        for scene, branches in TARGETS.items()
        for branch, found in branches.items()
        if any(map(wanted, found)) and (special or scene != "follower")
    ]


def ticks(axes: Axes) -> None:
    """Times as plain numbers, as many as there is room for; one tick for two powers of ten of the error."""
    low, high = axes.get_xlim()
    subs = (1,) if high > 300 * low else (1, 2, 5) if high < 40 * low else (1, 3)
    axes.xaxis.set_major_locator(LogLocator(subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_locator(LogLocator(base=100.0, numticks=12))
    axes.yaxis.set_minor_locator(NullLocator())


def sheet(
    panels: Sequence[tuple[str, Callable[[Axes], None]]],
    path: Path,
    title: str,
    time: str,
    columns: int = COLUMNS,
    known: float = 0.0,
) -> None:
    """Draw error against time in panels side by side, with one scale of the error and one legend below.

    Parameters
    ----------
    panels
        Title of each, and what draws into its axes.
    path
        Picture to write.
    title, time
        Words for all of it, and for the axis of the time.
    columns
        Panels side by side.
    known
        Error below which the references tell nothing, shaded; zero: unknown.
    """
    lines = ceil(len(panels) / columns)
    with matplotlib.rc_context(STYLE | {"font.size": 10.0}):
        figure = Figure(figsize=(WIDE * columns, HIGH * lines + 1.1), dpi=DPI, layout="constrained")
        grid = figure.subplots(lines, columns, squeeze=False, sharey=True)
        entries: dict[str, Any] = {}
        for number, (axes, (name, draw_panel)) in enumerate(zip(grid.ravel(), panels, strict=False)):
            draw_panel(axes)
            axes.set_ylim(LOWEST, 3.0)
            if known:
                axes.axhspan(LOWEST, known, color="0.93", zorder=0, label=UNKNOWN)
            axes.set_title(name, fontsize=11)
            ticks(axes)
            if number % columns == 0:
                axes.set_ylabel("largest relative error")
            axes.set_xlabel(time)
            for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
                entries.setdefault(label, handle)
        for axes in grid.ravel()[len(panels) :]:
            axes.set_axis_off()
        for label, style in (
            ("hollow: pointwise formulation", {"marker": "o", "ms": 5.0}),
            ("the paper's: 150 linear elements", {"marker": "*", "ms": 13}),
        ):
            entries[label] = matplotlib.lines.Line2D([], [], ls="none", mfc="white", mec="0.2", **style)
        last = (UNKNOWN, "the paper", "hollow", "scipy", HALF, "AUTO")
        order = sorted(entries, key=lambda label: [x in label for x in last])
        figure.suptitle(f"{title} (better: further down, and to the left)", fontsize=13)
        empty = lines * columns - len(panels)
        handles = [entries[label] for label in order]
        if empty:
            grid.ravel()[-1].legend(handles, order, loc="center", fontsize=10, frameon=False)
        else:
            legend_below(figure, handles, order, columns=columns + 1)
        figure.savefig(path)


def legend_below(figure: Figure, handles: Sequence[Any], labels: Sequence[str], columns: int) -> None:
    """One legend for all panels in the room that it needs below them; ``handles`` and ``labels`` are its entries."""
    room = LINE * (ceil(len(labels) / columns) + 0.5) / figure.get_size_inches()[1]
    figure.get_layout_engine().set(rect=(0, room, 1, 1 - room))
    figure.legend(handles, labels, loc="lower center", ncols=columns, fontsize=10, frameon=False)


def work_precision(page: Page, path: Path, special: bool, known: float) -> None:
    """Largest error of a branch's targets against the time of the branch, or of a point of it."""
    found = rows_of(page, "All branches", "scene")

    def panel(scene: str, branch: str) -> Callable[[Axes], None]:
        def draw_panel(axes: Axes) -> None:
            mine = [r for r in found if r[:2] == [scene, branch] and r[5]]
            series(axes, [(r[2], float(r[9 if special else 7]), float(r[5])) for r in mine])
            others(axes, page, scene, branch, special)

        return draw_panel

    panels = [(f"{scene}: {branch}", panel(scene, branch)) for scene, branch in targets(special)]
    if special:
        sheet(panels, path, "A whole branch, its special points located", "milliseconds for the branch", known=known)
    else:
        sheet(
            panels, path, "Following a branch, with the index of every point", "milliseconds for a point", known=known
        )


def eigenvalues(page: Page, path: Path) -> None:
    """Error of the left-most eigenvalues against the time of one judgement."""
    found = rows_of(page, "Eigenvalues", *JUDGED)

    def panel(name: str) -> Callable[[Axes], None]:
        return lambda axes: series(axes, [(r[1], float(r[4]), float(r[3])) for r in found if r[0] == name])

    panels = [(name, panel(name)) for name in dict.fromkeys(r[0] for r in found)]
    sheet(panels, path, "Left-most eigenvalues of a straight rod", "milliseconds for one judgement", columns=2)


def growth(page: Page, path: Path) -> None:
    """Time and memory against the number of unknowns."""
    rows = [r for r in rows_of(page, "Growth", "state") if not r[2].startswith("**")]
    with matplotlib.rc_context(STYLE | {"font.size": 10.0}):
        figure = Figure(figsize=(WIDE * COLUMNS, HIGH + 1.0), dpi=DPI, layout="constrained")
        panels = figure.subplots(1, 3)
        for axes, column, words in zip(
            panels, (4, 6, 7), ("seconds for an equilibrium", "seconds for an index", "memory in MB"), strict=True
        ):
            for formulation, colour in ((REDUCED, "#0072b2"), ("pointwise", "#d55e00")):
                for state, mark in (("straight", "o-"), ("buckled", "s--")):
                    found = [(float(r[2]), float(r[column])) for r in rows if r[:2] == [state, formulation]]
                    if found:
                        label = f"{state}, {formulation}"
                        axes.loglog(*zip(*sorted(found), strict=True), mark, color=colour, ms=5, lw=1.6, label=label)
            low = min(float(r[2]) for r in rows), max(float(r[2]) for r in rows)
            level = min(float(r[column]) for r in rows if float(r[2]) == low[1]) / low[1] / 2.5
            ends = [10.0 * low[0], low[1]]
            axes.loglog(ends, [level * n for n in ends], color="0.6", lw=1.0, label="proportional to the unknowns")
            axes.set(xlabel="unknowns", ylabel=words)
        figure.suptitle("Cost against the size of the problem", fontsize=13)
        legend_below(figure, *panels[0].get_legend_handles_labels(), columns=5)
        figure.savefig(path)


def draw(path: Path) -> list[Path]:
    """Draw what a page has tables for, beside it; returns the pictures."""
    text, drawn = path.read_text(), []
    page, said = read(text), re.search(KNOWN, text)
    known = float(said[1]) if said else 0.0
    for key, section, head, make in (
        ("equilibria", "All branches", ("scene",), lambda to: work_precision(page, to, False, known)),
        ("special", "All branches", ("scene",), lambda to: work_precision(page, to, True, known)),
        ("eigenvalues", "Eigenvalues", JUDGED, lambda to: eigenvalues(page, to)),
        ("growth", "Growth", ("state",), lambda to: growth(page, to)),
    ):
        if rows_of(page, section, *head):
            make(path.with_name(FIGURES[key]))
            drawn.append(path.with_name(FIGURES[key]))
    return drawn

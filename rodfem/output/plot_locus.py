"""Stability boundaries in a plane of two parameters, drawn from the saved data of loci alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from rodfem.continuation.kinds import BRANCH_POINT, CROSSES, KINDS, USER
from rodfem.file_format import LOCUS
from rodfem.output.style import FONT, HALO, PALETTE, STYLE, axis_name, explain, save, sheet
from rodfem.output.words import mesh_in_words, rounded_up
from rodfem.tolerances import ROUND_OFF, TINY

Floats = NDArray[np.float64]
Locus = Mapping[str, Any]

LINES = {name: (PALETTE[kind.line[0]], kind.line[1]) for name, kind in KINDS.items() if kind.line is not None}
"""Colour and dashes by kind."""
OPEN: dict[str, Any] = {"mfc": "white", "mec": "black", "mew": 1.4}
POINTS: dict[str, dict[str, Any]] = {
    "start": {**USER.marker, "label": "start"},
    "turns": {**OPEN, "marker": "|", "ms": 9.0, "label": "turning point"},
    "cusp": {**OPEN, "marker": "^", "ms": 7.5, "label": "cusp"},
    "pitchfork": {**OPEN, "marker": "s", "ms": 6.0, "label": "pitchfork changes its kind"},
    "ends": {**OPEN, "marker": "o", "ms": 6.5, "label": "fold meets branch point"},
}
"""Markers of rows by the first word of what happens there."""


def draw_locus(loci: Sequence[Locus], path: Path) -> Path:
    """Draw loci of one scene, contents of their files, in the plane of their two parameters; the load is upwards.

    Next to each curve stand the indices on its two sides where they were counted, as ``0|1``.  The stable side of a
    curve is shaded as far as the next curve, or the bound of the load: as far as these curves tell.  Returns ``path``;
    raises :class:`InputError` for another format of file, and :class:`ValueError` for loci of different parameters, or
    none.
    """
    if len({tuple(one["parameters"]) for one in loci}) != 1:
        raise ValueError("There is no locus, or they are of different parameters: give one, or draw them apart.")
    for one in loci:
        LOCUS.check(one, "The locus", ("parameters", "columns", "marks", "start", "labels", "discretization"))
    with matplotlib.rc_context(STYLE):
        figure, axes = sheet(loci[0]["title"], _subtitle(loci))
        axes.margins(0.04, 0.12)
        for one in loci:
            _draw_curve(axes, one, loci)
        words, units = (loci[0].get(name, ("", "")) for name in ("words", "units"))
        load, other = (axis_name(*axis) for axis in zip(words, loci[0]["labels"], units, strict=True))
        axes.set_xlabel(other, fontsize=FONT + 1)
        axes.set_ylabel(load, fontsize=FONT + 1)
        known = any(pair[0] >= 0 for one in loci for pair in one["columns"]["index"])
        look = {"ls": "none", "marker": r"$\mathbf{i|j}$", "ms": 13, "mfc": "0.3", "mec": "none"}
        index = Line2D([], [], label=f"index{plane_of(loci[0])} on the two sides", **look)
        explain(axes, [*axes.get_lines(), *axes.collections, *[index] * known])
        for one in loci:
            _write_indices(axes, one)
    return save(figure, path)


def _draw_curve(axes: Axes, one: Locus, loci: Sequence[Locus]) -> None:
    """Draw a curve with the marks of its rows and its stable side."""
    if region := stable_region(one, loci):
        axes.fill_between(*region, color="#CDE9DF", lw=0, zorder=-1, label=in_words(one))
    (x, y), (colour, dashes) = _curve(one), LINES[one["kind"]]
    axes.plot(x, y, color=colour, linestyle=dashes, linewidth=2.2, label=one["kind"])
    for row, what in [(one["start"], "start"), *((m["row"], m["kind"]) for m in one["marks"])]:
        if look := POINTS.get("ends" if BRANCH_POINT in what else what.split()[0]):
            axes.plot(x[row], y[row], linestyle="none", zorder=5, path_effects=HALO, **look)


def _write_indices(axes: Axes, one: Locus) -> None:
    """Write the indices on both sides of a curve, within its middle half and as far as may be from its marks."""
    rows = np.column_stack(_curve(one))
    places, edge = axes.transData.transform(rows), len(rows) // 4
    apart = np.linalg.norm(places[:, None] - places[[one["start"], *(m["row"] for m in one["marks"])]], axis=2)
    row = edge + int(apart.min(axis=1)[edge : len(rows) - edge].argmax())
    if (index := one["columns"]["index"][row])[0] < 0:
        return
    tangent = places[min(row + 1, len(places) - 1)] - places[max(row - 1, 0)]
    normal = np.array([-tangent[1], tangent[0]]) / max(np.hypot(*tangent), TINY)
    away = np.array([16.5, 11.0]) * normal * (-1.0 if normal[1] < 0.0 else 1.0)  # in points
    look = {"weight": "bold", "ha": "center", "va": "center", "zorder": 6, "path_effects": HALO}
    colour = LINES[one["kind"]][0]
    axes.annotate("{}|{}".format(*index), tuple(rows[row]), away, textcoords="offset points", color=colour, **look)


def _subtitle(loci: Sequence[Locus]) -> str:
    """Return the line that names the discretisation and the estimated error, and at how many points it was."""
    errors = [max(e) for one in loci for e in one["columns"]["error"] if e[0] is not None]
    text = mesh_in_words(loci[0]["discretization"])
    points = sum(len(one["columns"]["error"]) for one in loci)
    failed = sum(len(one.get("without_estimate", [])) for one in loci)
    if errors:
        text += f"; curves accurate to {rounded_up(max(errors)):.0e} (estimated at {len(errors)} of {points} points"
        text += f", without success at {failed} more)" if failed else ")"
    elif failed:
        text += f"; the error could not be estimated at any of {failed} points"
    return text


# --- where an equilibrium is stable, as far as loci tell


class StableRegion(NamedTuple):
    """Between two loads at each value of the second parameter, all (k,): the locus, and what bounds its stable side."""

    other: Floats
    edge: Floats
    end: Floats


def stable_region(one: Locus, loci: Sequence[Locus]) -> StableRegion | None:
    """Return what lies between the stable side of a locus of branch points and the next locus, or the load's bound."""
    x, y = _curve(one)
    side, crossed = one.get("lower"), CROSSES in [mark["kind"] for mark in one["marks"]]
    monotone = abs(np.sign(np.diff(x)).sum()) == len(x) - 1
    if crossed or not side or not monotone or any(next(zip(*one["columns"]["index"], strict=True))):
        return None
    order, grid = np.argsort(x), np.linspace(x.min(), x.max(), 400)
    edge = np.interp(grid, x[order], y[order])
    end = np.full(len(grid), float(one["bounds"][0][int(side > 0)]))
    for level in (level for another in loci if another is not one for level in _levels(*_curve(another), grid)):
        end = np.where((side * (level - edge) > ROUND_OFF * abs(edge)) & (side * (level - end) < 0), level, end)
    return StableRegion(grid, edge, end)


def _levels(x: Floats, y: Floats, grid: Floats) -> Iterator[Floats]:
    """Loads (len(grid),) at which each segment of a locus has these values of the second parameter; nan where none."""
    for i in np.flatnonzero(np.diff(x) != 0):
        share = (grid - x[i]) / (x[i + 1] - x[i])
        yield np.where((share >= 0) & (share <= 1), y[i] + share * (y[i + 1] - y[i]), np.nan)


def _curve(one: Locus) -> tuple[Floats, Floats]:
    """Second parameter and load of all rows of a locus."""
    x, y = (np.asarray(one["columns"][name], dtype=float) for name in reversed(one["parameters"]))
    return x, y


def plane_of(one: Locus) -> str:
    """Words after ``stable`` or ``index`` of a locus: of a rod that is kept in a plane it is that in the plane."""
    return " in its plane" if one.get("planar") else ""


def in_words(one: Locus) -> str:
    """What the region of a locus is, for legends."""
    return f"stable{plane_of(one)}, as far as these curves tell"

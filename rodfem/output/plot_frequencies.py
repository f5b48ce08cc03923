"""Frequencies against the load, drawn from ``diagram.json`` alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rodfem.continuation.kinds import DIVERGENCE, FLUTTER, FREQUENCY, KINDS
from rodfem.file_format import DIAGRAM
from rodfem.output.intervals import intervals_of
from rodfem.output.plot_pieces import STABLE
from rodfem.output.sheet import DPI, HALO, PALETTE, SIZE, STYLE, at_most, axis_label, mesh_in_words, save

COLORS = {"bending about d1": 1, "bending about d2": 2, "torsion": 3, "bending": 4, "mixed": 5, "rigid motion": 6}
"""Places in the palette."""
SPECIAL = {name: kind.marker for name, kind in KINDS.items() if kind.test == FREQUENCY}
"""Markers of the special points of a sweep."""
WIDTH, EVERY = 1.8, 0.03
"""Width of the line of a real frequency; distance of the marks of others, over the diagonal of the axes."""
RANGES = ("#E9E4F3", "#FBE6D9")
"""Shades of ranges of divergence, and of those of flutter."""
REAL = 1e-6
"""An imaginary part smaller than this is none, relative to the root."""


@dataclass(frozen=True)
class _Curve:
    """A curve of frequencies: loads and roots with non-negative real part (n,), and the motion that it is named after.

    A conjugate pair is two curves, of which one has its roots left out.
    """

    motion: str
    loads: np.ndarray
    roots: np.ndarray

    def where(self, chosen: np.ndarray, values: np.ndarray) -> np.ndarray:
        """``values`` with nan where they are not ``chosen``: lines are interrupted there."""
        return np.where(chosen, values, np.nan)


def curves(columns: Mapping[str, Any]) -> list[_Curve]:
    """All curves of frequencies of a branch, those of one motion together; its most frequent one names a curve."""
    rows: dict[int, list[tuple[float, complex, str]]] = {}
    for load, pairs, motions, numbers in zip(
        columns["load"], columns["omega2"], columns["motion"], columns["curve"], strict=True
    ):
        for pair, motion, number in zip(pairs, motions, numbers, strict=True):
            rows.setdefault(number, []).append((load, complex(*pair) ** 0.5, motion))
    out = []
    for members in rows.values():
        members.sort(key=lambda row: row[0])
        (motion, _), *_ = Counter(row[2] for row in members).most_common()
        out.append(_Curve(motion, np.array([row[0] for row in members]), np.array([row[1] for row in members])))
    return sorted(out, key=lambda curve: (curve.motion, abs(curve.roots[0])))


def draw_frequencies(diagram: Mapping[str, Any], path: Path, most: int = 3) -> Path:
    """Draw the square roots of the left-most eigenvalues against the load, as in Kumar & Healey (2010), figure 11.

    One line a curve, one colour a kind of motion: eigenvalues that are double are two lines on each other, of one
    colour.  Real frequencies are lines, a complex pair is a cross (real part) and a plus (imaginary part), what has
    diverged is a plus; flutter loads are stars, divergence loads triangles, and unstable ranges are shaded.  The axis
    shows the ``most`` left-most eigenvalues; all are nondimensional.  Returns ``path``; raises ValueError without any
    ``omega2``, and InputError for contents of another or a newer format.
    """
    return save(figure_of(diagram, most), path)


def figure_of(diagram: Mapping[str, Any], most: int = 3) -> Figure:
    """Figure of the frequencies, as :func:`draw_frequencies` writes it; raises :class:`ValueError` as that does."""
    DIAGRAM.check(diagram, "The diagram", ("branches",))
    branches = [b for b in diagram["branches"] if b["columns"].get("omega2")]
    if not branches:
        raise ValueError(f"The diagram of {diagram['scene']} has no eigenvalues: run a scene with a follower load.")
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = figure.subplots()
        handles = draw_into(axes, branches, most)
        axes.set_xlabel(axis_label(diagram))
        axes.set_title(str(diagram["title"]))
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=9)
        figure.supxlabel(_footer(diagram, branches), fontsize=8.5, color="0.4", x=0.01, ha="left")
    return figure


def draw_into(axes: Axes, branches: Sequence[Mapping[str, Any]], most: int) -> list[Artist]:
    """Draw the frequencies of branches, up to the ``most`` left-most, in given axes; returns entries of a legend."""
    motions: dict[str, str] = {}
    shown: set[str] = set()
    ranges: dict[str, Patch] = {}
    for branch in branches:
        ranges |= _shade(axes, branch)
        for curve in curves(branch["columns"]):
            motions.setdefault(curve.motion, PALETTE[COLORS.get(curve.motion, 7) % len(PALETTE)])
            shown |= _draw_curve(axes, curve, motions[curve.motion])
        for special in branch["special"]:
            if special["kind"] in SPECIAL:
                _mark(axes, special)
                shown.add(special["kind"])
    axes.set_ylim(0, 1.15 * max(_top(b["columns"], most) for b in branches))
    axes.set_ylabel(r"frequency $\omega$")
    handles: list[Artist] = [Line2D([], [], color=color, lw=WIDTH, label=motion) for motion, color in motions.items()]
    handles += [
        Line2D([], [], color="0.3", marker=marker, ls=style, lw=0.8, label=what)
        for what, (marker, style) in PARTS.items()
        if what in shown
    ]
    handles += [Line2D([], [], ls="none", label=kind, **SPECIAL[kind]) for kind in SPECIAL if kind in shown]
    return handles + list(ranges.values())


PARTS = {
    "complex pair, real part": ("x", "-"),
    "complex pair, imaginary part": ("+", "--"),
    "diverged, growth rate": ("+", ":"),
}
"""Marker and line of roots that are not real."""


def _draw_curve(axes: Axes, curve: _Curve, color: str) -> set[str]:
    """Draw one curve; returns which :data:`PARTS` it has."""
    w = curve.roots
    straight, lower = abs(w.imag) <= REAL * abs(w), w.imag < -REAL * abs(w)
    sideways = (w.real <= REAL * abs(w)) & ~straight
    pair = ~straight & ~lower & ~sideways
    axes.plot(curve.loads, curve.where(straight, w.real), "-", color=color, lw=WIDTH)
    values = (pair, w.real), (pair, w.imag), (sideways, abs(w.imag))
    for (chosen, part), (marker, style) in zip(values, PARTS.values(), strict=True):
        if chosen.any():
            axes.plot(
                curve.loads, curve.where(chosen, part), marker + style, color=color, ms=4, lw=0.8, markevery=EVERY
            )
    return {what for what, (chosen, _) in zip(PARTS, values, strict=True) if chosen.any()}


def _shade(axes: Axes, branch: Mapping[str, Any]) -> dict[str, Patch]:
    """Shade the ranges of the load in which a branch is unstable; returns them by the words of the legend."""
    out, columns = {}, branch["columns"]
    for interval in intervals_of(branch):
        if interval.kind == STABLE:
            continue
        values = [complex(*v) for row in columns["omega2"][interval.first : interval.last + 1] for v in row]
        real = [v.real for v in values if abs(v.imag) <= REAL * abs(v)]
        least = REAL * max(map(abs, values))
        found = {FLUTTER: len(real) < len(values), DIVERGENCE: any(x < -least for x in real)}
        words = "range of " + (" and ".join(kind for kind, there in found.items() if there) or "instability")
        shade = RANGES[found[FLUTTER]]
        out[words] = Patch(color=shade, label=words)
        axes.axvspan(*interval.covers, color=shade, zorder=0, lw=0)
    return out


def _mark(axes: Axes, special: Mapping[str, Any]) -> None:
    """Mark a flutter or divergence load, and write it beside: of divergence above the axis, where its frequency is."""
    omega = abs(complex(special["omega2"])) ** 0.5
    axes.plot(special["load"], omega, ls="none", zorder=5, clip_on=False, **SPECIAL[special["kind"]])
    place = (8, -16) if special["kind"] == FLUTTER and omega else (0, 14)
    text = axes.annotate(f"{special['load']:.6g}", (special["load"], omega), place, textcoords="offset points")
    text.set(path_effects=HALO, ha="left" if place[0] else "center", zorder=6)


def _top(columns: Mapping[str, Any], most: int) -> float:
    """Greatest imaginary part of all roots, and real part of the ``most`` left-most, at any load."""
    top = 1e-3
    for pairs in columns["omega2"]:
        roots = [complex(*pair) ** 0.5 for pair in pairs]  # in ascending order of the real parts of the squares
        top = max([top, *(w.imag for w in roots), *(w.real for w in roots[:most])])
    return top


def _footer(diagram: Mapping[str, Any], branches: list[Mapping[str, Any]]) -> str:
    """Discretisation, and the greatest bound of the errors of the special loads."""
    text = mesh_in_words(diagram["discretization"])
    found = [s for b in branches for s in b["special"] if s["kind"] in SPECIAL and s["error_estimate"] is not None]
    if found:
        kinds = " and ".join(kind for kind in SPECIAL if any(s["kind"] == kind for s in found))
        text += f"; error of {kinds} loads at most {at_most(max(s['error_estimate'] for s in found))}"
    return text

"""Frequencies against the load, drawn from ``diagram.json`` alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rodfem.continuation.kinds import FREQUENCY, KINDS
from rodfem.file_format import DIAGRAM
from rodfem.output.frequency_curves import DIVERGED, GROWTH, PAIR, FrequencyCurve, curves, ranges_of, top
from rodfem.output.style import HALO, STYLE, at_most, axis_label, explain, mesh_in_words, save, sheet

SPECIAL = {name: kind.marker for name, kind in KINDS.items() if kind.test == FREQUENCY}
"""Markers of the special points of a sweep."""
WIDTH = 1.8
"""Width of the line of a real frequency."""


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
        figure, axes = sheet(str(diagram["title"]), _about(diagram, branches))
        handles = draw_into(axes, branches, most)
        axes.set_xlabel(axis_label(diagram))
        explain(axes, handles)
    return figure


PARTS = dict(zip((PAIR, GROWTH, DIVERGED), (("x", "-"), ("+", "--"), ("+", ":")), strict=True))
"""Marker and line of roots that are not real."""


def draw_into(axes: Axes, branches: Sequence[Mapping[str, Any]], most: int) -> list[Artist]:
    """Draw the frequencies of branches, up to the ``most`` left-most, in given axes; returns entries of a legend."""
    motions, shown, ranges = dict[str, str](), set[str](), dict[str, Artist]()
    axes.set(ylim=(0, 1.15 * max(top(b, most) for b in branches)), ylabel=r"frequency $\omega$")
    for branch in branches:
        for found in ranges_of(branch):
            axes.axvspan(found.low, found.high, color=found.shade, zorder=0, lw=0)
            ranges[found.words] = Patch(color=found.shade, label=found.words)
        for curve in curves(branch["columns"], branch["special"]):
            shown |= _draw_curve(axes, curve, motions.setdefault(curve.motion, curve.colour))
        shown |= _marked(axes, branch["special"])
    lines = [Line2D([], [], color=color, lw=WIDTH, label=motion) for motion, color in motions.items()]
    return [*lines, *(Line2D([], [], **ENTRIES[what]) for what in ENTRIES if what in shown), *ranges.values()]


ENTRIES: dict[str, dict[str, Any]] = {
    what: {"color": "0.3", "marker": marker, "ls": style, "lw": 0.8, "label": what}
    for what, (marker, style) in PARTS.items()
} | {kind: {"ls": "none", "label": kind, **style} for kind, style in SPECIAL.items()}
"""Entries of the legend for what is not a line."""


def _draw_curve(axes: Axes, curve: FrequencyCurve, color: str) -> set[str]:
    """Draw one curve; returns which :data:`PARTS` it has."""
    axes.plot(curve.loads, curve.real, "-", color=color, lw=WIDTH)
    drawn = set()
    for (what, part), (marker, style) in zip(curve.parts.items(), PARTS.values(), strict=True):
        if not np.isnan(part).all():
            axes.plot(curve.loads, part, marker + style, color=color, ms=4, lw=0.8, markevery=0.03)
            drawn.add(what)
    return drawn


def _marked(axes: Axes, specials: Sequence[Mapping[str, Any]]) -> set[str]:
    """Mark flutter and divergence loads, and write them beside: of divergence above the axis, where its frequency is.

    Returns their kinds.
    """
    found = [special for special in specials if special["kind"] in SPECIAL]
    for special in found:
        here = float(special["load"]), abs(complex(special["omega2"])) ** 0.5
        axes.plot(*here, ls="none", zorder=5, clip_on=False, **SPECIAL[special["kind"]])
        place = (8.0, 6.0) if here[1] else (0.0, 14.0)
        text = axes.annotate(f"{special['load']:.6g}", here, place, textcoords="offset points")
        text.set(path_effects=HALO, ha="left" if place[0] else "center", zorder=6)
    return {special["kind"] for special in found}


def _about(diagram: Mapping[str, Any], branches: list[Mapping[str, Any]]) -> str:
    """Discretisation, and the greatest bound of the errors of the special loads."""
    text = mesh_in_words(diagram["discretization"])
    found = [s for b in branches for s in b["special"] if s["kind"] in SPECIAL and s["error_estimate"] is not None]
    if found:
        kinds = " and ".join(kind for kind in SPECIAL if any(s["kind"] == kind for s in found))
        text += f"; error of {kinds} loads at most {at_most(max(s['error_estimate'] for s in found))}"
    return text

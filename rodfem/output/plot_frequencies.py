"""Frequencies against the load, drawn from ``diagram.json`` alone: curves of roots, and ranges that are unstable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from rodfem.continuation.kinds import DIVERGENCE, FLUTTER, FREQUENCY, KINDS
from rodfem.modes.modes import RIGID
from rodfem.output.pieces import Interval, intervals_of
from rodfem.output.style import PALETTE, STYLE, axis_label, explain, save, sheet
from rodfem.output.words import greatest_error, mesh_in_words
from rodfem.stability.soft_mode import STABLE

Member = tuple[float, int, complex, str]  # load, row, eigenvalue and motion of a point of a curve
SPECIAL = {name: kind.marker for name, kind in KINDS.items() if kind.test == FREQUENCY}
"""Markers of the special points of a sweep."""
COLORS = {"bending about d1": 1, "bending about d2": 2, "torsion": 3, "bending": 4, "mixed": 5, "rigid motion": 6}
"""Places in the palette."""
RANGES = ("#E9E4F3", "#FBE6D9", "#F3D3C6")
"""Shades of ranges of divergence, of flutter, and of both."""
REAL = 1e-6  # an imaginary part smaller than this, relative to the root, is round-off
LEAST = 1e-3  # least frequency at the top of a picture
PARTS = {
    "complex pair, real part": ("x", "-"),
    "complex pair, imaginary part": ("+", "--"),
    "diverged, growth rate": ("+", ":"),
}
"""Marker and line of roots that are not real."""


def draw_frequencies(diagram: Mapping[str, Any], path: Path) -> Path:
    """Draw the square roots of the left-most eigenvalues against the load, as in Kumar & Healey (2010), figure 11."""
    return save(figure_of(diagram), path)


def figure_of(diagram: Mapping[str, Any], given: Axes | None = None) -> Figure:
    """Figure of the frequencies, as :func:`draw_frequencies` writes it, or that of axes that are ``given``."""
    branches = [b for b in diagram["branches"] if b["columns"].get("omega2")]
    error = greatest_error("critical loads", [s for b in branches for s in b["special"] if s["kind"] in SPECIAL])
    about = "; ".join(filter(None, [mesh_in_words(diagram["discretization"]), error]))
    with matplotlib.rc_context(STYLE):
        figure, axes = sheet(str(diagram["title"]), about, given)
        handles = draw_into(axes, branches)
        axes.set_xlabel(axis_label(diagram))
        explain(axes, handles)
    return figure


def draw_into(axes: Axes, branches: Sequence[Mapping[str, Any]]) -> list[Artist]:
    """Draw the frequencies of branches, in given axes; returns entries of a legend."""
    motions, shown, ranges = dict[str, str](), set[str](), dict[str, Artist]()
    axes.set(ylim=(0, 1.15 * max(top(b) for b in branches)), ylabel=r"frequency $\omega$")
    for branch in branches:
        for found in ranges_of(branch):
            axes.axvspan(found.low, found.high, color=found.shade, zorder=0, lw=0)
            ranges[found.words] = Patch(color=found.shade, label=found.words)
        for curve in curves(branch):
            shown |= _draw_curve(axes, curve, motions.setdefault(curve.motion, curve.colour))
    lines = [Line2D([], [], color=color, lw=1.8, label=motion) for motion, color in motions.items()]
    for what, (marker, line) in PARTS.items():
        lines += [Line2D([], [], color="0.3", marker=marker, ls=line, lw=0.8, label=what)] * (what in shown)
    marks = _marked(axes, [special for branch in branches for special in branch["special"]])
    return [*lines, *marks, *ranges.values()]


def _draw_curve(axes: Axes, curve: FrequencyCurve, color: str) -> set[str]:
    """Draw one curve; returns which :data:`PARTS` it has."""
    axes.plot(curve.loads, curve.real, "-", color=color, lw=1.8)
    parts = {what: part for what, part in curve.parts.items() if not np.isnan(part).all()}
    for what, part in parts.items():
        axes.plot(curve.loads, part, "".join(PARTS[what]), color=color, ms=4, lw=0.8, markevery=0.03)
    return {*parts}


def _marked(axes: Axes, specials: Sequence[Mapping[str, Any]]) -> Iterator[Line2D]:
    """Mark flutter and divergence loads, with their values in the legend."""
    for kind, look in SPECIAL.items():
        if found := [special for special in specials if special["kind"] == kind]:
            places = [(special["load"], abs(complex(special["omega2"])) ** 0.5) for special in found]
            words = f"{kind} at {', '.join(f'{load:.6g}' for load, _ in places)}"
            yield from axes.plot(*np.transpose(places), ls="none", zorder=5, clip_on=False, label=words, **look)


# --- curves and ranges


@dataclass(frozen=True)
class FrequencyCurve:
    """A curve of frequencies, named by its ``motion``: ``loads``, ``rows`` of the branch and ``roots``, all (n,)."""

    motion: str
    loads: NDArray[np.float64]
    rows: NDArray[np.int64]
    roots: NDArray[np.complex128]

    @property
    def colour(self) -> str:
        """Colour of the motion."""
        return PALETTE[COLORS.get(self.motion, 7) % len(PALETTE)]

    @property
    def real(self) -> NDArray[np.float64]:
        """Real frequencies (n,), nan where there is none."""
        return np.where(abs(self.roots.imag) <= REAL * abs(self.roots), self.roots.real, np.nan)

    @property
    def parts(self) -> dict[str, NDArray[np.float64]]:
        """Real and imaginary part of a complex pair, and growth rate of what has diverged, (n,), nan where none is."""
        w, least = self.roots, REAL * abs(self.roots)
        sideways = (w.real <= least) & (abs(w.imag) > least)
        pair = (w.imag > least) & ~sideways
        values = ((pair, w.real), (pair, w.imag), (sideways, abs(w.imag)))
        return {what: np.where(there, part, np.nan) for what, (there, part) in zip(PARTS, values, strict=True)}


class Range(NamedTuple):
    """An unstable range of the load, from ``low`` to ``high``, in ``words`` and in its ``shade``."""

    low: float
    high: float
    words: str
    shade: str


def root(mu: Any, rates: bool) -> Any:
    """Frequency ``w`` of motions ``exp(i w t)``, of a positive real part; of ``rates`` without their decay.

    Of a pair of conjugate rates, whose motions are one, the second has none.
    """
    if not rates:
        return np.sqrt(mu)
    mu = np.asarray(mu)
    return np.where(mu.imag < 0.0, complex(np.nan, np.nan), mu.imag + 1j * np.maximum(-mu.real, 0.0))


def curves(branch: Mapping[str, Any]) -> list[FrequencyCurve]:
    """All curves of frequencies of a branch, those of one motion together; its most frequent one names a curve."""
    found: dict[int, list[Member]] = {}
    rows = zip(*(branch["columns"][name] for name in ("load", "omega2", "motion", "curve")), strict=True)
    for row, (load, *modes) in enumerate(rows):
        for pair, motion, number in zip(*modes, strict=True):
            mu = 0j if motion == RIGID else complex(*pair)  # what the file has is round-off
            found.setdefault(number, []).append((load, row, mu, motion))
    out = []
    for members in found.values():
        loads, places, values, motions = zip(*sorted(members, key=lambda x: x[0]), strict=True)
        roots = root(np.array(values, dtype=np.complex128), bool(branch.get("rates")))
        out.append(FrequencyCurve(Counter(motions).most_common(1)[0][0], np.array(loads), np.array(places), roots))
    return sorted(out, key=lambda curve: (curve.motion, np.nan_to_num(abs(curve.roots[0]))))


def ranges_of(branch: Mapping[str, Any]) -> Iterator[Range]:
    """Ranges of the load in which a branch is unstable in one way."""
    for interval in (interval for interval in intervals_of(branch) if interval.kind != STABLE):
        for kind, group in groupby(enumerate(_unstable(interval), interval.first), lambda step: step[1]):
            places = [row for row, _ in group]
            ends = [branch["columns"]["load"][row] for row in (places[0], places[-1] + 1)]
            words = " and ".join(sorted(kind, reverse=True)) or "instability"
            yield Range(min(ends), max(ends), f"range of {words}", RANGES[2 if len(kind) > 1 else FLUTTER in kind])


def _unstable(interval: Interval) -> list[frozenset[str]]:
    """Kinds of instability in each step: of either end, as at critical loads eigenvalues are still real, or zero."""
    rows = interval.branch["columns"]["omega2"][interval.first : interval.last + 1]
    values = [[complex(*v) for v in row] for row in rows]
    least, kinds = REAL * max(abs(v) for row in values for v in row), []
    bound = (np.inf, -least)[bool(interval.branch.get("rates"))]
    for row in values:
        mu = np.array(row)
        oscillates = abs(mu.imag) > REAL * abs(mu)
        flutter, divergence = (oscillates & (mu.real < bound)).any(), (~oscillates & (mu.real < -least)).any()
        kinds.append(frozenset([FLUTTER] * int(flutter) + [DIVERGENCE] * int(divergence)))
    return [a | b for a, b in pairwise(kinds)]


def top(branch: Mapping[str, Any]) -> float:
    """Greatest of critical frequencies, imaginary parts of all roots, and real parts of the three left-most ones."""
    highest = LEAST
    for pairs in branch["columns"]["omega2"]:
        # in ascending order of the real parts of the squares
        roots = np.nan_to_num(root(np.array([complex(*pair) for pair in pairs]), bool(branch.get("rates"))))
        highest = max([highest, *roots.imag.tolist(), *roots[:3].real.tolist()])
    critical = [abs(complex(s["omega2"])) ** 0.5 for s in branch["special"] if s.get("omega2") is not None]
    return max([highest, *critical])

"""Frequencies of a branch of ``diagram.json`` as curves over the load, and the ranges of the load that are unstable.

The eigenvalues ``mu = s +- sqrt(D)`` have a square root at a flutter load; their mean ``s`` and
``D = ((mu1 - mu2)/2)^2`` have none, and are parabolas through two rows on either side and the flutter load itself,
where ``D = 0``.  So curves have points between the rows next to it, where a chord would show a corner.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rodfem.continuation.kinds import DIVERGENCE, FLUTTER
from rodfem.modes.modes import RIGID
from rodfem.output.pieces import STABLE, Interval, intervals_of
from rodfem.output.style import PALETTE

COLORS = {"bending about d1": 1, "bending about d2": 2, "torsion": 3, "bending": 4, "mixed": 5, "rigid motion": 6}
"""Places in the palette."""
RANGES = ("#E9E4F3", "#FBE6D9", "#F3D3C6")
"""Shades of ranges of divergence, of flutter, and of both."""
REAL = 1e-6
"""An imaginary part smaller than this is none, relative to the root."""
PAIR, GROWTH, DIVERGED = "complex pair, real part", "complex pair, imaginary part", "diverged, growth rate"
LEAST = 1e-3
"""Least frequency at the top of a picture; distance of eigenvalues that have met from their mean, relative to it."""
SHARES = np.linspace(0.0, 1.0, 9)[1:-1] ** 2
"""Where the step next to a flutter load has points, in parts of it from there."""
JUST = 1e-5j
"""Imaginary part of a pair that has just met, relative to it: the place where the curve of a pair begins."""

Members = dict[int, list[tuple[float, int, complex, str]]]
"""Load, row, eigenvalue and motion on each curve, by its number."""


@dataclass(frozen=True)
class FrequencyCurve:
    """A curve of frequencies, named by its ``motion``.

    ``loads``, ``rows`` of the branch and ``roots`` with non-negative real part have the shape (n,).
    A conjugate pair is two curves, of which one has its roots left out of ``real`` and ``parts``.
    """

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
        w = self.roots
        straight, lower = abs(w.imag) <= REAL * abs(w), w.imag < -REAL * abs(w)
        sideways = (w.real <= REAL * abs(w)) & ~straight
        pair = ~straight & ~lower & ~sideways
        values = (pair, w.real), (pair, w.imag), (sideways, abs(w.imag))
        named = zip((PAIR, GROWTH, DIVERGED), values, strict=True)
        return {what: np.where(chosen, part, np.nan) for what, (chosen, part) in named}


class Range(NamedTuple):
    """An unstable range of the load, from ``low`` to ``high``, in ``words`` and in its ``shade``."""

    low: float
    high: float
    words: str
    shade: str


def curves(columns: Mapping[str, Any], special: Sequence[Mapping[str, Any]] = ()) -> list[FrequencyCurve]:
    """All curves of frequencies of a branch, those of one motion together; its most frequent one names a curve.

    With its ``special`` points curves have points between rows where two frequencies meet.
    """
    found = _members(columns)
    met = [point for point in special if point["kind"] == FLUTTER and point.get("omega2") is not None]
    for point in met:
        for number, extra in _beside(columns["load"], found, point, {p["row"] for p in met}).items():
            found[number] = [member for member in found[number] if member[0] != extra[0][0]] + extra
    return sorted(map(_curve, found.values()), key=lambda curve: (curve.motion, abs(curve.roots[0])))


def _members(columns: Mapping[str, Any]) -> Members:
    found: Members = {}
    each = (columns[name] for name in ("load", "omega2", "motion", "curve"))
    for row, (load, *modes) in enumerate(zip(*each, strict=True)):
        for pair, motion, number in zip(*modes, strict=True):
            mu = 0j if motion == RIGID else complex(*pair)  # what the file has is round-off
            found.setdefault(number, []).append((load, row, mu, motion))
    return found


def _curve(members: list[tuple[float, int, complex, str]]) -> FrequencyCurve:
    loads, rows, values, motions = zip(*sorted(members, key=lambda member: member[0]), strict=True)
    motion = Counter(motions).most_common(1)[0][0]
    return FrequencyCurve(motion, np.array(loads), np.array(rows), np.sqrt(np.array(values, dtype=np.complex128)))


def _beside(loads: Sequence[float], known: Members, point: Mapping[str, Any], others: set[int]) -> Members:
    """Points beside one flutter load, that of the load itself first; ``others`` are the rows of all of them."""
    row, mean = int(point["row"]), float(point["omega2"])
    at = {number: {i: mu for _, i, mu, _ in members} for number, members in known.items()}
    met = [number for number in at if abs(at[number].get(row, np.inf) - mean) <= LEAST * abs(mean)]
    found = {number: [(loads[row], row, complex(mean))] for number in met}
    for rows in ((row, row - 1, row - 2), (row, row + 1, row + 2)):
        values = np.array([[mean] * len(met), *(_at(at, met, i) for i in rows[1:] if i not in others)])
        if len(met) in (2, 4) and len(values) == len(rows) and np.isfinite(values).all():
            for places, extra in zip(found.values(), _side(loads, rows, values), strict=True):
                places += extra
    return {number: [(*place, known[number][-1][3]) for place in places] for number, places in found.items()}


def _at(values: Mapping[int, Mapping[int, complex]], numbers: Sequence[int], row: int) -> list[complex]:
    """Eigenvalues of a row on the curves of these numbers, nan where there is none."""
    return [values[number].get(row, complex(np.nan)) for number in numbers]


def _side(loads: Sequence[float], rows: tuple[int, int, int], mu: Any) -> list[list[tuple[float, int, complex]]]:
    """Points between the first two ``rows`` of each eigenvalue that has met others in the first: ``mu`` (3, n)."""
    t = np.array([loads[i] - loads[rows[0]] for i in rows])
    centre = mu.mean(axis=1)
    mid, discriminant = (np.polyfit(t, x.real, 2) for x in (centre, ((mu - centre[:, None]) ** 2).mean(axis=1)))
    x, away = SHARES * t[1], mu[1] - centre[1].real
    signs = np.where(abs(away.imag) > abs(away.real), np.sign(away.imag), np.sign(away.real))
    near = np.where(SHARES > 0.5, rows[1], rows[0])
    root = np.polyval(discriminant, x).astype(complex) ** 0.5
    out = [list(zip(loads[rows[0]] + x, near, np.polyval(mid, x) + sign * root, strict=True)) for sign in signs]
    if abs(away.imag).max() > abs(away.real).max():
        first = float(np.nextafter(loads[rows[0]], loads[rows[1]]))
        out = [[(first, rows[0], mu[0, 0] * (1 + sign * JUST)), *line] for sign, line in zip(signs, out, strict=True)]
    return out


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
    least = REAL * max(abs(v) for row in values for v in row)
    return [a | b for a, b in pairwise(_kinds(row, least) for row in values)]


def _kinds(values: Sequence[complex], least: float) -> frozenset[str]:
    """Kinds of instability among eigenvalues, of which those below ``least`` are zero."""
    flutter = any(abs(v.imag) > REAL * abs(v) for v in values)
    divergence = any(v.real < -least and abs(v.imag) <= REAL * abs(v) for v in values)
    return frozenset([FLUTTER] * flutter + [DIVERGENCE] * divergence)


def top(branch: Mapping[str, Any], most: int) -> float:
    """Greatest of critical frequencies, imaginary parts of all roots, and real parts of the ``most`` left-most ones."""
    highest = LEAST
    for pairs in branch["columns"]["omega2"]:
        roots = [complex(*pair) ** 0.5 for pair in pairs]  # in ascending order of the real parts of the squares
        highest = max([highest, *(w.imag for w in roots), *(w.real for w in roots[:most])])
    critical = [abs(complex(s["omega2"])) ** 0.5 for s in branch["special"] if s.get("omega2") is not None]
    return max([highest, *critical])

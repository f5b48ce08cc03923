r"""Branches between their rows, for pictures: a long step, as the first one from a branch point, would show as a chord.

Files have the arclength ``s`` of each row and the slope ``dP/ds`` of its load.  The load is the cubic Hermite spline of
both: at a pitchfork ``P_0 + c s^2``, as it is there.  The slopes of other columns are not known: they are cubic splines
with two continuous derivatives, from corner to corner.  Rows are as computed: pictures alone have what is in between,
and only where it differs from the chord by more than a line's width.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from rodfem.output.pieces import Piece, pieces_of

Floats = NDArray[np.float64]

SHARES = np.linspace(0.0, 1.0, 9)[1:-1]
"""Where a step has points, in parts of its arclength."""
SEEN = 2e-4
"""Distance from the chord above which a step is no straight line, in parts of the branch's range."""
CORNER = 0.5
"""Change of a slope at a row, over the slopes beside it, from which on it is a corner; distance of a curve from the
chord of a step, over the range of its rows, above which it is none."""
ROWS = 3
"""Rows that make a curve."""


def between(branch: Mapping[str, Any], name: str) -> dict[int, Floats]:
    """Loads and values of a column between rows, (7, 2), by the row before, of the steps that are no straight lines.

    ``branch`` is one of ``diagram.json``, ``name`` that of the column.  Empty for a branch of fewer than three rows,
    and of older files, which lack the numbers.
    """
    columns = branch["columns"]
    if not {"slope", "arclength"} <= columns.keys() or len(columns["load"]) < ROWS:
        return {}
    s, slopes, loads, values = (np.array(columns[x], dtype=float) for x in ("arclength", "slope", "load", name))
    if not np.isfinite([s, slopes, loads, values]).all() or (np.diff(s) <= 0).any():
        return {}
    places = s[:-1, None] + SHARES * np.diff(s)[:, None]
    curves = CubicHermiteSpline(s, loads, slopes)(places), _spline(s, values, places)
    seen, smooth = np.zeros(len(places), dtype=bool), np.ones(len(places), dtype=bool)
    for rows, curve in zip((loads, values), curves, strict=True):
        off = abs(curve - rows[:-1, None] - SHARES * np.diff(rows)[:, None]).max(axis=1)
        seen |= off > SEEN * np.ptp(rows)
        smooth &= off <= np.maximum(CORNER * abs(np.diff(rows)), 150 * SEEN * np.ptp(rows))
    return {int(row): np.column_stack([curve[row] for curve in curves]) for row in np.flatnonzero(seen & smooth)}


def _spline(s: Floats, values: Floats, places: Floats) -> Floats:
    """Values at ``places`` (n - 1, k) of each step, by cubic splines from corner to corner."""
    out = np.empty_like(places)
    for a, b in pairwise([0, *_corners(s, values), len(s) - 1]):
        out[a:b] = CubicSpline(s[a : b + 1], values[a : b + 1])(places[a:b])
    return out


def _corners(s: Floats, values: Floats) -> list[int]:
    """Rows at which the slopes of the parabolas through three rows on either side differ: those of a corner."""
    if len(s) <= 2 * ROWS:
        return []
    first = np.diff(values) / np.diff(s)
    bent = np.diff(first) / (s[2:] - s[:-2])
    left, right = first[1:-1] + bent[:-1] * np.diff(s)[1:-1], first[1:-1] - bent[1:] * np.diff(s)[1:-1]
    left, right = left[:-1], right[1:]  # at rows 2, 3, ..., of parabolas that end and begin there
    step = np.minimum(np.diff(s)[1:-2], np.diff(s)[2:-1])
    apart = abs(left - right)
    corner = (apart > CORNER * np.maximum(abs(left), abs(right))) & (apart * step > 50 * SEEN * np.ptp(values))
    return [int(row) + 2 for row in np.flatnonzero(corner)]


def drawn(branch: Mapping[str, Any]) -> list[tuple[Piece, Floats]]:
    """Pieces of a branch, each with its curve (k, 2) of loads and ordinates, with points between rows."""
    rows = np.column_stack([np.asarray(branch["columns"][key], dtype=float) for key in ("load", "ordinate")])
    more, found = between(branch, "ordinate"), []
    for piece in pieces_of(branch):
        parts = [part for i in range(piece.first, piece.last) for part in (rows[i : i + 1], more.get(i, rows[:0]))]
        found.append((piece, np.vstack([*parts, rows[piece.last]])))
    return found

r"""Branches between their rows, for pictures: a long step, as the first one from a branch point, would show as a chord.

Files have the arclength ``s`` of each row and the slope ``dP/ds`` of its load.  The load is the cubic Hermite spline of
both: at a pitchfork ``P_0 + c s^2``, as it is there.  The slopes of other columns are not known; they are the monotone
cubics of Fritsch & Carlson (SIAM J. Numer. Anal. 17, 1980), which pass no value that rows do not.  Rows are as
computed: pictures alone have what is in between, and only where it differs from the chord by more than a line's width.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from rodfem.output.plot_pieces import Piece, pieces_of

Floats = NDArray[np.float64]

SHARES = np.linspace(0.0, 1.0, 9)[1:-1]
"""Where a step has points, in parts of its arclength."""
SEEN, LARGEST = 1e-3, 0.5
"""Distance from the chord above which a step is no straight line, in parts of the branch's range; in parts of the range
of its own step, that above which the rows are no smooth curve."""
EMPTY = np.empty((0, 2))
ROWS = 3
"""Rows that make a curve."""


def between(branch: Mapping[str, Any], name: str) -> dict[int, Floats]:
    """Loads and values of a column between rows, (7, 2), by the row before, of the steps that are no straight lines.

    Parameters
    ----------
    branch
        A branch of ``diagram.json``.
    name
        The column.

    Returns
    -------
    found
        Empty for a branch of fewer than three rows, and of older files, which lack the numbers.
    """
    columns = branch["columns"]
    if not {"slope", "arclength"} <= columns.keys() or len(columns["load"]) < ROWS:
        return {}
    s, slopes, loads, values = (np.array(columns[x], dtype=float) for x in ("arclength", "slope", "load", name))
    if not np.isfinite([s, slopes, loads, values]).all() or (np.diff(s) <= 0).any():
        return {}
    places = s[:-1, None] + SHARES * np.diff(s)[:, None]
    curves = CubicHermiteSpline(s, loads, slopes)(places), PchipInterpolator(s, values)(places)
    seen, smooth = np.zeros(len(places), dtype=bool), np.ones(len(places), dtype=bool)
    for rows, curve in zip((loads, values), curves, strict=True):
        off = abs(curve - rows[:-1, None] - SHARES * np.diff(rows)[:, None]).max(axis=1)
        seen |= off > SEEN * np.ptp(rows)
        smooth &= off <= np.maximum(LARGEST * abs(np.diff(rows)), SEEN * np.ptp(rows))
    return {int(row): np.column_stack([curve[row] for curve in curves]) for row in np.flatnonzero(seen & smooth)}


def drawn_pieces(branch: Mapping[str, Any], colour: str) -> Iterator[Piece]:
    """Pieces of a branch as :func:`~rodfem.output.plot_pieces.pieces_of`, with points between their rows."""
    more, row = between(branch, "ordinate"), 0
    for piece in pieces_of(branch, colour):
        last = row + len(piece.curve) - 1
        parts = [points for i in range(row, last) for points in (piece.curve[[i - row]], more.get(i, EMPTY))]
        yield piece._replace(curve=np.vstack([*parts, piece.curve[-1:]]))
        row = last

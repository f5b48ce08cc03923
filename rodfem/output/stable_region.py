"""Where an equilibrium is stable in the plane of two parameters, as far as the loci of its special points tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rodfem.continuation.kinds import CROSSES

Floats = NDArray[np.float64]

COUNT = 400
"""Values of the second parameter at which a region has its bounds."""
IN_PLANE = " in its plane"
"""After what is said of stability, or of an index, of a rod that is kept in a plane."""


class StableRegion(NamedTuple):
    """Between two loads at each value of the second parameter, all (k,): the locus, and what bounds its stable side."""

    other: Floats
    edge: Floats
    end: Floats


def stable_region(one: Mapping[str, Any], loci: Sequence[Mapping[str, Any]]) -> StableRegion | None:
    """Return what lies between the stable side of a locus of branch points and the next locus, or the load's bound.

    ``one`` is the file of the locus, whose stable side is that on which its index is zero, and ``loci`` are all of the
    plane.  None where neither side is stable all along the locus, as where another one crosses it, where it is not
    known which side is, or where the locus has more than one load at a value of the second parameter.
    """
    columns, (load, other) = one["columns"], one["parameters"]
    x, y = (np.asarray(columns[name], dtype=float) for name in (other, load))
    side, low = one.get("lower"), [pair[0] for pair in columns["index"]]
    steps = np.diff(x)
    if passed(one).any() or not side or any(low) or len(x) < 2 or not ((steps > 0).all() or (steps < 0).all()):
        return None
    order = np.argsort(x)
    grid = np.linspace(x.min(), x.max(), COUNT)
    edge = np.interp(grid, x[order], y[order])
    end = np.full(len(grid), float(one["bounds"][0][int(side > 0)]))
    for another in loci:
        for level in _levels(another, grid) if another is not one else ():
            between = side * (level - edge) > 0
            end = np.where(between & (side * (level - end) < 0), level, end)
    return StableRegion(grid, edge, end)


def plane_of(one: Mapping[str, Any]) -> str:
    """What is to be said after ``stable`` or ``index`` of a locus: :data:`IN_PLANE`, or nothing."""
    return IN_PLANE if one.get("planar") else ""


def in_words(one: Mapping[str, Any]) -> str:
    """What the region of a locus is, for legends."""
    return f"stable{plane_of(one)}, as far as these curves tell"


def passed(one: Mapping[str, Any]) -> NDArray[np.int_]:
    """Number of curves that cross a locus between its start and each row (rows,): at each, sides change places."""
    rows, start = np.arange(len(one["columns"]["index"])), one["start"]
    beyond = [mark["row"] for mark in one["marks"] if mark["kind"] == CROSSES]
    return np.array([sum(start < at <= row or row <= at < start for at in beyond) for row in rows], dtype=int)


def _levels(one: Mapping[str, Any], grid: Floats) -> list[Floats]:
    """Loads (len(grid),) at which each segment of a locus has these values of the second parameter; nan where none."""
    load, other = one["parameters"]
    x, y = (np.asarray(one["columns"][name], dtype=float) for name in (other, load))
    found = []
    for i in np.flatnonzero(np.diff(x) != 0):
        share = (grid - x[i]) / (x[i + 1] - x[i])
        found.append(np.where((share >= 0) & (share <= 1), y[i] + share * (y[i + 1] - y[i]), np.nan))
    return found

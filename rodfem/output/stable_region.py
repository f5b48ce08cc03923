"""Where an equilibrium is stable in the plane of two parameters, as far as the loci of its special points tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain
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
    x, y = _curve(one)
    side, crossed = one.get("lower"), CROSSES in [mark["kind"] for mark in one["marks"]]
    monotone = len(x) > 1 and abs(np.sign(np.diff(x)).sum()) == len(x) - 1
    if crossed or not side or not monotone or any(next(zip(*one["columns"]["index"], strict=True))):
        return None
    order = np.argsort(x)
    grid = np.linspace(x.min(), x.max(), COUNT)
    edge = np.interp(grid, x[order], y[order])
    end = np.full(len(grid), float(one["bounds"][0][int(side > 0)]))
    others = (_levels(another, grid) for another in loci if another is not one)
    for level in chain.from_iterable(others):
        nearer = (side * (level - edge) > 0) & (side * (level - end) < 0)
        end = np.where(nearer, level, end)
    return StableRegion(grid, edge, end)


def _curve(one: Mapping[str, Any]) -> tuple[Floats, Floats]:
    """Second parameter and load of all rows of a locus."""
    x, y = (np.asarray(one["columns"][name], dtype=float) for name in reversed(one["parameters"]))
    return x, y


def plane_of(one: Mapping[str, Any]) -> str:
    """What is to be said after ``stable`` or ``index`` of a locus: :data:`IN_PLANE`, or nothing."""
    return IN_PLANE if one.get("planar") else ""


def in_words(one: Mapping[str, Any]) -> str:
    """What the region of a locus is, for legends."""
    return f"stable{plane_of(one)}, as far as these curves tell"


def _levels(one: Mapping[str, Any], grid: Floats) -> list[Floats]:
    """Loads (len(grid),) at which each segment of a locus has these values of the second parameter; nan where none."""
    (x, y), found = _curve(one), []
    for i in np.flatnonzero(np.diff(x) != 0):
        share = (grid - x[i]) / (x[i + 1] - x[i])
        found.append(np.where((share >= 0) & (share <= 1), y[i] + share * (y[i + 1] - y[i]), np.nan))
    return found

"""States of a branch at equal stations along the rod, from ``states.h5``, and how the page shows the rod first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.errors import InputError
from rodfem.output.glyphs import Look
from rodfem.output.pieces import typical_state
from rodfem.output.states import curve_of
from rodfem.output.view import axes_of, thickness
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import FOUNDATION, SUPPORTS, TIES, Setting
from rodfem.problem.setting import read as read_setting

Floats = NDArray[np.float64]

FEWEST, MOST = 49, 241
"""Stations along a rod."""
FEWEST_NODES = 4
"""Nodes of a cubic spline, at least."""
BUDGET = 400_000
"""Stations of all states together above which each has fewer: about 20 MB of the page."""


def stations(nodes: int, states: int) -> int:
    """Number of stations for states with so many nodes, odd, so that the middle of the rod is one."""
    wanted = min(2 * nodes - 1, MOST, BUDGET // max(states, 1))
    return max(FEWEST, wanted) | 1


@dataclass(frozen=True)
class Shapes:
    """P states at S stations.

    Attributes
    ----------
    s
        Arclengths (S,).
    r, q
        Centreline (P, S, 3) and unit quaternions (P, S, 4), continuous along the rod.
    """

    s: Floats
    r: Floats
    q: Floats

    def __getitem__(self, row: int) -> tuple[Floats, Floats]:
        """Centreline (S, 3) and directors (S, 3, 3), columns of each matrix, of a state."""
        return self.r[row], directors(self.q[row])


def shapes_of(group: Any, count: int) -> Shapes:
    """Read the states below the group of a branch at ``count`` stations, by splines through the nodes.

    The centre of a rod that nothing holds, which may be anywhere, is the origin.  Raises :class:`InputError` where a
    state is not finite, or no curve.
    """
    s, r, q = (np.asarray(group[name]) for name in ("s", "r", "q"))
    rows = []
    for row, at in enumerate(np.isfinite(s)):  # the rows of a mesh with fewer nodes end in nan
        rows.append(_state((s[row, at], r[row, at], q[row, at]), count, group))
    at, positions, quaternions = (np.array(part) for part in zip(*rows, strict=True))
    if SUPPORTS in group and not any(group.get(name) for name in (SUPPORTS, FOUNDATION, TIES)):
        positions = positions - positions.mean(axis=1, keepdims=True)
    return Shapes(at[0], positions, quaternions)


def _state(nodes: tuple[Floats, Floats, Floats], count: int, group: Any) -> tuple[Floats, ...]:
    """Arclengths, centreline and quaternions at the stations."""
    s, r, q = nodes
    if len(s) < FEWEST_NODES or not np.isfinite(r).all() or not np.isfinite(q).all() or not (np.diff(s) > 0).all():
        raise InputError(f"{group.file.filename} has a state that is no curve in {group.name}: run the scene again.")
    at = np.linspace(s[0], s[-1], count)
    return at, *curve_of(s, r, q, at)


@dataclass(frozen=True)
class Stage:
    """The picture of the typical state.

    ``branch`` and ``row`` are those of the state, ``look`` size and directions of the picture, ``load`` the unit vector
    along the dead load (3,), or None, and ``setting`` what holds and loads the rod.
    """

    branch: str
    row: int
    look: Look
    load: Floats | None
    setting: Setting


def stage_of(data: Mapping[str, Any], shapes: Mapping[str, Shapes], groups: Any) -> Stage:
    """Stage for a diagram; ``groups`` are those of the branches in ``states.h5``, ``shapes`` their states."""
    branch, row, _ = typical_state(data)
    first = data["branches"][0]
    load = next(b["columns"]["load"][row] for b in data["branches"] if b["name"] == branch)
    left = 0 if branch == first["name"] else int(np.argmin(abs(np.array(first["columns"]["load"]) - load)))
    reference, (r, frames) = shapes[first["name"]].r[left], shapes[branch][row]
    setting = read_setting(groups[branch], row)
    down = setting.force if setting.down is None else setting.down
    axes = axes_of(setting, reference, r - reference, frames[0])
    return Stage(branch, row, Look(thickness(r), axes), None if down is None else down / np.linalg.norm(down), setting)

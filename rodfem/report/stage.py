"""From where the page shows the rod first, and how thick it is drawn: as in the picture of a typical state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.output.glyphs import Look
from rodfem.output.pieces import typical_state
from rodfem.output.view import axes_of, thickness
from rodfem.problem.setting import Setting
from rodfem.problem.setting import read as read_setting
from rodfem.report.shapes import Shapes

Floats = NDArray[np.float64]


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

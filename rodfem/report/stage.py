"""From where the page shows the rod first, and how thick it is drawn: as in the picture of a typical state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.output.typical import typical_state
from rodfem.output.view import axis_of, on_feet, view_of
from rodfem.problem.setting import Setting
from rodfem.problem.setting import read as read_setting
from rodfem.report.shapes import Shapes

Floats = NDArray[np.float64]

SLENDER, COILED = 90.0, 40.0
"""Length of a rod, and extent of its centreline, over its drawn radius, at least."""


@dataclass(frozen=True)
class Stage:
    """The picture of the typical state.

    Attributes
    ----------
    branch, row
        The state.
    axes
        To the right, upwards and to the viewer, as rows (3, 3).
    load
        Unit vector along the dead load (3,), or None.
    radius
        Mean radius of the rod.
    setting
        What holds and loads it.
    """

    branch: str
    row: int
    axes: Floats
    load: Floats | None
    radius: float
    setting: Setting


def stage_of(data: Mapping[str, Any], shapes: Mapping[str, Shapes], groups: Any) -> Stage:
    """Stage for a diagram; ``groups`` are those of the branches in ``states.h5``, ``shapes`` their states."""
    branch, row, _ = typical_state(data)
    first = data["branches"][0]
    loads = np.array(first["columns"]["load"])
    left = int(np.argmin(abs(loads - next(b["columns"]["load"][row] for b in data["branches"] if b["name"] == branch))))
    reference = shapes[first["name"]].r[0 if branch == first["name"] else left]
    (r, frames), setting = shapes[branch][row], read_setting(groups[branch], row)
    side = setting.widest(frames[0])
    axis = axis_of(setting, reference)
    down, load, feet = setting.down, setting.force, on_feet(setting)
    axes = view_of(reference, r - reference, axis=axis, down=down, load=load, side=side, feet=feet)
    load = load if down is None else down
    length = float(shapes[branch].s[-1] - shapes[branch].s[0])
    radius = min(length / SLENDER, float(np.linalg.norm(np.ptp(r, axis=0))) / COILED)
    return Stage(branch, row, axes, None if load is None else load / np.linalg.norm(load), radius, setting)

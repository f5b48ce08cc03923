"""Curves that change in time as VTKHDF files, which ParaView and VTK read.

A step is one row of a branch, a polyline with its fields; its time is the number of the row.  The format is VTK's own:
https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html, version 2.0, ``PolyData`` with steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rodfem.whole_files import with_added, write_whole

Floats = NDArray[np.float64]
VERSION = (2, 0)
KINDS = ("Vertices", "Lines", "Strips", "Polygons")
"""Kinds of cells of PolyData, in the order of their offsets."""


def write_curves(
    path: Path, curves: list[Floats], fields: Mapping[str, list[Floats]], numbers: Mapping[str, Floats]
) -> None:
    """Write a curve for each step.

    Parameters
    ----------
    path
        File, by custom ``*.vtkhdf``.
    curves
        Points (m, 3) of each step; m may differ from step to step.
    fields
        By name, values (m,) or (m, k) at the points of each step.
    numbers
        By name, one number for each step, (steps,).

    Raises :class:`~rodfem.errors.InputError` where the file cannot be written.
    """
    sizes = np.array([len(curve) for curve in curves])
    steps = len(sizes)
    starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])

    def add(file: object) -> None:
        root = file.create_group("VTKHDF")  # type: ignore[attr-defined]
        root.attrs["Version"] = VERSION
        root.attrs.create("Type", np.bytes_("PolyData"))
        root["NumberOfPoints"], root["Points"] = sizes, np.concatenate(curves)
        for kind in KINDS:
            cells = root.create_group(kind)
            lines = kind == "Lines"
            cells["NumberOfCells"] = np.full(steps, int(lines))
            cells["NumberOfConnectivityIds"] = sizes if lines else np.zeros(steps, int)
            # each step has an array of offsets of its own, one longer than it has cells
            cells["Offsets"] = np.array([x for m in sizes for x in (0, m)]) if lines else np.zeros(steps, int)
            cells["Connectivity"] = np.concatenate([np.arange(m) for m in sizes]) if lines else np.zeros(0, int)
        at_points, per_step = root.create_group("PointData"), root.create_group("FieldData")
        time = root.create_group("Steps")
        time.attrs["NSteps"] = steps
        time["Values"] = np.arange(steps, dtype=float)
        time["PartOffsets"], time["NumberOfParts"] = np.arange(steps), np.ones(steps, int)
        time["PointOffsets"] = starts
        before = np.zeros((steps, len(KINDS)), int)
        before[:, 1] = np.arange(steps)
        time["CellOffsets"] = before
        places = np.zeros((steps, len(KINDS)), int)
        places[:, 1] = starts
        time["ConnectivityIdOffsets"] = places
        offsets = time.create_group("PointDataOffsets")
        for name, values in fields.items():
            at_points[name], offsets[name] = np.concatenate(values), starts
        offsets, shapes = time.create_group("FieldDataOffsets"), time.create_group("FieldDataSizes")
        for name, column in numbers.items():
            per_step[name], offsets[name] = column, np.arange(steps)
            shapes[name] = np.ones((steps, 2), int)

    write_whole({path: with_added(path, add, first=True)})

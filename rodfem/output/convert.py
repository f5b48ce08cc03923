"""Saved diagrams in the formats of other programs: VTKHDF for ParaView, CSV tables, netCDF for xarray."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.file_format import DIAGRAM, read_json
from rodfem.modes.modes import load_modes, rows_with_modes
from rodfem.output.states import rows_of
from rodfem.output.tables import of_files
from rodfem.output.words import row_of
from rodfem.whole_files import with_added, write_whole

Floats = NDArray[np.float64]
KINDS = ("Vertices", "Lines", "Strips", "Polygons")
"""Kinds of cells of PolyData, in the order of their offsets."""
CELLS = ("NumberOfCells", "NumberOfConnectivityIds", "Offsets", "Connectivity")


def to_vtkhdf(folder: Path, target: Path) -> list[Path]:
    """Write a file for each branch: a row is a step, the centreline a polyline with all fields; returns the files.

    Modes, where there are any, have a file for each state.  Raises :class:`InputError` for a folder without a run.
    """
    made = []
    for rows in rows_of(folder):
        path = target / f"{file_name(rows.name)}.vtkhdf"
        fields = {name: values for name, values in rows.fields.items() if name != "r"}
        write_curves(path, rows.fields["r"], fields, rows.columns)
        made.append(path)
    return made + [_write_modes(place, folder, target) for place in rows_with_modes(folder / "modes.h5")]


def file_name(branch: str) -> str:
    """Name of a branch in that of a file."""
    return branch.replace(" ", "-").replace("/", "-")


def _write_modes(place: tuple[str, int], folder: Path, target: Path) -> Path:
    """Write the modes of a row of a branch, as vectors at the nodes of its state, real parts of complex ones."""
    branch, row = place
    modes = load_modes(folder / "modes.h5", branch, row)
    fields, numbers = {"s": [modes.s]}, {"load": np.array([modes.load])}
    for i, value in enumerate(modes.value.real, start=1):
        fields[f"displacement {i}"] = [modes.displacement[i - 1].real]
        fields[f"rotation {i}"] = [modes.rotation[i - 1].real]
        numbers[f"mu {i}"] = np.array([value])
    path = target / f"modes-{file_name(branch)}-{row}.vtkhdf"
    write_curves(path, [modes.r], fields, numbers)
    return path


def write_curves(
    path: Path, curves: list[Floats], fields: Mapping[str, list[Floats]], numbers: Mapping[str, Floats]
) -> None:
    """Write curves that change in time as a VTKHDF file, which ParaView and VTK read.

    A step is one row of a branch, a polyline with its fields; its time is the number of the row.  The format is VTK's
    own: https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html, version 2.0, ``PolyData`` with
    steps.  ``path`` is the file, ``curves`` are the points (m, 3) of each step, where m may differ from step to step,
    ``fields`` by name values (m,) or (m, k) at the points of each step, and ``numbers`` by name one number a step.
    """
    sizes, steps = np.array([len(curve) for curve in curves]), len(curves)
    starts, each = np.cumsum(sizes) - sizes, np.arange(steps)

    def add(file: Any) -> None:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", np.bytes_("PolyData"))
        root["NumberOfPoints"], root["Points"] = sizes, np.concatenate(curves)
        none = np.zeros(steps, int)
        offsets = np.column_stack([none, sizes]).ravel()  # each step's are one more than it has cells
        lines = np.ones(steps, int), sizes, offsets, np.concatenate([np.arange(m) for m in sizes])
        for kind in KINDS:
            parts = lines if kind == "Lines" else (none, none, none, none[:0])
            for name, part in zip(CELLS, parts, strict=True):
                root[f"{kind}/{name}"] = part
        time = root.create_group("Steps")
        time.attrs["NSteps"] = steps
        time["Values"] = np.arange(steps, dtype=float)
        time["PartOffsets"], time["NumberOfParts"], time["PointOffsets"] = each, np.ones(steps, int), starts
        here = np.array([kind == "Lines" for kind in KINDS], dtype=int)
        time["CellOffsets"], time["ConnectivityIdOffsets"] = np.outer(each, here), np.outer(starts, here)
        for name, values in fields.items():
            root[f"PointData/{name}"], time[f"PointDataOffsets/{name}"] = np.concatenate(values), starts
        for name, column in numbers.items():
            root[f"FieldData/{name}"], time[f"FieldDataOffsets/{name}"] = column, each
            time[f"FieldDataSizes/{name}"] = np.ones((steps, 2), int)

    write_whole({path: with_added(path, add, first=True)})


def to_csv(folder: Path, target: Path) -> list[Path]:
    """Write ``rows.csv``, a line for each row of each branch, and ``special.csv``; returns the files.

    Raises :class:`InputError` for a folder without a run.
    """
    data = read_json(folder / "diagram.json", DIAGRAM, ("branches",))
    rows, special = list[dict[str, Any]](), list[dict[str, Any]]()
    for branch in data["branches"]:
        about = {"branch": branch["name"]}
        rows += [about | {"row": row} | row_of(branch, row) for row in range(len(branch["columns"]["load"]))]
        special += [about | one for one in branch["special"]]
    contents = {target / "rows.csv": _table(rows), target / "special.csv": _table(special)}
    write_whole(contents)
    return list(contents)


def _table(rows: list[dict[str, Any]]) -> bytes:
    """Rows as text, numbers with all their digits, nothing where there is none."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    lines: list[list[Any]] = [names, *([row.get(name) for name in names] for row in rows)]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerows([["" if x is None else repr(x) if isinstance(x, float) else x for x in line] for line in lines])
    return text.getvalue().encode()


def to_netcdf(folder: Path, target: Path) -> list[Path]:
    """Write ``diagram.nc``, the content of :meth:`rodfem.Diagram.to_xarray`; returns the file.

    Raises :class:`InputError` for a folder without a run, and :class:`SetupError` without xarray.
    """
    path = target / "diagram.nc"
    write_whole({path: bytes(of_files(folder).to_netcdf())})
    return [path]


FORMATS: dict[str, Callable[[Path, Path], list[Path]]] = {"vtkhdf": to_vtkhdf, "csv": to_csv, "netcdf": to_netcdf}
"""Formats by name, and what writes them."""

"""A run as arrays, read from its files: shapes, what varies along the rod, and the formats of other programs.

Strains, contact forces and moments are polynomials of each element.  The file has them at equal places of each, ends
included where there is more than one: see :mod:`rodfem.fem.resultants`.  Where nothing acts at the end of an element
strains and curvatures jump by the error of the mesh; forces and moments are continuous.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rodfem.continuation.branch import COLUMNS, Branch, Point
from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, STATES, read_json
from rodfem.libraries import optional
from rodfem.modes.modes import load_modes, rows_with_modes, stacked
from rodfem.output.table import point_values, reactions_by_name
from rodfem.output.words import row_of
from rodfem.problem.quaternions import directors
from rodfem.tolerances import same_place
from rodfem.whole_files import with_added, write_whole

Floats = NDArray[np.float64]

POINTS = "points"  # name of the arclengths of the profiles in the file
PROFILES = {"v": "strain", "k": "curvature", "n": "force", "m": "moment"}
"""Symbols of the profiles, components along the directors, and their names in the file."""
DRIFT = "drift"  # beginning of the names of scalars that are zero at every equilibrium
VECTORS = {
    "r": "centreline, components in space",
    "directors": "directors d1, d2, d3, components in space",
    "strain": "strain v along the directors",
    "curvature": "curvature and twist k along the directors",
    "force": "contact force along the directors",
    "moment": "contact moment along the directors",
}
"""Fields along the rod, attributes of a point, and what they are."""


# --- arrays


@dataclass(frozen=True)
class Rows:
    """All rows of a branch: ``columns`` by name (rows,), and ``fields`` at the nodes by name, (m, k) for each row."""

    name: str
    columns: dict[str, Floats]
    fields: dict[str, list[Floats]]


def rows_of(folder: Path) -> Iterator[Rows]:
    """Branches of the run in a folder, in order; raises :class:`InputError` where files are missing or do not fit."""
    import h5py

    data, path = read_json(folder / "diagram.json", DIAGRAM, ("branches",)), folder / "states.h5"
    unfit = f"{path} does not hold the states of diagram.json next to it ({{}}): run the scene again."
    with STATES.opened(path, ("branches",), unfit) as file:
        for branch in data["branches"]:
            group = file["branches"][branch["name"]]
            stored = {name: np.asarray(x) for name, x in group.items() if isinstance(x, h5py.Dataset)}
            yield Rows(branch["name"], _numbers(branch["columns"], stored), _fields(stored))


def _numbers(columns: Mapping[str, Any], stored: Mapping[str, Floats]) -> dict[str, Floats]:
    """Numbers of each row: those of the diagram, nan where there is none, and the scalar unknowns of the states."""
    out = {name: x for name, x in stored.items() if x.ndim == 1 and not name.startswith(DRIFT)}
    for name, column in columns.items():
        if all(x is None or isinstance(x, (int, float)) for x in column):
            out[name] = np.array(column, dtype=float)
    return out


def _fields(stored: Mapping[str, Floats]) -> dict[str, list[Floats]]:
    """Nodal values of each row, without the nodes that only rows of finer meshes have."""
    s, out = stored["s"], dict[str, list[Floats]]()
    others = {POINTS, *PROFILES, *PROFILES.values()}
    nodal = {name: x for name, x in stored.items() if x.shape[:2] == s.shape and name not in others}
    nodal |= {name: stored[name] for name in ("r", "q")}
    for row, there in enumerate(np.isfinite(s)):
        here = {name: x[row, there] for name, x in nodal.items()}
        frames, profiles = directors(here["q"]), profiles_of(stored, row)
        here |= {f"d{i + 1}": frames[:, :, i] for i in range(3)}
        here |= {symbol: profiles.at_nodes(symbol, here["s"]) for symbol in PROFILES}
        for name, values in here.items():
            out.setdefault(name, []).append(values)
    return out


@dataclass(frozen=True)
class Profiles:
    """Profiles of one state, of E elements with p points each."""

    points: Floats
    fields: dict[str, Floats]

    def at_nodes(self, symbol: str, s: Floats) -> Floats:
        """Values (m, 3) at the arclengths ``s`` (m,) of the nodes, at ends that elements share the mean of the two."""
        values, degree = self.fields[symbol], (len(s) - 1) // len(self.points)
        places = degree * np.arange(len(values))[:, None] + np.arange(degree + 1)
        own, wanted = self.points[0] - s[0], s[: degree + 1] - s[0]  # alike in all elements, relative to their lengths
        orders = np.arange(len(own))
        weights = (wanted[:, None] / wanted[-1]) ** orders @ np.linalg.inv((own[:, None] / wanted[-1]) ** orders)
        out, count = np.zeros((len(s), 3)), np.zeros((len(s), 1))
        np.add.at(out, places, weights @ values)
        np.add.at(count, places, 1.0)
        return out / count

    def jump(self, symbol: str, loaded: Sequence[float] = ()) -> float:
        """Largest jump of a component between elements, where nothing acts: not at the ``loaded`` arclengths."""
        values, inside = self.fields[symbol], self.points[1:, 0]
        there = np.zeros(len(inside), dtype=bool)
        for s in loaded:
            there |= same_place(inside, s, float(np.ptp(self.points)))
        return float(abs(values[1:, 0] - values[:-1, -1])[~there].max(initial=0.0))


def profiles_of(group: Mapping[str, Any], row: int) -> Profiles:
    """Profiles of the state in a row of the group of a branch."""
    points = np.asarray(group[POINTS][row])
    rows, columns = np.isfinite(points[:, 0]), np.isfinite(points[0])  # those of a coarser mesh end in nan
    fields = {symbol: np.asarray(group[name][row])[rows][:, columns] for symbol, name in PROFILES.items()}
    return Profiles(points[rows][:, columns], fields)


def check_run(data: dict[str, Any], states: Path) -> None:
    """Raise :class:`InputError` where ``states.h5`` is of another run than the ``data`` of a ``diagram.json``."""
    with STATES.opened(states) as file:
        run = file.attrs.get("run")
    if run != data.get("run"):
        raise InputError(
            f"{states} and the diagram.json next to it are of different runs: keep the files of one run together, or "
            "run the scene again."
        )


def curve_at(group: Mapping[str, Any], row: int, at: int | Floats) -> tuple[Floats, Floats, Floats]:
    """Arclengths (m,), centreline (m, 3) and unit quaternions (m, 4) of a row of the group of a branch.

    They are those given as ``at``, or as many as that, evenly spaced.
    """
    known = np.isfinite(group["s"][row])  # the rows of a mesh with fewer nodes end in nan
    s, r, q = (np.asarray(group[name][row])[known] for name in ("s", "r", "q"))
    opposite = np.sum(q[1:] * q[:-1], axis=1) < 0.0  # q and -q are the same rotation
    signs = np.append(1.0, np.cumprod(np.where(opposite, -1.0, 1.0)))
    at = np.linspace(s[0], s[-1], at) if isinstance(at, int) else at
    turned = CubicSpline(s, q * (signs / np.linalg.norm(q, axis=1))[:, None])(at)
    return at, CubicSpline(s, r)(at), turned / np.linalg.norm(turned, axis=1, keepdims=True)


# --- ParaView


def to_vtkhdf(folder: Path, target: Path) -> list[Path]:
    """Write a file for each branch: a row is a step, the centreline a polyline with all fields; returns the files."""
    written = []
    for rows in rows_of(folder):
        path = target / f"{file_name(rows.name)}.vtkhdf"
        written.append(path)
        _write_curves(path, rows.fields["r"], {n: x for n, x in rows.fields.items() if n != "r"}, rows.columns)
    for branch, row in rows_with_modes(folder / "modes.h5"):
        modes = load_modes(folder / "modes.h5", branch, row)
        fields, numbers = {"s": [modes.s]}, {"load": np.array([modes.load])}
        for i, (mu, u, w) in enumerate(zip(modes.value, modes.displacement, modes.rotation, strict=True), start=1):
            fields |= {f"displacement {i}": [u.real], f"rotation {i}": [w.real]}
            numbers[f"mu {i}"] = np.array([mu.real])
        written.append(target / f"modes-{file_name(branch)}-{row}.vtkhdf")
        _write_curves(written[-1], [modes.r], fields, numbers)
    return written


def file_name(branch: str) -> str:
    """Name of a branch in that of a file."""
    return branch.replace(" ", "-").replace("/", "-")


def _write_curves(
    path: Path, curves: list[Floats], fields: Mapping[str, list[Floats]], numbers: Mapping[str, Floats]
) -> None:
    """Write curves that change in time: points (m, 3) of each step, fields (m,) or (m, k) by name, numbers of steps.

    The format is VTK's own, https://docs.vtk.org/en/latest/vtk_file_formats/vtkhdf_file_format/index.html, version 2.0,
    ``PolyData`` with steps.
    """
    sizes, steps = np.array([len(curve) for curve in curves]), len(curves)
    starts, each, none = np.cumsum(sizes) - sizes, np.arange(steps), np.zeros(steps, int)

    def add(file: Any) -> None:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 0)
        root.attrs.create("Type", np.bytes_("PolyData"))
        root["NumberOfPoints"], root["Points"] = sizes, np.concatenate(curves)
        offsets = np.column_stack([none, sizes]).ravel()  # each step's are one more than it has cells
        lines = np.ones(steps, int), sizes, offsets, np.concatenate([np.arange(m) for m in sizes])
        for kind in ("Vertices", "Lines", "Strips", "Polygons"):
            parts = lines if kind == "Lines" else (none, none, none, none[:0])
            names = ("NumberOfCells", "NumberOfConnectivityIds", "Offsets", "Connectivity")
            for name, part in zip(names, parts, strict=True):
                root[f"{kind}/{name}"] = part
        time, here = root.create_group("Steps"), np.array([0, 1, 0, 0])  # lines alone
        time.attrs["NSteps"] = steps
        time["Values"] = np.arange(steps, dtype=float)
        time["PartOffsets"], time["NumberOfParts"], time["PointOffsets"] = each, np.ones(steps, int), starts
        time["CellOffsets"], time["ConnectivityIdOffsets"] = np.outer(each, here), np.outer(starts, here)
        for name, values in fields.items():
            root[f"PointData/{name}"], time[f"PointDataOffsets/{name}"] = np.concatenate(values), starts
        for name, column in numbers.items():
            root[f"FieldData/{name}"], time[f"FieldDataOffsets/{name}"] = column, each
            time[f"FieldDataSizes/{name}"] = np.ones((steps, 2), int)

    write_whole({path: with_added(path, add, first=True)})


# --- tables


def to_csv(folder: Path, target: Path) -> list[Path]:
    """Write ``rows.csv``, a line for each row of each branch, and ``special.csv``; returns the files."""
    data = read_json(folder / "diagram.json", DIAGRAM, ("branches",))
    rows, special = list[dict[str, Any]](), list[dict[str, Any]]()
    for branch in data["branches"]:
        about = {"branch": branch["name"]}
        for row in range(len(branch["columns"]["load"])):
            numbers = row_of(branch, row)
            rows.append(about | {"row": row} | numbers | reactions_by_name(numbers.pop("reactions", ())))
        special += [about | one for one in branch["special"]]
    contents = {target / "rows.csv": as_csv(rows), target / "special.csv": as_csv(special)}
    write_whole(contents)
    return list(contents)


def as_csv(rows: list[dict[str, Any]]) -> bytes:
    """Rows as text, numbers with all their digits, nothing where there is none."""
    text = io.StringIO()
    writer = csv.DictWriter(text, dict.fromkeys(name for row in rows for name in row), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue().encode()


def to_netcdf(folder: Path, target: Path) -> list[Path]:
    """Write ``diagram.nc``, the content of :meth:`rodfem.Diagram.to_xarray`; returns the file."""
    data, fields = read_json(folder / "diagram.json", DIAGRAM, ("branches", "constants")), []
    for rows in rows_of(folder):
        for row in range(len(rows.columns["load"])):
            here = {name: values[row] for name, values in rows.fields.items()}
            frames = np.stack([here[f"d{i + 1}"] for i in range(3)], axis=1)
            fields.append(here | {name: here[symbol] for symbol, name in PROFILES.items()} | {"directors": frames})
    branches, path = list(map(_without_states, data["branches"])), target / "diagram.nc"
    write_whole({path: bytes(_dataset(data, branches, fields).astype(float).to_netcdf())})
    return [path]


def _without_states(data: Mapping[str, Any]) -> Branch:
    """A branch of a file, whose points have what is in its columns, and no state."""
    values = [point_values(data["columns"], row) for row in range(len(data["columns"]["load"]))]
    return Branch(data["name"], None, 0, [Point(x=None, tangent=None, **known) for known in values])


def dataset_of(branches: Sequence[Branch], data: Mapping[str, Any]) -> Any:
    """A Dataset of xarray, of branches and of the ``data`` that their ``diagram.json`` has."""
    fields = [{name: getattr(p, name) for name in ("s", *VECTORS)} for b in branches for p in b.points]
    return _dataset(data, branches, fields)


def _dataset(data: Mapping[str, Any], branches: Sequence[Branch], fields: Sequence[Mapping[str, Floats]]) -> Any:
    """Columns of branches, and fields of each row at the nodes; those of a coarser mesh end in nan."""
    columns: dict[str, Any] = {n: ("point", np.concatenate([b[n] for b in branches])) for n in COLUMNS}
    columns["s"] = ("point", "node"), stacked([here["s"] for here in fields])
    for name, words in VECTORS.items():
        values = stacked([here[name] for here in fields])
        columns[name] = ("point", "node", *("director", "component")[4 - values.ndim :]), values, {"long_name": words}
    names, rows = zip(*((b.name, row) for b in branches for row in range(len(b.points))), strict=True)
    coordinates = {name: columns.pop(name) for name in ("load", "arclength", "s")}
    coordinates |= {"branch": ("point", np.array(names)), "row": ("point", np.array(rows))}
    out = optional("xarray", "tables").Dataset(columns, coordinates, {"scene": data["scene"]} | data["constants"])
    out["load"].attrs |= {"long_name": data["parameter_words"] or data["parameter"], "units": data["parameter_unit"]}
    out["ordinate"].attrs |= {"long_name": data["ordinate"], "units": data["ordinate_unit"]}
    return out


FORMATS: dict[str, Callable[[Path, Path], list[Path]]] = {"vtkhdf": to_vtkhdf, "csv": to_csv, "netcdf": to_netcdf}
"""Formats by name, and what writes them."""

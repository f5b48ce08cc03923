"""The rows of a diagram, or of the files of a run, as one table of another library: a Dataset of xarray."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rodfem.continuation.branch import COLUMNS, Branch
from rodfem.file_format import DIAGRAM, read_json
from rodfem.libraries import optional
from rodfem.output.states import Rows, rows_of
from rodfem.stability.soft_mode import is_stable, stability

Columns = Mapping[str, np.ndarray]
VECTORS = {
    "r": "centreline, components in space",
    "directors": "directors d1, d2, d3, components in space",
    "strain": "strain v along the directors",
    "curvature": "curvature and twist k along the directors",
    "force": "contact force along the directors",
    "moment": "contact moment along the directors",
}
"""Fields along the rod, attributes of a point, and what they are."""
SYMBOLS = {"s": "s", "r": "r", "strain": "v", "curvature": "k", "force": "n", "moment": "m"}
"""Names of these fields in files."""


def of_branches(branches: Sequence[Branch], data: Mapping[str, Any]) -> Any:
    """A Dataset of branches and of the ``data`` that their ``diagram.json`` has."""
    fields = [{name: getattr(p, name) for name in ("s", *VECTORS)} for b in branches for p in b.points]
    return _dataset(data, {b.name: {name: b[name] for name in COLUMNS} for b in branches}, fields)


def of_files(folder: Path) -> Any:
    """The same of the files of a run; raises :class:`InputError` for a folder without one."""
    data, every = read_json(folder / "diagram.json", DIAGRAM, ("branches", "constants")), list(rows_of(folder))
    fields = [_fields(rows, i) for rows in every for i in range(len(rows.columns["load"]))]
    columns = {rows.name: _columns(rows, b) for rows, b in zip(every, data["branches"], strict=True)}
    return _dataset(data, columns, fields)


def _columns(rows: Rows, branch: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Columns of a branch in files, nan where there is none; files leave out what is decided all along."""
    none, columns = [None] * len(rows.columns["load"]), branch["columns"]
    parts = [columns.get(name) or none for name in ("negative", "undecided", "kink", "uncompared", "negative_in_space")]
    stable = [
        is_stable(stability(negative, undecided or 0, kink or uncompared or "", in_space))
        for negative, undecided, kink, uncompared, in_space in zip(*parts, strict=True)
    ]
    known = (
        {"undecided": np.zeros(len(none))}
        | rows.columns
        | {"stable": np.array([np.nan if x is None else x for x in stable])}
    )
    return {name: known.get(name, np.full(len(none), np.nan)) for name in COLUMNS}


def _fields(rows: Rows, row: int) -> dict[str, np.ndarray]:
    """Fields of one row by their names in a Dataset."""
    here = {name: values[row] for name, values in rows.fields.items()}
    found = {name: here[symbol] for name, symbol in SYMBOLS.items()}
    return found | {"directors": np.stack([here[f"d{i + 1}"] for i in range(3)], axis=1)}


def _dataset(data: Mapping[str, Any], branches: Mapping[str, Columns], fields: Sequence[Columns]) -> Any:
    """Columns of branches by name, and fields of each row at the nodes; those of a coarser mesh end in nan."""
    nodes = max(len(here["s"]) for here in fields)
    columns: dict[str, Any] = {n: ("point", np.concatenate([b[n] for b in branches.values()])) for n in COLUMNS}
    columns["s"] = ("point", "node"), np.stack([_filled(here["s"], nodes) for here in fields])
    for name, words in VECTORS.items():
        values = np.stack([_filled(here[name], nodes) for here in fields])
        axes = ("director", "component")[4 - values.ndim :]
        columns[name] = ("point", "node", *axes), values, {"long_name": words}
    sizes = [len(b["load"]) for b in branches.values()]
    coordinates = {name: columns.pop(name) for name in ("load", "arclength", "s")}
    coordinates["branch"] = "point", np.repeat([*branches], sizes)
    coordinates["row"] = "point", np.concatenate([np.arange(size) for size in sizes])
    out = optional("xarray", "tables").Dataset(columns, coordinates, {"scene": data["scene"]} | data["constants"])
    out["load"].attrs |= {"long_name": data["parameter_words"] or data["parameter"], "units": data["parameter_unit"]}
    out["ordinate"].attrs |= {"long_name": data["ordinate"], "units": data["ordinate_unit"]}
    return out


def _filled(values: np.ndarray, nodes: int) -> np.ndarray:
    return np.pad(values, [(0, nodes - len(values)), *[(0, 0)] * (values.ndim - 1)], constant_values=np.nan)

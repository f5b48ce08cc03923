"""A diagram as tables of other libraries: a DataFrame of pandas, a Dataset of xarray."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.continuation.branch import COLUMNS
from rodfem.libraries import optional

if TYPE_CHECKING:
    from rodfem.diagram.diagram import Diagram

VECTORS = {
    "r": "centreline, components in space",
    "directors": "directors d1, d2, d3, components in space",
    "strain": "strain v along the directors",
    "curvature": "curvature and twist k along the directors",
    "force": "contact force along the directors",
    "moment": "contact moment along the directors",
}
"""Fields along the rod, attributes of a point, and what they are."""


def dataframe(diagram: Diagram) -> Any:
    """A row for each point of each branch, its branch first."""
    frames = [branch.to_dataframe() for branch in diagram]
    for frame, branch in zip(frames, diagram, strict=True):
        frame.insert(0, "branch", branch.name)
    return optional("pandas", "tables").concat(frames, ignore_index=True)


def dataset(diagram: Diagram) -> Any:
    """The same with the fields along the rod, at the nodes; a coarser mesh ends in nan."""
    points = [point for branch in diagram for point in branch.points]
    nodes = max(len(point.s) for point in points)
    columns: dict[str, Any] = {n: ("point", np.concatenate([branch[n] for branch in diagram])) for n in COLUMNS}
    columns["s"] = ("point", "node"), np.stack([_filled(point.s, nodes) for point in points])
    for name, words in VECTORS.items():
        values = np.stack([_filled(getattr(point, name), nodes) for point in points])
        axes = ("director", "component")[4 - values.ndim :]
        columns[name] = ("point", "node", *axes), values, {"long_name": words}
    rows = np.concatenate([np.arange(len(b.points)) for b in diagram])
    coordinates = {name: columns.pop(name) for name in ("load", "arclength", "s")}
    coordinates |= {"branch": ("point", [point.branch for point in points]), "row": ("point", rows)}
    scene, load = diagram.scene, diagram.scene.parameters[diagram.scene.load]
    constants = {name: x.value for name, x in scene.parameters.items() if name != scene.load}
    out = optional("xarray", "tables").Dataset(columns, coordinates, {"scene": scene.name} | constants)
    out["load"].attrs |= {"long_name": load.words or scene.load, "units": load.unit}
    out["ordinate"].attrs |= {"long_name": scene.ordinate.name, "units": scene.ordinate.unit}
    return out


def _filled(values: np.ndarray, nodes: int) -> np.ndarray:
    return np.pad(values, [(0, nodes - len(values)), *[(0, 0)] * (values.ndim - 1)], constant_values=np.nan)

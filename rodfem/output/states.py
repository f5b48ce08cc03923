"""States of a run as arrays, read from its ``states.h5``: shapes, and what varies along the rod.

Strains, contact forces and moments are polynomials of each element.  The file has them at equal places of each, ends
included where there is more than one: see :mod:`rodfem.fem.resultants`.  Where nothing acts at the end of an element
strains and curvatures jump by the error of the mesh; forces and moments are continuous.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, STATES, read_json
from rodfem.problem.quaternions import directors
from rodfem.tolerances import same_place

Floats = NDArray[np.float64]

POINTS = "points"
"""Name of the arclengths of the profiles in the file."""
PROFILES = {"v": "strain", "k": "curvature", "n": "force", "m": "moment"}
"""Symbols of the profiles, components along the directors, and their names in the file."""
DRIFT = "drift"
"""Beginning of the names of scalars that are zero at every equilibrium."""


@dataclass(frozen=True)
class Rows:
    """All rows of a branch: ``columns`` by name (rows,), and ``fields`` at the nodes by name, (m, k) for each row.

    Fields are ``s``, ``r``, ``q``, the directors ``d1`` to ``d3``, the nodal unknowns of the scene, and, along the
    directors, strains ``v``, curvatures ``k``, contact force ``n`` and moment ``m``.
    """

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
            yield Rows(branch["name"], _columns(branch["columns"], stored), _fields(stored))


def _columns(columns: Mapping[str, list[Any]], stored: Mapping[str, Floats]) -> dict[str, Floats]:
    """Numbers of each row: those of the diagram, nan where there is none, and the scalar unknowns of the states."""
    out = {}
    for name, column in columns.items():
        if all(x is None or isinstance(x, (int, float)) for x in column):
            out[name] = np.array([np.nan if x is None else x for x in column])
    scalars = {name: x for name, x in stored.items() if x.ndim == 1 and not name.startswith(DRIFT)}
    return scalars | out


def _fields(stored: Mapping[str, Floats]) -> dict[str, list[Floats]]:
    """Nodal values of each row, without the nodes that only rows of finer meshes have."""
    s, out = stored["s"], dict[str, list[Floats]]()
    others = {POINTS, *PROFILES, *PROFILES.values()}
    nodal = {name: x for name, x in stored.items() if x.shape[:2] == s.shape and name not in others}
    nodal |= {name: stored[name] for name in ("r", "q")}
    for row, there in enumerate(np.isfinite(s)):
        here = {name: x[row, there] for name, x in nodal.items()}
        frames = directors(here["q"])
        here |= {f"d{i + 1}": frames[:, :, i] for i in range(3)}
        profiles = profiles_of(stored, row)
        here |= {symbol: profiles.at_nodes(symbol, here["s"]) for symbol in PROFILES}
        for name, values in here.items():
            out.setdefault(name, []).append(values)
    return out


@dataclass(frozen=True)
class Profiles:
    """Profiles of one state, of E elements with p points each.

    ``points`` (E, p) are arclengths, ``fields`` by symbol the components along the directors, (E, p, 3).
    """

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
        jumps = abs(values[1:, 0] - values[:-1, -1])[~there]
        return float(jumps.max(initial=0.0))


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


def curve_of(s: Floats, r: Floats, q: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Centreline (n, 3) and unit quaternions (n, 4) at arclengths ``at`` (n,) of a state, by splines through its nodes.

    The nodes are at ``s`` (m,), with positions ``r`` (m, 3) and quaternions ``q`` (m, 4) of any length and sign.
    """
    opposite = np.sum(q[1:] * q[:-1], axis=1) < 0.0  # q and -q are the same rotation
    signs = np.append(1.0, np.cumprod(np.where(opposite, -1.0, 1.0)))
    turned = CubicSpline(s, q * (signs / np.linalg.norm(q, axis=1))[:, None])(at)
    return CubicSpline(s, r)(at), turned / np.linalg.norm(turned, axis=1, keepdims=True)


def curve_at(group: Mapping[str, Any], row: int, count: int) -> tuple[Floats, Floats, Floats]:
    """Arclengths (count,), centreline (count, 3) and unit quaternions (count, 4) of a row of the group of a branch."""
    s, r, q = (np.asarray(group[name][row]) for name in ("s", "r", "q"))
    known = np.isfinite(s)  # the rows of a mesh with fewer nodes end in nan
    at = np.linspace(s[0], s[known][-1], count)
    return at, *curve_of(s[known], r[known], q[known], at)

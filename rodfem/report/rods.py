"""Shapes, supports, modes and profiles along the rod of all states, as the page draws them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.errors import InputError
from rodfem.modes.modes import rows_with_modes, typical_of
from rodfem.output.glyphs import glyphs_of
from rodfem.output.plot_diagram import is_traced
from rodfem.output.profiles import POINTS, PROFILES, profiles_of
from rodfem.output.solids import body_of, profile_of
from rodfem.output.style import PALETTE
from rodfem.problem.setting import read as read_setting
from rodfem.report.branches import branch_data
from rodfem.report.motions import modes_of, motions_of
from rodfem.report.packing import packed, plain
from rodfem.report.shapes import BUDGET, Shapes, Stage, shapes_of, stage_of, stations

Floats = NDArray[np.float64]

OUTLINE, STRIPE = np.linspace(-np.pi, np.pi, 29)[:-1], np.linspace(-0.3, 0.3, 5)
"""Angles from d1 of the outline of a cross-section, and of the stripe that marks d1."""
OVER = 1.02
"""Distance of the stripe from the axis, relative to that of the surface."""
UNIFORM = 1e-6
"""Difference of outlines, in radii of the rod, up to which they are one."""


def rods_of(data: Mapping[str, Any], groups: Any, folder: Path) -> dict[str, Any]:
    """Branches with their shapes, and what they share; ``groups`` are those of ``states.h5`` in the ``folder``.

    Raises :class:`InputError` where they are not of the diagram ``data``.
    """
    shapes = _shapes(data, groups, folder)
    states = sum(len(each.r) for each in shapes.values())
    stage, shelf, branches = stage_of(data, shapes, groups), dict[tuple[str, str], int](), []
    for branch, colour in zip(data["branches"], cycle(PALETTE), strict=False):
        here, group = shapes[branch["name"]], groups[branch["name"]]
        shown = branch_data(branch, here, colour, data.get("natural") or {}, planar=bool(data.get("planar")))
        shown |= _drawn(here, group, stage, shelf) | profiles_data(group, states)
        shown |= _moving(branch, here, group, folder / "modes.h5", stage)
        traced = is_traced(branch, data["branches"])
        branches.append(shown | {"image": "" if traced else branch.get("image", "")})
    return _common(stage, shapes[stage.branch], data) | {"branches": branches, "solids": _solids(shelf)}


def _moving(branch: Mapping[str, Any], shapes: Shapes, group: Any, path: Path, stage: Stage) -> dict[str, Any]:
    """Modes of a branch by its rows, those with error bars in the file ``path``, and why others have none."""
    name, modes = branch["name"], {}
    zeros = [0] * len(shapes.r) if "omega2" in branch["columns"] else branch["columns"]["zero"]
    typical = {each.row: each for each in typical_of(group)}
    exact = {row for other, row in rows_with_modes(path) if other == name}
    for row in sorted({*typical, *exact} & {*range(len(shapes.r))}):
        few, nodes = getattr(typical.get(row), "found", None), group["s"][row]
        if shown := modes_of(path if row in exact else None, (name, row), few, nodes[np.isfinite(nodes)], zeros[row]):
            modes[row] = motions_of(shown, shapes, row, read_setting(group, row), stage.look)
    return {"modes": modes, "missed": {row: each.trouble for row, each in typical.items() if each.trouble}}


def profiles_data(group: Any, states: int) -> dict[str, Any]:
    """Profiles of a branch, whose group of ``states.h5`` is given; ``states`` is the number of those of all branches.

    Where the file has them: ``profile`` (P, M, 13), arclength and the components of v, k, n and m along the directors
    at M points, nan beyond the last one of a coarser mesh; ``element`` (P,), how many of them an element has, which
    determine its polynomials, and 0 where some are left out; ``jumps`` (P,) of each of the four between elements.
    """
    found = [one for one in (profiles_of(group, row) for row in range(len(group["load"]))) if one is not None]
    if not found:
        return {"profile": None, "element": None, "jumps": None}
    most, loaded = group[POINTS][0].size, _loaded(group)
    kept = np.unique(np.linspace(0, most - 1, min(most, max(2, BUDGET // states))).round().astype(int))
    out = np.full((len(found), most, 1 + 3 * len(PROFILES)), np.nan)
    for place, one in zip(out, found, strict=True):
        columns = [one.points.reshape(-1, 1), *(one.fields[symbol].reshape(-1, 3) for symbol in PROFILES)]
        place[: one.points.size] = np.hstack(columns)
    element = [one.points.shape[1] * (len(kept) == most) for one in found]
    jumps = {symbol: plain([one.jump(symbol, loaded) for one in found]) for symbol in PROFILES}
    return {"profile": packed(out[:, kept]), "element": element, "jumps": jumps}


def _loaded(group: Any) -> list[float]:
    """Arclengths at which something holds or loads the rod."""
    places: list[Mapping[str, Any]] = [*group.get("supports", {}).values(), *group.get("constraints", {}).values()]
    found = [float(place.attrs["s"]) for place in places]  # type: ignore[attr-defined]
    return [s for s in found if np.isfinite(s)]


def _shapes(data: Mapping[str, Any], groups: Any, folder: Path) -> dict[str, Shapes]:
    lengths = {branch["name"]: len(branch["columns"]["load"]) for branch in data["branches"]}
    count = stations(max(groups[name]["s"].shape[1] for name in lengths), sum(lengths.values()))
    shapes = {name: shapes_of(groups[name], count) for name in lengths}
    for name, length in lengths.items():
        if len(shapes[name].r) != length:
            raise InputError(f"{folder / 'states.h5'} has other rows of {name!r} than diagram.json: run it again.")
    return shapes


def _drawn(shapes: Shapes, group: Any, stage: Stage, shelf: dict[tuple[str, str], int]) -> dict[str, Any]:
    """Shapes of all states, and the bodies of their supports and loads: numbers on the ``shelf``, and maps."""
    found = [glyphs_of(read_setting(group, row), shapes.s, shapes[row], stage.look) for row in range(len(shapes.r))]
    return {
        "shape": packed(np.concatenate([shapes.r, shapes.q], axis=2)),
        "bodies": [[shelf.setdefault((x.body, x.color), len(shelf)) for x in glyphs] for glyphs in found],
        "maps": packed(np.array([x.map for glyphs in found for x in glyphs]).reshape(-1, 12)),
    }


def _common(stage: Stage, shapes: Shapes, data: Mapping[str, Any]) -> dict[str, Any]:
    """Cross-sections, size and direction of the pictures, and the state that is shown first."""
    return {
        "s": packed(shapes.s),
        "outline": packed(_outline(shapes, stage, OUTLINE)),
        "stripe": packed(OVER * _outline(shapes, stage, STRIPE)),
        "radius": stage.look.radius,
        "size": float(shapes.s[-1] - shapes.s[0]),
        "axes": stage.look.axes.tolist(),
        "loadDirection": None if stage.load is None else stage.load.tolist(),
        "notes": list(stage.setting.notes),
        "start": [[branch["name"] for branch in data["branches"]].index(stage.branch), stage.row],
    }


def _outline(shapes: Shapes, stage: Stage, angles: Floats) -> Floats:
    """Outline of the cross-sections (1, k, 2), or (S, k, 2) at the stations where they differ."""
    whole = stage.look.radius * profile_of(shapes.s, stage.setting.section, angles)
    return whole[:1] if np.ptp(whole, axis=0).max() < UNIFORM * stage.look.radius else whole


def _solids(shelf: dict[tuple[str, str], int]) -> list[dict[str, Any]]:
    """Bodies in their colours; a box and a wedge have sharp edges."""
    made = [(*body_of(body), body, color) for body, color in shelf]
    return [
        {
            "points": packed(points),
            "triangles": triangles.ravel().tolist(),
            "colour": color,
            "flat": body in ("box", "wedge"),
        }
        for points, triangles, body, color in made
    ]

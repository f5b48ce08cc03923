"""Rods in space as the page draws them: shapes of all states, supports, modes, and profiles along the rod."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rodfem.errors import InputError
from rodfem.modes.modes import RIGID, SYMMETRY, Few, Modes, exponent, load_modes, rows_with_modes, typical_of
from rodfem.output.glyphs import POINT, Look, body_of, glyphs_of, profile_of
from rodfem.output.pieces import typical_state
from rodfem.output.plot_diagram import is_traced
from rodfem.output.render import state_in, thickness
from rodfem.output.states import POINTS, PROFILES, curve_at, profiles_of
from rodfem.output.style import PALETTE
from rodfem.output.table import plain, reactions_by_name
from rodfem.output.words import eigenvalue_in_words
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import CONSTRAINTS, FOUNDATION, SUPPORTS, Setting
from rodfem.problem.setting import read as read_setting
from rodfem.report.branches import branch_data, packed
from rodfem.tolerances import SAME_SPECIAL

Floats = NDArray[np.float64]

LARGEST = 0.14, 0.9
"""Drawn displacement over the rod's size, and rotation in radian, of which the one that is reached first holds."""
GROWTH = 1e-9  # real part of the root of -mu, relative to it, above which a mode grows
ZERO = 1e-7  # a force or moment below this, relative to the natural force or moment, is the error of Newton's method
OUTLINE, STRIPE = np.linspace(-np.pi, np.pi, 29)[:-1], np.linspace(-0.3, 0.3, 5)
"""Angles from d1 of the outline of a cross-section, and of the stripe that marks d1."""
LEAST, BUDGET = 49, 40_000  # stations of a state at least, and of all together: about 6 MB of the page


def rods_of(data: Mapping[str, Any], groups: Any, folder: Path) -> dict[str, Any]:
    """Branches with their shapes, and what they share: ``data`` of the diagram, ``groups`` of ``states.h5``."""
    lengths = {branch["name"]: len(branch["columns"]["load"]) for branch in data["branches"]}
    states = sum(lengths.values())
    count = stations(max(groups[name]["s"].shape[1] for name in lengths), states)
    shapes = {name: shapes_of(groups[name], count) for name in lengths}
    name, row, _ = typical_state(data)
    stage, shelf, branches = state_in(groups, data["branches"][0]["name"], name, row), dict[tuple[str, str], int](), []
    look = Look(thickness(stage.centres), stage.view())
    for branch, colour in zip(data["branches"], cycle(PALETTE), strict=False):
        here, group = shapes[branch["name"]], groups[branch["name"]]
        shown = branch_data(branch, here, colour, data)
        rows = list(map(reactions_by_name, branch["columns"].get("reactions") or []))
        shown["ordinates"] |= {name: [row[name] for row in rows] for name in (rows[0] if rows else ())}
        shown |= _drawn(here, group, look, shelf, of := drawn_rows(branch, states)) | profiles_data(group, states, of)
        shown |= _moving(branch, here, group, folder / "modes.h5", look)
        traced = is_traced(branch, data["branches"])
        branches.append(shown | {"image": "" if traced else branch.get("image", "")})
    _clear_reactions(branches, data["natural"])
    own = {"branches": branches, "solids": list(map(_solid, shelf)), "start": [[*lengths].index(name), row]}
    return _common(stage.setting, shapes[name], look) | own


def _clear_reactions(branches: Sequence[dict[str, Any]], natural: Mapping[str, float]) -> None:
    """Leave out those that vanish in all rows, to round-off."""
    for name in [name for name in branches[0]["ordinates"] if name.startswith("reaction")]:
        size = natural.get("force" if name.startswith("reaction force") else "moment", 1.0)
        if all(abs(x or 0.0) < ZERO * size for branch in branches for x in branch["ordinates"][name]):
            for branch in branches:
                del branch["ordinates"][name]


def _moving(branch: Mapping[str, Any], shapes: Shapes, group: Any, path: Path, look: Look) -> dict[str, Any]:
    """Modes of a branch by its rows, those with error bars in the file ``path``, and why others have none."""
    name, modes = branch["name"], {}
    zeros = [0] * len(shapes.r) if "omega2" in branch["columns"] else branch["columns"]["zero"]
    typical = {each.row: each for each in typical_of(group)}
    exact = {row for other, row in rows_with_modes(path) if other == name}
    for row in sorted({*typical, *exact} & {*range(len(shapes.r))}):
        found, nodes = load_modes(path, name, row) if row in exact else typical[row].found, group["s"][row]
        if found is not None:
            shown = modes_of(found, nodes[np.isfinite(nodes)], zeros[row], rates=bool(branch.get("rates")))
            modes[row] = motions_of(shown, shapes, row, read_setting(group, row), look)
    missed = filter(attrgetter("trouble"), typical.values())
    return {"modes": modes, "missed": dict(map(attrgetter("row", "trouble"), missed))}


def drawn_rows(branch: Mapping[str, Any], states: int) -> list[int]:
    """Rows of a branch that are drawn: all, or of too many ``states`` each at least that is special, and every n-th."""
    rows, every = len(branch["columns"]["load"]), -(-states * LEAST // BUDGET)
    return sorted({*range(0, rows, every), rows - 1, *(special["row"] for special in branch["special"])})


def profiles_data(group: Any, states: int, rows: list[int]) -> dict[str, Any]:
    """Profiles of a branch: ``profile`` (D, M, 17), arclength, components of v, k, n, m along the directors, and these.

    ``element`` (D,) says how many of the M points an element has, which determine its polynomials, and 0 where some are
    left out; ``jumps`` (P,) are those of each of the four between elements.
    """
    found = [profiles_of(group, row) for row in range(len(group["load"]))]
    most = group[POINTS][0].size
    acting = [float(place.attrs["s"]) for kind in (SUPPORTS, CONSTRAINTS) for place in group.get(kind, {}).values()]
    kept = np.unique(np.linspace(0, most - 1, min(most, max(LEAST, BUDGET // states))).round().astype(int))
    out = np.full((len(found), most, 5 + 3 * len(PROFILES)), np.nan)
    for row, (place, one) in enumerate(zip(out, found, strict=True)):
        columns = [one.points.reshape(-1, 1), *(one.fields[symbol].reshape(-1, 3) for symbol in PROFILES)]
        columns.append(curve_at(group, row, one.points.ravel())[2])
        place[: one.points.size] = np.hstack(columns)
    element = [found[row].points.shape[1] * (len(kept) == most) for row in rows]
    jumps = {symbol: plain([one.jump(symbol, acting) for one in found]) for symbol in PROFILES}
    return {"profile": packed(out[rows][:, kept]), "element": element, "jumps": jumps}


def _drawn(shapes: Shapes, group: Any, look: Look, shelf: dict[tuple[str, str], int], few: list[int]) -> dict[str, Any]:
    """Shapes of a ``few`` rows, the nearest of these to each row, and the bodies of supports and loads."""
    found = [glyphs_of(read_setting(group, row), shapes.s, shapes[row], look) for row in range(len(shapes.r))]
    return {
        "shape": packed(np.concatenate([shapes.r, shapes.q], axis=2)[few]),
        "drawn": abs(np.arange(len(found))[:, None] - few).argmin(axis=1).tolist(),
        "bodies": [[shelf.setdefault((x.body, x.color), len(shelf)) for x in glyphs] for glyphs in found],
        "maps": packed(np.array([x.map for glyphs in found for x in glyphs]).reshape(-1, 12)),
    }


def _common(setting: Setting, shapes: Shapes, look: Look) -> dict[str, Any]:
    """Cross-sections, size and direction of the pictures, by the state that is shown first."""
    load = setting.force if setting.gravity is None else setting.gravity
    return {
        "s": packed(shapes.s),
        "outline": packed(_outline(shapes, setting, look, OUTLINE)),
        "stripe": packed(1.02 * _outline(shapes, setting, look, STRIPE)),
        "radius": look.radius,
        "size": float(shapes.s[-1] - shapes.s[0]),
        "axes": look.axes.tolist(),
        "loadDirection": None if load is None else (load / np.linalg.norm(load)).tolist(),
        "notes": list(setting.notes),
    }


def _outline(shapes: Shapes, setting: Setting, look: Look, angles: Floats) -> Floats:
    """Outline of the cross-sections (1, k, 2), or (S, k, 2) at the stations where they differ."""
    whole = look.radius * profile_of(shapes.s, setting.section, angles)
    return whole[:1] if np.ptp(whole, axis=0).max() < SAME_SPECIAL * look.radius else whole


def _solid(of: tuple[str, str]) -> dict[str, Any]:
    """A body in its colour; a box and a wedge have sharp edges."""
    (points, triangles), flat = body_of(of[0]), of[0] in ("box", "wedge")
    return {"points": packed(points), "triangles": triangles.ravel().tolist(), "colour": of[1], "flat": flat}


# --- shapes


def stations(nodes: int, states: int) -> int:
    """Number of stations for states with so many nodes, odd, so that the middle of the rod is one."""
    return max(LEAST, min(2 * nodes - 1, 241, BUDGET // max(states, 1))) | 1


@dataclass(frozen=True)
class Shapes:
    """P states at S stations: arclengths ``s`` (S,), centreline ``r`` (P, S, 3), unit quaternions ``q`` (P, S, 4)."""

    s: Floats
    r: Floats
    q: Floats

    def __getitem__(self, row: int) -> tuple[Floats, Floats]:
        """Centreline (S, 3) and directors (S, 3, 3), columns of each matrix, of a state."""
        return self.r[row], directors(self.q[row])


def shapes_of(group: Any, count: int) -> Shapes:
    """Read the states below the group of a branch at ``count`` stations, by splines through the nodes."""
    try:
        rows = [curve_at(group, row, count) for row in range(len(group["s"]))]
    except ValueError as trouble:  # of the splines
        sentence = f"{group.file.filename} has a state that is no curve in {group.name}: run the scene again."
        raise InputError(sentence) from trouble
    at, positions, quaternions = (np.array(part) for part in zip(*rows, strict=True))
    if SUPPORTS in group and not any(group.get(name) for name in (SUPPORTS, FOUNDATION, CONSTRAINTS)):
        positions = positions - positions.mean(axis=1, keepdims=True)
    return Shapes(at[0], positions, quaternions)


# --- modes


class DrawnMode(NamedTuple):
    """A mode with the bound of its ``error`` (nan: not estimated), and displacement and rotation (m, 3) at nodes ``s``.

    ``zero`` says that the count at the state has its eigenvalue among those that vanish, ``rates`` that it is of decay.
    """

    value: complex
    error: float
    motion: str
    s: Floats
    u: NDArray[Any]
    w: NDArray[Any]
    zero: bool = False
    rates: bool = False


def modes_of(found: Modes | Few, s: Floats, zeros: int, *, rates: bool) -> list[DrawnMode]:
    """Modes of one state at its nodes ``s`` in ascending order, symmetries last."""
    errors = getattr(found, "error", np.full(len(found.value), np.nan))
    each = zip(found.value, errors, found.motion, found.displacement, found.rotation, strict=True)
    shown = [DrawnMode(complex(mu), float(error), motion, s, u, w, rates=rates) for mu, error, motion, u, w in each]
    shown.sort(key=lambda mode: (mode.motion in (SYMMETRY, RIGID), mode.value.real))
    others = [mode for mode in shown if mode.motion != SYMMETRY]
    vanish = sorted(others, key=lambda mode: abs(mode.value))[: max(zeros - (len(shown) - len(others)), 0)]
    return [mode._replace(zero=any(mode is other for other in vanish)) for mode in shown]


def motions_of(
    modes: Sequence[DrawnMode], shapes: Shapes, row: int, setting: Setting, look: Look
) -> list[dict[str, Any]]:
    """Modes of the state in a ``row`` as the page has them, with the maps of its supports at an amplitude of one."""
    r, frames = shapes[row]
    span = float(np.linalg.norm(np.ptp(r, axis=0)))

    def moved(u: Floats, w: Floats) -> Any:
        turned = Rotation.from_rotvec(w).as_matrix() @ frames
        return packed([x.map for x in glyphs_of(setting, shapes.s, (r + u, turned), look, r)])

    out = []
    for mode in modes:
        u, w = (CubicSpline(mode.s, part)(shapes.s) for part in (mode.u, mode.w))
        size = drawn_size(u, w, span)
        parts = [(size * part(u), size * part(w)) for part in ([np.real, np.imag] if mode.value.imag else [np.real])]
        drawn = [packed(np.concatenate(part, axis=1)) for part in parts]
        out.append(_caption(mode) | {"parts": drawn, "maps": [moved(*part) for part in parts]})
    return out


def drawn_size(u: NDArray[Any], w: NDArray[Any], span: float) -> float:
    """Factor with which a mode of displacement ``u`` and rotation ``w`` (n, 3) is drawn, of a rod of size ``span``."""
    moved, turned = (float(np.linalg.norm(abs(part), axis=1).max()) for part in (u, w))
    return min(LARGEST[0] * span / max(moved, POINT * span), LARGEST[1] / max(turned, POINT))


def _caption(mode: DrawnMode) -> dict[str, Any]:
    """Eigenvalue, in words with its error, and what the motion does: ``zero``, ``grows`` or neither."""
    exact, known = mode.motion in (SYMMETRY, RIGID), bool(np.isfinite(mode.error))
    zero = exact or mode.zero or bool(abs(mode.value) <= np.nan_to_num(mode.error, posinf=0.0))
    mu = 0j if zero and (exact or not known) else mode.value
    root = exponent(mu, mode.rates)
    words = "0 (exact)" if exact else eigenvalue_in_words(mu, mode.error) if known else "0" * zero
    return {
        "value": [mu.real, mu.imag],
        "words": words,
        "motion": mode.motion,
        "root": [float(root.real), float(root.imag)],
        "kind": "zero" if zero else "grows" if root.real > GROWTH * abs(root) else "swings",
    }

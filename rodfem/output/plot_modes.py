"""Pictures of modes, drawn from ``modes.h5`` alone: the equilibrium in grey, the rod in its mode over it."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rodfem.modes.modes import SYMMETRY, Modes, exponent, heading, load_modes, load_setting
from rodfem.output.glyphs import POINT, Glyph, Look, Solid, between, glyphs_of, striped
from rodfem.output.render import axes_of, axis_of
from rodfem.output.states import curve_of
from rodfem.output.style import DPI, FREE, GROWS, REST, STYLE, SWINGS
from rodfem.output.words import eigenvalue_in_words
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import Setting
from rodfem.tolerances import TINY
from rodfem.whole_files import draft_of

Floats = NDArray[np.float64]
Pose = tuple[Floats, Floats]  # centreline (n, 3) and directors (n, 3, 3)
PANEL, TITLES = (4.0, 2.75), 0.8  # inches; those that titles take above a panel
LARGEST = 0.14, 0.9
"""Drawn displacement over the rod's size, and rotation in radian, of which the one that is reached first holds."""
GROWTH = 1e-9  # real part of the root of -mu, relative to it, above which a mode grows


def draw_modes(path: Path, branch: str, row: int, output: Path) -> Path:
    """Draw the modes of one state of a file ``modes.h5``, each in a panel of its own; returns ``output``."""
    modes, setting, output = load_modes(path, branch, row), load_setting(path, branch, row), Path(output)
    count = len(modes.value)
    columns = min(3, count) if count != 4 else 2
    rows = ceil(count / columns)
    with rc_context(STYLE | {"axes.grid": False}), draft_of(output) as draft:
        figure = Figure(figsize=(columns * PANEL[0], rows * PANEL[1] + 0.5), dpi=DPI)
        figure.subplots_adjust(0.01, 0.01, 0.99, 1 - (TITLES + 0.4) / (rows * PANEL[1] + 0.5), 0.04, 0.36)
        words, top = f"{heading(path)}{branch}, load {modes.load:.6g}", 1 - 0.1 / figure.get_figheight()
        figure.suptitle(words, fontsize=14, y=top, va="top")
        for n in range(count):
            _Panel(figure.add_subplot(rows, columns, n + 1), modes, setting, n).draw()
        figure.savefig(draft)
    return output


def drawn_size(u: NDArray[Any], w: NDArray[Any], span: float) -> float:
    """Factor with which a mode of displacement ``u`` and rotation ``w`` (n, 3) is drawn, of a rod of size ``span``."""
    moved, turned = (float(np.linalg.norm(abs(part), axis=1).max()) for part in (u, w))
    return min(LARGEST[0] * span / max(moved, POINT * span), LARGEST[1] / max(turned, POINT))


class _Panel:
    """One mode in its axes, seen across the plane in which most of it happens."""

    def __init__(self, axes: Axes, modes: Modes, setting: Setting, number: int) -> None:
        self.axes, self.setting = axes, setting
        self.s = s = np.linspace(modes.s[0], modes.s[-1], 100)
        self.r, turned = curve_of(modes.s, modes.r, modes.q, s)
        self.frames, self.span = directors(turned), float(np.linalg.norm(np.ptp(self.r, axis=0)))
        u, w = (CubicSpline(modes.s, part[number].astype(complex))(s) for part in (modes.displacement, modes.rotation))
        size, self.radius = drawn_size(u, w, self.span), min(self.span, s[-1] - s[0]) / 65
        self.u, self.w = size * u, size * w
        self.color = self._title(modes, number)

    def _title(self, modes: Modes, number: int) -> str:
        """Write eigenvalue and motion above the picture, in the colour of what the mode does, which is returned."""
        mu, error, motion = complex(modes.value[number]), modes.error[number], modes.motion[number]
        root = exponent(mu, modes.rates)
        free = motion == SYMMETRY or bool(abs(mu) <= np.nan_to_num(error, posinf=0.0))
        color = FREE if free else GROWS if root.real > GROWTH * abs(root) else SWINGS
        what = {FREE: "zero", SWINGS: "stable", GROWS: "unstable" if mu.imag == 0 else "flutter"}[color]
        words = f"{number + 1}: $\\mu$ = {eigenvalue_in_words(mu, error)}\n{what}: {motion}"
        self.axes.set_title(words, fontsize=12.5, color=color)
        return color

    def draw(self) -> None:
        """Draw the rod at rest, and at its greatest amplitude with all that goes along."""
        view = self._view()
        states = [self._moved(factor) for factor in (1.0, -1.0, 1.0j, -1.0j)]
        look = Look(self.radius, view)
        glyphs = [glyphs_of(self.setting, self.s, state, look, self.r) for state in states]
        solids = [each for state, held in zip(states, glyphs, strict=True) for each in (*self._rod(state, REST), *held)]
        self._limit(np.concatenate([solid.points for solid in solids]) @ view[:2].T, view)
        self._show(self._rod((self.r, self.frames), REST), view, 0)
        self._show(glyphs[0], view, 0.5)
        self._show(self._rod(states[0], self.color), view, 1)
        self.axes.set_aspect("equal")
        self.axes.set_axis_off()

    def _view(self) -> Floats:
        """Axes of the picture, (3, 3); the sign of the mode is chosen, too: upwards at its greatest amplitude."""
        moved = self.u.imag if np.linalg.norm(self.u.imag) > np.linalg.norm(self.u.real) else self.u.real
        axis, off = axis_of(self.setting, self.r), self.r - self.r[0]
        off = off - np.outer(off @ axis, axis) / max(axis @ axis, TINY)
        most = off[np.argmax(np.linalg.norm(off, axis=1))]
        bent = self.setting.force is None and np.linalg.norm(most) > 0.05 * self.span
        view = axes_of(self.setting, self.r, moved, self.frames[0], most if bent else None)
        raised = moved @ view[1]
        if raised[np.argmax(abs(raised))] < 0.0:
            self.u, self.w = -self.u, -self.w
        return view

    def _limit(self, seen: Floats, view: Floats) -> None:
        """Set limits around all that is seen (n, 2), and draw the directions e1, e2, e3 in a corner."""
        low, high = seen.min(axis=0) - self.radius, seen.max(axis=0) + self.radius
        low[0] -= 0.15 * (high - low)[0]  # room for the directions
        shape = np.array([PANEL[0], PANEL[1] - TITLES])
        grown = (shape * ((high - low) / shape).max() - (high - low)) / 2
        low, high = low - grown, high + grown
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        size = 0.07 * (high - low)[0]
        corner, names = low + 1.6 * size, dict[tuple[float, ...], list[str]]()
        for i, way in enumerate(view[:2].T):
            self.axes.plot(*np.stack([corner, corner + size * way], axis=1), color="0.45", lw=1.2)
            if np.linalg.norm(way) > 0.5:
                names.setdefault(tuple(np.round(way, 0)), []).append(f"e{i + 1}")
        for key, words in names.items():  # directions that look alike share a label
            place = corner + 1.5 * size * np.array(key) / np.linalg.norm(key)
            self.axes.text(*place, ", ".join(words), fontsize=10, color="0.35", ha="center", va="center")

    def _moved(self, factor: complex) -> Pose:
        """Centreline and directors of the rod in its mode, of a complex amplitude."""
        u, w = np.real(self.u * factor), np.real(self.w * factor)
        return self.r + u, Rotation.from_rotvec(w).as_matrix() @ self.frames

    def _rod(self, pose: Pose, color: str) -> list[Solid | Glyph]:
        """Rod with a stripe along d1, and with teeth along d1 where the mode turns it only."""
        dark, (centres, frames) = to_hex(0.4 * np.array(to_rgb(color))), pose
        combed = np.linalg.norm(abs(self.u), axis=1).max() < 0.5 * LARGEST[0] * self.span
        nodes = np.linspace(0, len(centres) - 1, 17).round().astype(int)[1 : -1 if combed else 1]
        tips = centres + 6.0 * self.radius * frames[:, :, 0]
        teeth = [between("bar", centres[i], tips[i], 0.12 * self.radius, dark) for i in nodes]
        return [*striped((self.s, centres, frames), self.setting.section, self.radius, (color, dark), 12), *teeth]

    def _show(self, solids: Sequence[Solid | Glyph], view: Floats, order: float) -> None:
        """Show the triangles of solids that face the viewer, far ones first, lit from above."""
        corners = np.concatenate([np.empty((0, 3, 3)), *(x.points[x.triangles] for x in solids)]) @ view.T
        colors = np.concatenate([np.empty((0, 3)), *(np.tile(to_rgb(x.color), (len(x.triangles), 1)) for x in solids)])
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        across = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), TINY)
        light = 0.55 + 0.45 * np.clip(across @ np.array([-0.25, 0.75, 0.6]), 0, 1)
        near = np.argsort(corners[:, :, 2].mean(axis=1))
        near = near[across[near, 2] > 0]
        shades = (colors * light[:, None])[near]
        drawn = PolyCollection(corners[near, :, :2], facecolors=shades, edgecolors=shades, linewidths=0.3, zorder=order)
        self.axes.add_collection(drawn, autolim=False)

"""Pictures and animations of modes, drawn from ``modes.h5`` alone: the equilibrium in grey, the moving rod over it."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
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
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import Setting
from rodfem.tolerances import TINY
from rodfem.whole_files import draft_of

Floats = NDArray[np.float64]
PANEL, TITLES = (4.0, 2.75), 0.8  # inches; those that titles take above a panel
LARGEST = 0.14, 0.9
"""Drawn displacement over the rod's size, and rotation in radian, of which the one that is reached first holds."""
FRAMES, RISING = 60, 0.8
"""Pictures of an animation, and the share of its time in which a mode grows; in the rest it goes back, pale."""
GROWTH = 1e-9  # real part of the root of -mu, relative to it, above which a mode grows


def draw_modes(path: Path, branch: str, row: int, output: Path) -> Path:
    """Draw the modes of one state of a file ``modes.h5``, each in a panel of its own; returns ``output``.

    If its suffix is .gif it is an animation, in which unstable modes grow like ``exp(sqrt(-mu) t)``, then go back, and
    stable ones oscillate, each in a time of its own.
    """
    modes, setting, output = load_modes(path, branch, row), load_setting(path, branch, row), Path(output)
    count = len(modes.value)
    columns = min(3, count) if count != 4 else 2
    rows, moving = ceil(count / columns), output.suffix.lower() == ".gif"
    with rc_context(STYLE | {"axes.grid": False}), draft_of(output) as draft:
        figure = Figure(figsize=(columns * PANEL[0], rows * PANEL[1] + 0.5), dpi=2 * DPI // 3 if moving else DPI)
        FigureCanvasAgg(figure)
        figure.subplots_adjust(0.01, 0.01, 0.99, 1 - (TITLES + 0.4) / (rows * PANEL[1] + 0.5), 0.04, 0.36)
        words, top = f"{heading(path)}{branch}, load {modes.load:.6g}", 1 - 0.1 / figure.get_figheight()
        figure.suptitle(words, fontsize=14, y=top, va="top")
        panels = [_Panel(figure.add_subplot(rows, columns, n + 1), modes, setting, n) for n in range(count)]
        if moving:
            _animate(figure, panels, draft)
        else:
            for panel in panels:
                panel.draw()
            figure.savefig(draft)
    return output


def _animate(figure: Figure, panels: Sequence[_Panel], path: Path) -> None:
    writer = PillowWriter(fps=20)
    with writer.saving(figure, str(path), figure.dpi):
        for frame in range(FRAMES):
            for panel in panels:
                panel.draw(frame / FRAMES)
            writer.grab_frame()


def amplitude(root: complex, grows: bool, time: float) -> complex:
    """Amplitude of a mode ``exp(root t)`` in the loop of its animation, of period 1 in ``time``; the greatest is 1."""
    if not grows:
        return complex(np.cos(2 * np.pi * time))
    most = np.log(1 / 0.06) / root.real  # from a faint amplitude on
    if root.imag:
        most = min(most, 4 * np.pi / abs(root.imag))  # two periods
    back = max(0.0, time - RISING) / (1 - RISING)
    grown = np.exp(root * most * (min(time / RISING, 1.0) - 1))
    return complex(grown + back**2 * (3 - 2 * back) * (np.exp(-root * most) - grown))


def drawn_size(u: NDArray[Any], w: NDArray[Any], span: float) -> float:
    """Factor with which a mode of displacement ``u`` and rotation ``w`` (n, 3) is drawn, of a rod of size ``span``."""
    moved, turned = (float(np.linalg.norm(abs(part), axis=1).max()) for part in (u, w))
    return min(LARGEST[0] * span / max(moved, POINT * span), LARGEST[1] / max(turned, POINT))


class _Panel:
    """One mode in its axes, seen across the plane in which most of it happens."""

    def __init__(self, axes: Axes, modes: Modes, setting: Setting, number: int) -> None:
        self.axes, self.setting, self.shown = axes, setting, list[PolyCollection]()
        self.s = s = np.linspace(modes.s[0], modes.s[-1], 100)
        self.r, turned = curve_of(modes.s, modes.r, modes.q, s)
        self.frames = directors(turned)
        u, w = (CubicSpline(modes.s, part[number].astype(complex))(s) for part in (modes.displacement, modes.rotation))
        span, mu, error = (
            float(np.linalg.norm(np.ptp(self.r, axis=0))),
            complex(modes.value[number]),
            modes.error[number],
        )
        size, self.radius = drawn_size(u, w, span), min(span, s[-1] - s[0]) / 65
        self.u, self.w = size * u, size * w
        self.combed = np.linalg.norm(abs(self.u), axis=1).max() < 0.5 * LARGEST[0] * span
        self.root = exponent(mu, modes.rates)
        free = modes.motion[number] == SYMMETRY or abs(mu) <= (error if np.isfinite(error) else 0.0)
        self.color = FREE if free else GROWS if self.root.real > GROWTH * abs(self.root) else SWINGS
        doubt = f" ({error:.0e})" if np.isfinite(error) else ""
        value = f"{mu.real:.6g}" if mu.imag == 0 else f"{mu.real:.5g} {'+' if mu.imag > 0 else '-'} {abs(mu.imag):.5g}i"
        what = {FREE: "zero", SWINGS: "stable", GROWS: "unstable" if mu.imag == 0 else "flutter"}[self.color]
        words = f"{number + 1}: $\\mu$ = {value}{doubt}\n{what}: {modes.motion[number]}"
        axes.set_title(words, fontsize=12.5, color=self.color)
        self._look(span)
        self._show(self._rod(self.r, self.frames, REST), 0)
        axes.set_aspect("equal")
        axes.set_axis_off()

    def _look(self, span: float) -> None:
        """Choose the axes of the picture, the limits, and the sign of the mode: upwards at its greatest amplitude."""
        moved = self.u.imag if np.linalg.norm(self.u.imag) > np.linalg.norm(self.u.real) else self.u.real
        axis, off = axis_of(self.setting, self.r), self.r - self.r[0]
        off = off - np.outer(off @ axis, axis) / max(axis @ axis, TINY)
        most = off[np.argmax(np.linalg.norm(off, axis=1))]
        bent = self.setting.force is None and np.linalg.norm(most) > 0.05 * span
        view = axes_of(self.setting, self.r, moved, self.frames[0], most if bent else None)
        self.look, raised = Look(self.radius, view), moved @ view[1]
        if raised[np.argmax(abs(raised))] < 0.0:
            self.u, self.w = -self.u, -self.w
        states = [self._moved(factor) for factor in (1.0, -1.0, 1.0j, -1.0j)]
        points = [solid.points for state in states for solid in [*self._rod(*state, REST), *self._glyphs(*state)]]
        seen = np.concatenate(points) @ view[:2].T
        low, high = seen.min(axis=0) - self.radius, seen.max(axis=0) + self.radius
        low[0] -= 0.15 * (high - low)[0]  # room for the triad
        shape = np.array([PANEL[0], PANEL[1] - TITLES])
        grown = (shape * ((high - low) / shape).max() - (high - low)) / 2
        low, high = low - grown, high + grown
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        self._triad(low, 0.07 * (high - low)[0])

    def _triad(self, corner: Floats, size: float) -> None:
        """The directions e1, e2, e3, near a corner; directions that look alike share a label."""
        corner, names = corner + 1.6 * size, dict[tuple[float, ...], list[str]]()
        for i, way in enumerate(self.look.axes[:2].T):
            self.axes.plot(*np.stack([corner, corner + size * way], axis=1), color="0.45", lw=1.2)
            if np.linalg.norm(way) > 0.5:
                names.setdefault(tuple(np.round(way, 0)), []).append(f"e{i + 1}")
        for key, words in names.items():
            place = corner + 1.5 * size * np.array(key) / np.linalg.norm(key)
            self.axes.text(*place, ", ".join(words), fontsize=10, color="0.35", ha="center", va="center")

    def _moved(self, factor: complex) -> tuple[Floats, Floats]:
        """Centreline and directors of the rod in its mode, of a complex amplitude."""
        u, w = np.real(self.u * factor), np.real(self.w * factor)
        return self.r + u, Rotation.from_rotvec(w).as_matrix() @ self.frames

    def _glyphs(self, r: Floats, frames: Floats) -> list[Glyph]:
        """What holds and loads the rod: it goes along where it moves with the rod."""
        return glyphs_of(self.setting, self.s, (r, frames), self.look, self.r)

    def draw(self, time: float | None = None) -> None:
        """Draw the rod at a time of the loop, from 0 to 1; None: at its greatest amplitude."""
        for drawn in self.shown:
            drawn.remove()
        grows = self.color == GROWS
        r, frames = self._moved(1.0 if time is None else amplitude(self.root, grows, time))
        pale = 0.6 if grows and time is not None and time > RISING else 0.0
        color = to_hex((1 - pale) * np.array(to_rgb(self.color)) + pale * np.array(to_rgb(REST)))
        self.shown = [self._show(self._glyphs(r, frames), 0.5), self._show(self._rod(r, frames, color), 1)]

    def _rod(self, centres: Floats, frames: Floats, color: str) -> list[Solid | Glyph]:
        """Rod with a stripe along d1, and with teeth along d1 where the mode turns it only."""
        dark = to_hex(0.4 * np.array(to_rgb(color)))
        nodes = np.linspace(0, len(centres) - 1, 17).round().astype(int)[1 : -1 if self.combed else 1]
        tips = centres + 6.0 * self.radius * frames[:, :, 0]
        teeth = [between("bar", centres[i], tips[i], 0.12 * self.radius, dark) for i in nodes]
        return [*striped((self.s, centres, frames), self.setting.section, self.radius, (color, dark), 12), *teeth]

    def _show(self, solids: Sequence[Solid | Glyph], order: float) -> PolyCollection:
        """Show the triangles of solids that face the viewer, far ones first, lit from above."""
        corners = np.concatenate([np.empty((0, 3, 3)), *(x.points[x.triangles] for x in solids)]) @ self.look.axes.T
        colors = np.concatenate([np.empty((0, 3)), *(np.tile(to_rgb(x.color), (len(x.triangles), 1)) for x in solids)])
        across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        across = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), TINY)
        light = 0.55 + 0.45 * np.clip(across @ np.array([-0.25, 0.75, 0.6]), 0, 1)
        near = np.argsort(corners[:, :, 2].mean(axis=1))
        near = near[across[near, 2] > 0]
        shades = (colors * light[:, None])[near]
        drawn = PolyCollection(corners[near, :, :2], facecolors=shades, edgecolors=shades, linewidths=0.3, zorder=order)
        return self.axes.add_collection(drawn, autolim=False)

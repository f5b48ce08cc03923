"""Pictures and animations of modes, drawn from ``modes.h5`` alone: the equilibrium in grey, the moving rod over it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.animation import PillowWriter
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rodfem.errors import InputError
from rodfem.modes.modes import SYMMETRY, Modes, heading, load_modes, load_setting
from rodfem.output.glyphs import Look, glyphs_of
from rodfem.output.program import status_of, terse
from rodfem.output.solids import Glyph, curve_of, profile_of
from rodfem.output.style import DPI, FREE, GROWS, REST, STYLE, SWINGS
from rodfem.output.view import POINT, axes_of, axis_of
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import Setting
from rodfem.tolerances import TINY
from rodfem.whole_files import draft_of

__all__ = ["draw_modes", "main"]

Floats = NDArray[np.float64]
PANEL, COLUMNS, TITLES = (4.0, 2.75), 3, 0.8  # inches; those that titles take above a panel
LARGEST = 0.14, 0.9
"""Drawn displacement over the rod's size, and rotation in radian, of which the one that is reached first holds."""
POINTS, SIDES, SLENDER = (240, 100), (14, 10), 65.0
"""Points along and around a tube, in a picture and in an animation; the rod's size over the tube's radius."""
FRAMES, RATE, PERIODS, FAINTEST, RISING = 60, 20, 2.0, 0.06, 0.8
"""Of an animation: pictures, pictures a second, periods of an oscillation, amplitude at which a growing mode starts,
and the share of the time in which it grows; in the rest it goes back, pale, so that the loop joins."""
TEETH, BENT = 15, 0.05
"""Lines along d1 where a mode hardly displaces the rod; deflection of a rod, over its size, that is one."""
GROWTH = 1e-9
"""Real part of the root of -mu, relative to it, above which a mode grows."""


def draw_modes(path: Path, branch: str, row: int, output: Path, chosen: Sequence[int] = ()) -> Path:
    """Draw the modes of one state, each in a panel of its own.

    ``path`` is the file ``modes.h5``, ``branch`` and ``row`` the state, as in ``states.h5``.  ``output`` is the picture
    to write, and to return; an animation where its suffix is .gif, in which unstable modes grow like
    ``exp(sqrt(-mu) t)``, then go back, and stable ones oscillate, each in a time of its own: its end joins its
    beginning.  ``chosen`` are numbers of modes, from 1 on; all where none is given.  Raises :class:`InputError` if the
    file has no such modes.
    """
    modes, setting, output = load_modes(path, branch, row), load_setting(path, branch, row), Path(output)
    count = len(modes.value)
    for number in chosen:
        if not 1 <= number <= count:
            raise InputError(f"There is no mode {number} of {branch!r}, row {row}: choose 1 to {count}.")
    numbers = [n - 1 for n in chosen] or list(range(count))
    columns = min(COLUMNS, len(numbers)) if len(numbers) != 4 else 2
    rows = ceil(len(numbers) / columns)
    moving = output.suffix.lower() == ".gif"
    with rc_context(STYLE | {"axes.grid": False}), draft_of(output) as draft:
        figure = Figure(figsize=(columns * PANEL[0], rows * PANEL[1] + 0.5), dpi=2 * DPI // 3 if moving else DPI)
        FigureCanvasAgg(figure)
        figure.subplots_adjust(0.01, 0.01, 0.99, 1 - (TITLES + 0.4) / (rows * PANEL[1] + 0.5), 0.04, 0.36)
        figure.suptitle(
            f"{heading(path)}{branch}, load {modes.load:.6g}", fontsize=14, y=1 - 0.1 / figure.get_figheight(), va="top"
        )
        places = [figure.add_subplot(rows, columns, i + 1) for i in range(len(numbers))]
        panels = [_Panel(axes, modes, setting, n, moving) for axes, n in zip(places, numbers, strict=True)]
        if not moving:
            for panel in panels:
                panel.draw()
            figure.savefig(draft)
            return output
        writer = PillowWriter(fps=RATE)
        writer.setup(figure, str(draft), figure.dpi)
        for frame in range(FRAMES):
            for panel in panels:
                panel.draw(frame / FRAMES)
            writer.grab_frame()
        writer.finish()
    return output


def amplitude(root: complex, grows: bool, time: float) -> complex:
    """Amplitude of a mode ``exp(root t)`` in the loop of its animation, of period 1 in ``time``; the greatest is 1.

    One that grows does so, then goes back; any other oscillates.
    """
    if not grows:
        return complex(np.cos(2 * np.pi * time))
    most = np.log(1 / FAINTEST) / root.real
    if root.imag:
        most = min(most, PERIODS * 2 * np.pi / abs(root.imag))
    back = max(0.0, time - RISING) / (1 - RISING)
    grown = np.exp(root * most * (min(time / RISING, 1.0) - 1))
    return complex(grown + back**2 * (3 - 2 * back) * (np.exp(-root * most) - grown))


def drawn_size(u: NDArray[Any], w: NDArray[Any], span: float) -> float:
    """Factor with which a mode of displacement ``u`` and rotation ``w`` (n, 3) is drawn, of a rod of size ``span``."""
    moved, turned = (float(np.linalg.norm(abs(part), axis=1).max()) for part in (u, w))
    return min(LARGEST[0] * span / max(moved, POINT * span), LARGEST[1] / max(turned, POINT))


class _Panel:
    """One mode in its axes, seen across the plane in which most of it happens."""

    def __init__(self, axes: Axes, modes: Modes, setting: Setting, number: int, moving: bool) -> None:
        self.axes, self.sides, self.setting = axes, SIDES[moving], setting
        self.shown: list[Collection] = []
        s, mu = modes.s, complex(modes.value[number])
        self.s = fine = np.linspace(s[0], s[-1], POINTS[moving])
        self.r, turned = curve_of(s, modes.r, modes.q, fine)
        self.frames = directors(turned)
        u, w = (CubicSpline(s, part[number].astype(complex))(fine) for part in (modes.displacement, modes.rotation))
        span = float(np.linalg.norm(np.ptp(self.r, axis=0)))
        size = drawn_size(u, w, span)
        self.u, self.w, self.radius = size * u, size * w, min(span, s[-1] - s[0]) / SLENDER
        self.combed = size * np.linalg.norm(abs(u), axis=1).max() < 0.5 * LARGEST[0] * span
        self.root = np.sqrt(-mu)
        zero = abs(mu) <= (modes.error[number] if np.isfinite(modes.error[number]) else 0.0)
        self.free = modes.motion[number] == SYMMETRY or zero
        self.color = FREE if self.free else GROWS if self.root.real > GROWTH * abs(self.root) else SWINGS
        self._title(modes, number, mu)
        angles = np.linspace(0, 2 * np.pi, self.sides + 1) - np.pi / self.sides
        self.profile = self.radius * profile_of(fine, setting.section, angles)
        self._look(span)
        self._rod(self.r, self.frames, REST, 0)
        self._triad()
        axes.set_xlim(*self.limits[0])
        axes.set_ylim(*self.limits[1])
        axes.set_aspect("equal")
        axes.set_axis_off()

    def _title(self, modes: Modes, number: int, mu: complex) -> None:
        kind, error = modes.motion[number], float(modes.error[number])
        doubt = f" ({error:.0e})" if np.isfinite(error) else ""
        value = f"{mu.real:.6g}" if mu.imag == 0 else f"{mu.real:.5g} {'+' if mu.imag > 0 else '-'} {abs(mu.imag):.5g}i"
        what = {FREE: "zero", SWINGS: "stable", GROWS: "unstable" if mu.imag == 0 else "flutter"}[self.color]
        self.axes.set_title(f"{number + 1}: $\\mu$ = {value}{doubt}\n{what}: {kind}", fontsize=12.5, color=self.color)

    def _look(self, span: float) -> None:
        """Choose the axes (see :func:`rodfem.output.view.axes_of`), the limits, and the sign of the mode.

        It goes upwards at its greatest amplitude.
        """
        moved = self.u.imag if np.linalg.norm(self.u.imag) > np.linalg.norm(self.u.real) else self.u.real
        axis, off = axis_of(self.setting, self.r), self.r - self.r[0]
        off = off - np.outer(off @ axis, axis) / max(axis @ axis, TINY)
        most = off[np.argmax(np.linalg.norm(off, axis=1))]
        bent = self.setting.force is None and np.linalg.norm(most) > BENT * span
        self.view = axes_of(self.setting, self.r, moved, self.frames[0], most if bent else None)
        raised = moved @ self.view[1]
        if raised[np.argmax(abs(raised))] < 0.0:
            self.u, self.w = -self.u, -self.w
        points = []
        for factor in (1.0, -1.0, 1.0j, -1.0j):
            r, frames = self._moved(factor)
            points += [r, *(solid.points for solid in self._glyphs(r, frames))]
        seen = np.concatenate(points) @ self.view[:2].T
        low, high = seen.min(axis=0) - 3 * self.radius, seen.max(axis=0) + 3 * self.radius
        low[0] -= 0.15 * (high - low)[0]  # room for the triad
        middle, half = (low + high) / 2, (high - low) / 2
        half = np.maximum(
            half, half[::-1] * np.array([PANEL[0], PANEL[1] - TITLES]) / np.array([PANEL[1] - TITLES, PANEL[0]])
        )
        self.limits = np.stack([middle - half, middle + half], axis=1)

    def _moved(self, factor: complex) -> tuple[Floats, Floats]:
        """Centreline and directors of the rod in its mode, of a complex amplitude."""
        u, w = np.real(self.u * factor), np.real(self.w * factor)
        return self.r + u, Rotation.from_rotvec(w).as_matrix() @ self.frames

    def _glyphs(self, r: Floats, frames: Floats) -> list[Glyph]:
        """What holds and loads the rod: it goes along where it moves with the rod."""
        return glyphs_of(self.setting, self.s, (r, frames), Look(self.radius, self.view), self.r)

    def draw(self, time: float | None = None) -> None:
        """Draw the rod at a time of the loop, from 0 to 1; None: at its greatest amplitude."""
        for drawn in self.shown:
            drawn.remove()
        grows = self.color == GROWS
        r, frames = self._moved(1.0 if time is None else amplitude(self.root, grows, time))
        pale = 0.6 if grows and time is not None and time > RISING else 0.0
        color = (1 - pale) * np.array(to_rgb(self.color)) + pale * np.array(to_rgb(REST))
        self.shown = self._rod(r, frames, color, 1)
        if solids := self._glyphs(r, frames):
            corners = np.concatenate([solid.points[solid.triangles] for solid in solids]) @ self.view.T
            colors = np.concatenate([np.tile(to_rgb(x.color), (len(x.triangles), 1)) for x in solids])
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            self.shown.append(self._facets(corners, across, colors, 0.5))

    def _rod(self, centres: Floats, frames: Floats, color: ArrayLike, order: int) -> list[Collection]:
        """Rod, with a comb along d1 where the mode turns it only: its teeth are lines before the rod and behind it."""
        drawn: list[Collection] = [self._tube(centres, frames, color, order)]
        if self.combed:
            nodes = np.linspace(0, len(centres) - 1, TEETH + 2).round().astype(int)[1:-1]
            seen, d1 = centres[nodes] @ self.view.T, frames[nodes, :, 0] @ self.view.T
            front = d1[:, 2] > 0
            for chosen, place in ((front, order + 0.2), (~front, order - 0.2)):
                ends = np.stack([seen[chosen], seen[chosen] + 6.0 * self.radius * d1[chosen]], axis=1)
                lines = LineCollection(
                    list(ends[..., :2]), colors=[0.6 * np.array(to_rgb(color))], lw=1.2, zorder=place
                )
                self.axes.add_collection(lines)
                drawn.append(lines)
        return drawn

    def _tube(self, centres: Floats, frames: Floats, color: ArrayLike, order: int) -> PolyCollection:
        """Rod with a stripe along d1."""
        surface = centres[:, None] + np.einsum("nij,nkj->nki", frames[:, :, :2], self.profile)
        surface = surface @ self.view.T
        corners = np.stack([surface[:-1, :-1], surface[1:, :-1], surface[1:, 1:], surface[:-1, 1:]], axis=2)
        across = np.cross(corners[:, :, 2] - corners[:, :, 0], corners[:, :, 1] - corners[:, :, 3])
        base = np.tile(np.array(to_rgb(color)), (*across.shape[:2], 1))
        base[:, 0] *= 0.35  # the stripe
        return self._facets(corners.reshape(-1, 4, 3), across.reshape(-1, 3), base.reshape(-1, 3), order)

    def _facets(self, corners: Floats, across: Floats, colors: Floats, order: float) -> PolyCollection:
        """Facets (n, k, 3) that face the viewer, far ones first, lit from above; ``across`` is their normal (n, 3)."""
        across = across / np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), TINY)
        light = 0.55 + 0.45 * np.clip(across @ np.array([-0.25, 0.75, 0.6]), 0, 1)
        near = np.argsort(corners[:, :, 2].mean(axis=1))
        near = near[across[near, 2] > 0]
        shades = np.clip(colors * light[:, None], 0, 1)[near]
        drawn = PolyCollection(corners[near, :, :2], facecolors=shades, edgecolors=shades, linewidths=0.3, zorder=order)
        self.axes.add_collection(drawn)
        return drawn

    def _triad(self) -> None:
        """The directions e1, e2, e3, in the lower left corner; directions that look alike share a label."""
        size = 0.07 * np.ptp(self.limits[0])
        corner = self.limits[:, 0] + 1.6 * size
        labels: list[tuple[Floats, list[str]]] = []
        for i, axis in enumerate(self.view[:2].T):
            self.axes.plot(*np.stack([corner, corner + size * axis], axis=1), color="0.45", lw=1.2, zorder=3)
            if np.linalg.norm(axis) > 0.5:
                place = next((names for at, names in labels if np.linalg.norm(at - axis) < 0.5), None)
                if place is None:
                    labels.append((axis, place := []))
                place.append(f"e{i + 1}")
        for axis, names in labels:
            self.axes.text(*(corner + 1.5 * size * axis), ", ".join(names), fontsize=10, color="0.35", ha="center",
                           va="center", zorder=3)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw the modes named on the command line; returns 0, or 2 after one sentence on standard error."""
    parser = terse(
        argparse.ArgumentParser(prog="python -m rodfem.output.plot_modes", description="Draw the modes of a state.")
    )
    parser.add_argument("modes", type=Path, help="modes.h5 of a run with --modes")
    parser.add_argument("--branch", required=True, help="name of the branch")
    parser.add_argument("--row", required=True, type=int, help="row of the state, as in states.h5")
    parser.add_argument("--mode", type=int, nargs="+", default=[], help="numbers of modes, from 1 on (default all)")
    parser.add_argument("--output", type=Path, default=Path("modes.png"), help=".png, .pdf, .svg; .gif: an animation")
    given = parser.parse_args(arguments)
    return status_of(lambda: draw_modes(given.modes, given.branch, given.row, given.output, given.mode), given.modes)


if __name__ == "__main__":
    sys.exit(main())

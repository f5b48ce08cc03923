"""Modes of ``modes.h5`` as the page animates them: displacement and rotation of a drawn size, and moving supports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rodfem.modes.modes import SYMMETRY, Modes, load_modes
from rodfem.output.glyphs import glyphs_of
from rodfem.output.plot_modes import GROWTH, LARGEST
from rodfem.output.view import POINT
from rodfem.problem.setting import Setting
from rodfem.report.bodies import Shelf
from rodfem.report.packing import packed
from rodfem.report.readings import eigenvalue_in_words
from rodfem.report.shapes import Shapes
from rodfem.report.stage import Stage

Floats = NDArray[np.float64]

EXACT = "0 (exact)"
"""Eigenvalue of a symmetry."""


def motions_of(
    path: Path,
    place: tuple[str, int],
    shapes: Shapes,
    setting: Setting,
    stage: Stage,
    shelf: Shelf,
    bodies: Sequence[int],
) -> list[dict[str, Any]]:
    """Modes of one state, with the maps of its supports at an amplitude of one.

    Parameters
    ----------
    path, place
        The file, and the branch and row in it.
    shapes, setting
        States of the branch, and what holds and loads this one.
    stage, shelf
        Size and direction of the picture, and the bodies of all supports.
    bodies
        Numbers of those of this state.
    """
    modes, (r, frames) = load_modes(path, *place), shapes[place[1]]
    span = float(np.linalg.norm(np.ptp(r, axis=0)))

    def moved(u: Floats, w: Floats) -> Any:
        turned = Rotation.from_rotvec(w).as_matrix() @ frames
        solids = glyphs_of(setting, shapes.s, r + u, turned, stage.radius, stage.axes, r)
        return packed([shelf.fitted(body, solid) for body, solid in zip(bodies, solids, strict=False)])

    out = []
    for number in range(len(modes.value)):
        u, w = (
            CubicSpline(modes.s, part[number].astype(complex))(shapes.s)
            for part in (modes.displacement, modes.rotation)
        )
        size = min(
            LARGEST[0] * span / max(_largest(u), POINT * span),
            LARGEST[1] / max(_largest(w), POINT),
        )
        parts = [np.real, np.imag] if np.iscomplexobj(modes.value) and modes.value[number].imag else [np.real]
        out.append(
            _about(modes, number)
            | {"parts": [packed(size * np.concatenate([part(u), part(w)], axis=1)) for part in parts]}
            | {"maps": [moved(size * part(u), size * part(w)) for part in parts]}
        )
    return out


def _about(modes: Modes, number: int) -> dict[str, Any]:
    """Eigenvalue, in words with its error, and what the motion does: ``zero``, ``grows`` or neither."""
    mu, error = complex(modes.value[number]), float(modes.error[number])
    known = bool(np.isfinite(error))
    root = np.sqrt(-mu)
    zero = modes.motion[number] == SYMMETRY or abs(mu) <= (error if known else 0.0)
    return {
        "value": [mu.real, mu.imag],
        "words": EXACT if modes.motion[number] == SYMMETRY else eigenvalue_in_words(mu, error),
        "motion": modes.motion[number],
        "root": [float(root.real), float(root.imag)],
        "kind": "zero" if zero else "grows" if root.real > GROWTH * abs(root) else "swings",
    }


def _largest(vectors: NDArray[Any]) -> float:
    return float(np.linalg.norm(abs(vectors), axis=1).max())

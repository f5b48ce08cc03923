"""Modes as the page animates them: displacement and rotation of a drawn size, and moving supports."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rodfem.modes.modes import RIGID, SYMMETRY, Few, load_modes
from rodfem.output.digits import eigenvalue_in_words
from rodfem.output.glyphs import Look, glyphs_of
from rodfem.output.plot_modes import GROWTH, drawn_size
from rodfem.problem.setting import Setting
from rodfem.report.packing import packed
from rodfem.report.shapes import Shapes
from rodfem.tolerances import SAME_EIGENVALUE

Floats = NDArray[np.float64]

EXACT, COUNTED = "0 (exact)", "0"
"""Eigenvalues of a symmetry, and of one that vanishes as far as the state's count tells."""
SMALL = 1e-3
"""Share of the greatest eigenvalue below which such differences are relative to this share."""


class Shown(NamedTuple):
    """A mode: eigenvalue ``value``, bound of its ``error`` (nan: not estimated), name of its ``motion``.

    ``u`` and ``w`` (m, 3) are displacement and rotation at the nodes ``s`` (m,); ``zero`` says that the count at the
    state has its eigenvalue among those that vanish.
    """

    value: complex
    error: float
    motion: str
    s: Floats
    u: NDArray[Any]
    w: NDArray[Any]
    zero: bool = False


def modes_of(path: Path | None, place: tuple[str, int], typical: Few | None, s: Floats, zeros: int) -> list[Shown]:
    """Modes of one state in ascending order, symmetries last: those with error bars, then others that are typical.

    ``path`` is the file with error bars, None where it has not this state, and ``place`` the branch and row in it;
    ``typical`` are modes that the run has recorded there, at nodes ``s``, and ``zeros`` is the number of eigenvalues
    that vanish, symmetries included.
    """
    shown: list[Shown] = []
    if path is not None:
        modes = load_modes(path, *place)
        each = zip(modes.value, modes.error, modes.motion, modes.displacement, modes.rotation, strict=True)
        shown += [Shown(complex(mu), float(error), motion, modes.s, u, w) for mu, error, motion, u, w in each]
    shown += [] if typical is None else _others(typical, s, [mode.value for mode in shown])
    shown.sort(key=lambda mode: (mode.motion in (SYMMETRY, RIGID), mode.value.real))
    others = [mode for mode in shown if mode.motion != SYMMETRY]
    vanish = sorted(others, key=lambda mode: abs(mode.value))[: max(zeros - (len(shown) - len(others)), 0)]
    return [mode._replace(zero=any(mode is other for other in vanish)) for mode in shown]


def _others(typical: Few, s: Floats, known: Sequence[complex]) -> list[Shown]:
    """Modes that a run has recorded, but those with eigenvalues that are ``known``; these have symmetries, too."""
    least = SMALL * abs(typical.value).max(initial=0.0)
    each = zip(typical.value, typical.motion, typical.displacement, typical.rotation, strict=True)
    return [
        Shown(complex(mu), np.nan, motion, s, u, w)
        for mu, motion, u, w in each
        if not (known and motion == SYMMETRY)
        and not any(abs(x - mu) <= SAME_EIGENVALUE * max(abs(mu), least) for x in known)
    ]


def motions_of(modes: Sequence[Shown], shapes: Shapes, row: int, setting: Setting, look: Look) -> list[dict[str, Any]]:
    """Modes of the state in a ``row`` as the page has them, with the maps of its supports at an amplitude of one.

    ``shapes`` are those of the branch, ``setting`` is what holds and loads the state, ``look`` that of the picture, and
    ``modes`` are those of :func:`modes_of`.
    """
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
        out.append(_about(mode) | {"parts": drawn, "maps": [moved(*part) for part in parts]})
    return out


def _about(mode: Shown) -> dict[str, Any]:
    """Eigenvalue, in words with its error, and what the motion does: ``zero``, ``grows`` or neither."""
    exact, known = mode.motion in (SYMMETRY, RIGID), bool(np.isfinite(mode.error))
    zero = exact or mode.zero or bool(abs(mode.value) <= np.nan_to_num(mode.error, posinf=0.0))
    mu = 0j if zero and (exact or not known) else mode.value
    root = np.sqrt(-mu)
    words = EXACT if exact else eigenvalue_in_words(mu, mode.error) or COUNTED * zero
    return {
        "value": [mu.real, mu.imag],
        "words": words,
        "motion": mode.motion,
        "root": [float(root.real), float(root.imag)],
        "kind": "zero" if zero else "grows" if root.real > GROWTH * abs(root) else "swings",
    }

"""From where a picture shows a rod: along the axis across the plane in which it moves, a little from above.

What is upwards is decided here, for pictures, animations and the report alike.  Gravity is downwards.  Without it an
axis of space points upwards, e1 before e2 before e3, never the opposite way, so that a weight that hangs along -e1
pulls downwards.  The exception is an arch, a rod that is bent before a load presses on its crown: it stands.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodfem.problem.quaternions import directors
from rodfem.problem.setting import HELD, TURNS, Setting

Floats = NDArray[np.float64]

TILT = np.radians(20.0)
"""By which a picture is seen from above."""
NEAR, LEVEL = 0.9, 0.1
"""Cosines: from which on a direction is that of the nearest axis of space, or a load that of the motion; below which an
axis of space is across."""
UNSEEN = 1e-3
"""Displacement, or distance of the ends, that a picture does not show, relative to the rod's size."""
POINT = 1e-9
"""A length, or a part of one, below this has no direction in a picture: also the floor of a divisor."""


def axes_of(setting: Setting, reference: Floats, moved: Floats, frame: Floats, load: Floats | None = None) -> Floats:
    """Axes (3, 3) of the picture of a rod that has ``moved`` (n, 3) from ``reference`` (n, 3), in its ``setting``.

    ``frame`` (3, 3) has the directors at its first end; ``load`` is the direction to show, by default of dead forces.
    """
    load, feet = setting.force if load is None else load, sum(bool(x.held.any()) for x in setting.supports) > 1
    along = {"axis": axis_of(setting, reference), "down": setting.down, "side": setting.widest(frame)}
    return view_of(reference, moved, load=load, feet=feet, **along)


def axis_of(setting: Setting, reference: Floats) -> Floats:
    """Direction (3,) of the axis of a rod in the state ``reference`` (n, 3): from one end to the other.

    Of a rod that is held at one end alone it is that of its support, from which load bends the chord away, unless the
    rod leaves it sideways, as a coil does.
    """
    chord, holding = reference[-1] - reference[0], [x for x in setting.supports if x.held.any() or x.turning != TURNS]
    stem = directors(holding[0].frame)[:, 2] if len(holding) == 1 and holding[0].turning == HELD else chord
    return np.asarray(stem if stem @ chord > 0.3 * np.linalg.norm(chord) else chord)


def thickness(centres: Floats) -> float:
    """Mean radius with which a rod of this centreline (n, 3) is drawn: by its length, and by its extent if it coils."""
    length = np.linalg.norm(np.diff(centres, axis=0), axis=1).sum()
    return float(min(length / 90.0, np.linalg.norm(np.ptp(centres, axis=0)) / 40.0))


def view_of(
    reference: Floats,
    moved: Floats,
    *,
    axis: Floats | None = None,
    down: Floats | None = None,
    load: Floats | None = None,
    side: Floats | None = None,
    feet: bool = False,
) -> Floats:
    """Axes of a picture as rows (3, 3): to the right, upwards, and to the viewer.

    ``reference`` and ``moved`` (n, 3) are the centreline of the state that the rod has left, and the displacement from
    it.  Directions (3,) are ``axis``, that of the rod (None: its chord), ``down``, that of gravity, ``load``, that of a
    force across the rod, or of its deflection, and ``side``, upwards where a straight rod has not moved.  With ``feet``
    the rod is held in two places or more, and may be an arch.

    Without gravity the rod's axis goes to the right, so that nothing that holds it looks tilted, and vertical is the
    principal direction of the displacement across it, or a load that is not nearly along that; then the rod is seen
    from aside.  A closed rod is shown in the plane nearest to it.
    """
    size = float(np.linalg.norm(np.ptp(reference, axis=0)))
    chord = reference[-1] - reference[0] if axis is None else axis
    shape, tilt = moved.T @ moved / len(moved), TILT
    if np.linalg.norm(chord) < UNSEEN * size and down is None:
        spread = np.cov((reference + moved).T)
        scale = float(np.linalg.norm(np.ptp(reference + moved, axis=0)))
        vectors = np.linalg.eigh(spread + np.diag(scale * np.array([3e-3, 2e-3, 1e-3])) ** 2)[1]
        right, up = upwards(vectors[:, 2]), upwards(vectors[:, 1])
        tilt = np.radians(55.0)  # what is across the plane is seen
    elif down is not None:
        up = -down / np.linalg.norm(down)
        spread = (reference - reference.mean(axis=0)).T @ (reference - reference.mean(axis=0)) / len(reference)
        right = _principal(shape + spread, up, UNSEEN * size, side)
        level = abs(right @ chord) < UNSEEN * size  # an upright rod has no way of its own to go
        right = right * sign_of(right @ (moved[np.argmax(np.linalg.norm(moved, axis=1))] if level else chord))
    else:
        right = _snapped(chord / np.linalg.norm(chord))
        up = upwards(_principal(shape, right, UNSEEN * size, side))
        if load is not None:
            right, up, tilt = _loaded(right, up, load, reference if feet else None)
    back = np.cross(right, up)
    return np.array([right, np.cos(tilt) * up - np.sin(tilt) * back, np.cos(tilt) * back + np.sin(tilt) * up])


def _loaded(right: Floats, up: Floats, load: Floats, arch: Floats | None) -> tuple[Floats, Floats, float]:
    """Directions and tilt of a picture in which a ``load`` is seen; ``arch`` (n, 3) is a rod that may be one.

    A load that is not nearly along the motion, which is upwards, is itself upwards, and the rod is seen from aside.
    """
    aside = load - (load @ right) * right
    standing = up * _standing(up, arch, load)
    if abs(up @ aside) >= NEAR * np.linalg.norm(aside):
        towards = (standing @ aside) * (np.cross(right, standing) @ aside) > POINT * (aside @ aside)
        return right, standing, -TILT if towards else TILT
    up = _snapped(aside / np.linalg.norm(aside))
    up = up - (up @ right) * right
    up = upwards(up / np.linalg.norm(up))
    up = up * _standing(up, arch, load)
    turned = np.cos(np.radians(40.0)) * right + np.sin(np.radians(40.0)) * np.cross(right, up)
    return turned, up, np.radians(35.0)  # the rod goes away, so upwards


def _standing(up: Floats, rod: Floats | None, load: Floats) -> float:
    """-1 where an arch, the ``rod`` (n, 3), would hang from ``up`` though the ``load`` presses on its crown; else 1."""
    if rod is None:
        return 1.0
    bow, size = (rod - np.linspace(rod[0], rod[-1], len(rod))).mean(axis=0), np.linalg.norm(np.ptp(rod, axis=0))
    arch = np.linalg.norm(bow) > 0.05 * size and abs(up @ bow) > LEVEL * np.linalg.norm(bow)
    return sign_of(up @ bow) if arch and load @ bow < 0 else 1.0


def _principal(moments: Floats, axis: Floats, least: float, other: Floats | None) -> Floats:
    """Direction across ``axis`` of the greatest second moment; ``other``, if given, where that is below ``least^2``."""
    out = np.eye(3) - np.outer(axis, axis)
    values, vectors = np.linalg.eigh(out @ moments @ out)
    found = vectors[:, -1]
    if values[-1] < least**2:
        found = np.eye(3)[0] if other is None else other
        if np.linalg.norm(out @ found) < 0.1:
            found = np.eye(3)[int(np.argmin(abs(axis)))]
    found = out @ _snapped(found / np.linalg.norm(found))
    return np.asarray(found / np.linalg.norm(found))


def upwards(direction: Floats) -> Floats:
    """The direction (3,) or its opposite, so that the first of e1, e2, e3 that is not nearly across it points along."""
    components = direction[abs(direction) > LEVEL * np.linalg.norm(direction)]
    return direction * sign_of(components[0])


def _snapped(direction: Floats) -> Floats:
    """Axis of space near which a unit vector is, or the vector itself."""
    i = int(np.argmax(abs(direction)))
    return np.sign(direction[i]) * np.eye(3)[i] if abs(direction[i]) > NEAR else direction


def sign_of(value: Any) -> float:
    """Sign of a number, one for zero."""
    return -1.0 if value < 0 else 1.0

"""Supports and loads of a rod as solids of a picture.

The directors decide the body at the place (block where they are held, axle where they turn about an axis, ball on a
point where they turn freely), free components of the position the rails on which it slides, stiffnesses the springs.
So a slide is a block on rails, a pin that slides a ball on a wedge on rails; a free end is nothing.

A constraint that keeps the distance of two points is a string between them, one that keeps a point on a surface a ball
in a frame tangent to it; an elastic foundation is a row of coils.

In a motion the rod has left a place: rails, what springs and strings are fixed to, and frames stay there.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rodfem.output.solids import Solid, across, ball, box, coil, profile_of, round_arrow, straight_arrow, sweep
from rodfem.output.view import POINT, sign_of
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD, Setting, Support, Tie
from rodfem.tolerances import TINY

Floats = NDArray[np.float64]

GREY, DARK, STEEL, LOAD = "#9A9A9A", "#6E6E6E", "#707C8A", "#B3123E"
BLOCK, WIRE, ARROW, RAIL = 2.4, 0.22, 13.0, 3.4
"""Half the size of a block, radius of a wire, length of an arrow, in radii of the rod; half rails in half blocks."""


def glyphs_of(
    setting: Setting,
    s: Floats,
    centres: Floats,
    frames: Floats,
    radius: float,
    view: Floats,
    home: Floats | None = None,
) -> list[Solid]:
    """Solids for all that holds and loads a rod.

    Parameters
    ----------
    setting
        As read from a file.
    s, centres, frames
        Arclengths (n,), centreline (n, 3) and directors (n, 3, 3), the columns of each matrix.
    radius
        Mean radius of the rod in the picture.
    view
        Axes of the picture as rows (3, 3): to the right, upwards, to the viewer.
    home
        Centreline (n, 3) of the equilibrium from which a motion has taken the rod; None: it is there.
    """
    home = centres if home is None else home
    out, up = list[Solid](), view[1]
    widest = float(abs(profile_of(s[[0, -1]], setting.section, np.linspace(0, 2 * np.pi, 25))).max())
    size = max(BLOCK, 1.25 * widest) * radius
    chord = home[-1] - home[0]
    found = []
    for support in setting.supports:
        node = int(np.argmin(abs(s - support.s)))
        side = {0: -1.0, len(s) - 1: 1.0}.get(node, 0.0)
        found.append((support, centres[node], home[node], frames[node], side * frames[node, :, 2], side * chord))
    force, moment = (max([np.linalg.norm(x[0].loads(x[3])[i]) for x in found], default=0.0) for i in (0, 1))
    for support, at, place, R, outward, away in found:
        held = _body(support, at, place, R, away, size, up)
        towards = outward - 0.3 * up - 0.2 * view[2]
        out += held + _springs(support, at, place, towards, radius, up)
        if support.mass:
            out.append(ball(at, 2.2 * radius, DARK))
        clear = 2.2 * size if held else 0.5 * BLOCK * radius
        F, M = support.loads(R)
        if np.linalg.norm(F) > POINT * force:
            out.append(_force(at, F / force, clear, outward, radius))
        if np.linalg.norm(M) > POINT * moment:
            out.append(round_arrow(at + (clear + radius) * outward, M, 5.0 * radius, 0.45 * radius, LOAD, view[2]))
    for tie in setting.ties:
        out += _tie(tie, s, centres, home, radius, view)
    out += _foundation(setting, s, centres, home, radius, up)
    return out + _distributed(setting, s, centres, frames, radius, view[2])


def _body(support: Support, at: Floats, home: Floats, R: Floats, away: Floats, size: float, up: Floats) -> list[Solid]:
    """Body by the freedom of the directors, and rails by that of the position.

    The rails are where ``home`` (3,) has them.  ``away`` is the direction from the other end of the rod, zero inside of
    it; ``size`` half the size of a block.
    """
    free = support.slides
    if support.turning != HELD and len(free) == 3:
        return []
    frame = directors(support.frame)
    if support.turning == HELD:
        middle = at + 0.5 * size * frame[:, 2] * sign_of(frame[:, 2] @ away)
        block = box(middle, frame, (size, size, 0.5 * size), GREY)
        return [block, *_rails(free, middle + home - at, frame[:, 0], 1.2 * size, size)]
    if support.turning == AXIS:
        axis = R @ support.axis / np.linalg.norm(support.axis)
        body = sweep([at - 1.25 * size * axis, at + 1.25 * size * axis], 0.5 * size, DARK)
    else:
        axis, body = np.zeros(3), ball(at, 0.68 * size, DARK)
    along = frame[:, 2] * sign_of(frame[:, 2] @ away) if axis.any() or not away.any() else away / np.linalg.norm(away)
    below = _foot(along, [*free, axis] if axis.any() else free, up)
    side = axis if axis.any() else _other(below, free[0] if free else up)
    side = _other(below, side)
    stand = np.column_stack([side, np.cross(below, side), below])  # d3 from the body to its base
    wedge = box(
        at + 1.05 * size * below, stand * np.array([1.0, -1.0, -1.0]), (size, size, 0.95 * size), GREY, top=0.22
    )
    plate = box(at + 2.2 * size * below, stand, (1.4 * size, 1.4 * size, 0.2 * size), DARK)
    return [body, wedge, plate, *_rails(free, home + 2.6 * size * below, below, 0.8 * size, size)]


def _rails(free: list[Floats], middle: Floats, normal: Floats, apart: float, size: float) -> list[Solid]:
    """Two rails for each direction in which a body moves freely, across ``normal`` where that is possible."""
    out = []
    for direction in free:
        for aside in (apart * sign * _across(direction, normal) for sign in (-1.0, 1.0)):
            ends = [middle + aside + sign * RAIL * size * direction for sign in (-1.0, 1.0)]
            out.append(sweep(ends, 0.12 * size, STEEL))
    return out


def _across(direction: Floats, other: Floats) -> Floats:
    """Unit vector across a direction, and across another where the two differ."""
    out = np.cross(direction, other)
    return across(direction) if np.linalg.norm(out) < 0.1 else np.asarray(out / np.linalg.norm(out))


def _foot(along: Floats, free: list[Floats], up: Floats) -> Floats:
    """Direction from a pin to its base: along the rod where nothing moves or turns about that, else downwards."""
    left = np.eye(3) - sum((np.outer(e, e) for e in free), np.zeros((3, 3)))
    for wanted in (along, -up, _other(up, up), np.cross(up, _other(up, up))):
        found = left @ wanted
        if np.linalg.norm(found) > 0.7:
            return np.asarray(found / np.linalg.norm(found))
    return along


def _other(direction: Floats, wanted: Floats) -> Floats:
    """Unit vector across a direction, as wanted where that is possible."""
    out = wanted - (wanted @ direction) * direction
    return across(direction) if np.linalg.norm(out) < 0.3 else np.asarray(out / np.linalg.norm(out))


def _springs(support: Support, at: Floats, home: Floats, towards: Floats, radius: float, up: Floats) -> list[Solid]:
    """A coil along each principal direction of the stiffness of translation, a turn about each of that of rotation."""
    out: list[Solid] = []
    for direction in _stiff(support.translation_stiffness):
        out += _spring(at, home, direction * sign_of(direction @ towards), 11.0, radius, up)
    for direction in _stiff(support.rotation_stiffness):
        a = _other(direction, up)
        b = np.cross(direction, a)
        angle = np.linspace(0, 5 * np.pi, 120)
        size = radius * np.linspace(1.6, 3.4, len(angle))
        out.append(
            sweep(at + (size * np.cos(angle))[:, None] * a + (size * np.sin(angle))[:, None] * b, WIRE * radius, STEEL)
        )
    return out


def _spring(at: Floats, home: Floats, way: Floats, length: float, radius: float, up: Floats) -> list[Solid]:
    """Coil from a point of the rod to a plate, which is ``length`` radii away where the rod is at ``home``."""
    end = home + length * radius * way
    along = (end - at) / np.linalg.norm(end - at)
    turns, wide = (6, 1.5) if length > 8.0 else (4, 0.9)
    stand = np.column_stack([_other(way, up), np.cross(way, _other(way, up)), way])
    half = 0.8 * wide * BLOCK * radius
    return [
        coil(at + 0.8 * radius * along, end, wide * radius, WIRE * radius, turns, STEEL),
        box(end, stand, (half, half, 0.4 * radius), GREY),
    ]


def _foundation(setting: Setting, s: Floats, centres: Floats, home: Floats, radius: float, up: Floats) -> list[Solid]:
    """A coil at each place where there is a foundation, along the stiff direction nearest to the picture's vertical."""
    out: list[Solid] = []
    for at, stiffness in zip(*(setting.foundation or ((), ())), strict=True):
        stiff = np.array(_stiff(stiffness))
        if len(stiff):
            node, way = int(np.argmin(abs(s - at))), -(stiff @ up) @ stiff
            way = way / np.linalg.norm(way) if np.linalg.norm(way) > 0.3 else stiff[-1]
            out += _spring(centres[node], home[node], way, 7.0, radius, up)
    return out


def _tie(tie: Tie, s: Floats, centres: Floats, home: Floats, radius: float, view: Floats) -> list[Solid]:
    """String between two points, or ball in a frame tangent to a surface; nothing for what has no place."""
    whole = not np.isfinite(tie.s)
    nodes = np.array([0, -1]) if whole else np.full(2, np.argmin(abs(s - tie.s)))
    if np.isfinite(tie.line).all():
        ends = tie.line + (centres - home)[nodes] * np.array([[whole], [True]])
        if np.linalg.norm(ends[1] - ends[0]) < radius:
            return []
        return [sweep(ends, 0.3 * radius, DARK), *(ball(end, 1.4 * radius, DARK) for end in ends)]
    if not np.isfinite(tie.normal).all():
        return []
    at = home[nodes[0]]
    side = _other(tie.normal, view[0])
    other = np.cross(tie.normal, side)
    corners = [at + 7.0 * radius * (a * side + b * other) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))]
    bars = [sweep([a, b], 0.3 * radius, STEEL) for a, b in pairwise(corners)]
    return [ball(centres[nodes[0]], 1.7 * radius, DARK), *bars]


def _stiff(stiffness: Floats) -> list[Floats]:
    """Principal directions of a stiffness (3, 3) that is not zero there; those of space where they will do."""
    if np.allclose(stiffness, np.diag(np.diag(stiffness)), rtol=0, atol=1e-3 * float(abs(stiffness).max())):
        values, vectors = np.diag(stiffness), np.eye(3)
    else:
        values, vectors = np.linalg.eigh(stiffness)
    return [v for value, v in zip(values, vectors.T, strict=True) if value > 1e-3 * max(float(values.max()), POINT)]


def _force(at: Floats, force: Floats, clear: float, outward: Floats, radius: float) -> Solid:
    """Arrow of a force: it ends at the rod where it pushes against it, and begins there where it pulls."""
    size = ARROW * radius * max(float(np.linalg.norm(force)), 0.4)
    way = force / np.linalg.norm(force)
    pushes = way @ outward < -POINT
    start = at - (clear + size) * way if pushes else at + (0.5 * clear if abs(way @ outward) < 0.5 else clear) * way
    return straight_arrow(start, start + size * way, 0.48 * radius, LOAD)


def _distributed(
    setting: Setting, s: Floats, centres: Floats, frames: Floats, radius: float, back: Floats
) -> list[Solid]:
    """Arrows in proportion to a distributed force: on the rod, or beside it where the force is along the rod."""
    if setting.distributed is None:
        return []
    places, dead, follower = setting.distributed
    nodes = np.abs(s[:, None] - places).argmin(axis=0)
    forces = dead + np.einsum("nij,nj->ni", frames[nodes], follower)
    strength = np.linalg.norm(forces, axis=1)
    along = abs(np.sum(forces * frames[nodes, :, 2], axis=1)).sum() > 0.5 * strength.sum()
    out = []
    for node, force, size in zip(
        nodes, forces, 0.6 * ARROW * radius * strength / max(strength.max(), TINY), strict=True
    ):
        if size < radius:
            continue
        way = force / np.linalg.norm(force)
        tip = centres[node] - 1.6 * radius * way
        if along:
            tip = centres[node] + size / 2 * way + 5.5 * radius * _across(way, back)
        out.append(straight_arrow(tip - size * way, tip, 0.3 * radius, LOAD))
    return out

"""Supports and loads of a rod as glyphs of a picture.

The directors decide the body at the place (block where they are held, axle where they turn about an axis, ball on a
point where they turn freely), free components of the position the rails on which it slides, stiffnesses the springs.
So a slide is a block on rails, a pin that slides a ball on a wedge on rails; a free end is nothing.

A constraint that keeps the distance of two points is a string between them, one that keeps a point on a surface a ball
in a frame tangent to it; an elastic foundation is a row of coils.

In a motion the rod has left a place: rails, what springs and strings are fixed to, and frames stay there.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rodfem.output.solids import COILS, Glyph, across, ball, between, glyph, profile_of, turn
from rodfem.output.style import DARK, GREY, LOAD, STEEL
from rodfem.output.view import POINT, sign_of
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD, Setting, Support, Tie
from rodfem.tolerances import TINY

Floats = NDArray[np.float64]

BLOCK, ARROW = 2.4, 13.0
"""Half the size of a block, and the length of an arrow, in radii of the rod."""


@dataclass(frozen=True)
class Look:
    """How a picture shows a rod: its mean ``radius``, and the ``axes`` of :func:`rodfem.output.view.view_of`."""

    radius: float
    axes: Floats

    @property
    def up(self) -> Floats:
        """Upwards (3,)."""
        return self.axes[1]


@dataclass(frozen=True)
class _Place:
    """A point of the rod: where it is, ``at``, and was at ``home``, its directors, and the way out of the rod's end."""

    at: Floats
    home: Floats
    frame: Floats
    outward: Floats
    away: Floats


def glyphs_of(
    setting: Setting, s: Floats, pose: tuple[Floats, Floats], look: Look, home: Floats | None = None
) -> list[Glyph]:
    """Glyphs for all that holds and loads a rod, by its ``setting``, in a picture of this ``look``.

    ``s`` (n,) are arclengths, ``pose`` the centreline (n, 3) and the directors (n, 3, 3) as columns; ``home`` (n, 3) is
    the centreline of the equilibrium from which a motion has taken the rod, None: it is there.
    """
    centres, frames = pose
    home = centres if home is None else home
    widest = float(abs(profile_of(s[[0, -1]], setting.section, np.linspace(0, 2 * np.pi, 25))).max())
    size = max(BLOCK, 1.25 * widest) * look.radius
    places = []
    for support in setting.supports:
        node = int(np.argmin(abs(s - support.s)))
        side = {0: -1.0, len(s) - 1: 1.0}.get(node, 0.0)
        ways = side * frames[node, :, 2], side * (home[-1] - home[0])
        places.append(_Place(centres[node], home[node], frames[node], *ways))
    loads = [support.loads(place.frame) for support, place in zip(setting.supports, places, strict=True)]
    sizes = np.array([np.linalg.norm(load, axis=1) for load in loads]).reshape(-1, 2)
    shares = sizes / np.maximum(sizes.max(axis=0, initial=0.0), TINY)
    out: list[Glyph] = []
    for support, place, load, share in zip(setting.supports, places, loads, shares, strict=True):
        body = _body(support, place, size, look)
        out += body + _springs(support, place, look)
        if support.mass:
            out.append(ball(place.at, 2.2 * look.radius, DARK))
        out += _loads(load, share, place, 2.2 * size if body else 0.5 * BLOCK * look.radius, look)
    for tie in setting.ties:
        out += _tie(tie, s, centres, home, look)
    return out + _foundation(setting, s, centres, home, look) + _distributed(setting, s, pose, look)


def _body(support: Support, place: _Place, size: float, look: Look) -> list[Glyph]:
    """Body by the freedom of the directors, and rails by that of the position; ``size`` is half that of a block."""
    free, frame = support.slides, directors(support.frame)
    if support.turning == HELD:
        middle = place.at + 0.5 * size * frame[:, 2] * sign_of(frame[:, 2] @ place.away)
        block = glyph("box", GREY, middle, size * np.array([1.0, 1.0, 0.5])[:, None] * frame.T)
        return [block, *_rails(free, middle + place.home - place.at, frame[:, 0], 1.2 * size, size)]
    if len(free) == 3:
        return []
    axes = [place.frame @ support.axis / np.linalg.norm(support.axis)] if support.turning == AXIS else []
    along = frame[:, 2] * sign_of(frame[:, 2] @ place.away)
    body = ball(place.at, 0.68 * size, DARK)
    if axes:
        body = between("bar", place.at - 1.25 * size * axes[0], place.at + 1.25 * size * axes[0], 0.5 * size, DARK)
    elif place.away.any():
        along = place.away / np.linalg.norm(place.away)
    below = _foot(along, [*free, *axes], look.up)
    side = _other(below, [*axes, *free, look.up][0])
    stand = np.array([side, np.cross(below, side), below])  # the third one from the body to its base
    wedge = glyph("wedge", GREY, place.at + 1.05 * size * below, size * np.diag([1.0, -1.0, -0.95]) @ stand)
    plate = glyph("box", DARK, place.at + 2.2 * size * below, size * np.diag([1.4, 1.4, 0.2]) @ stand)
    return [body, wedge, plate, *_rails(free, place.home + 2.6 * size * below, below, 0.8 * size, size)]


def _rails(free: list[Floats], middle: Floats, normal: Floats, apart: float, size: float) -> list[Glyph]:
    """Two rails for each direction in which a body moves freely, across ``normal`` where that is possible."""
    ways = [(way, apart * sign * _across(way, normal)) for way in free for sign in (-1.0, 1.0)]
    ends = [[middle + aside + sign * 3.4 * size * way for sign in (-1.0, 1.0)] for way, aside in ways]
    return [between("bar", start, end, 0.12 * size, STEEL) for start, end in ends]


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


def _springs(support: Support, place: _Place, look: Look) -> list[Glyph]:
    """A coil along each principal direction of translational stiffness, a spiral about each of rotational stiffness."""
    out: list[Glyph] = []
    towards = place.outward - 0.3 * look.up - 0.2 * look.axes[2]
    for way in _stiff(support.translation_stiffness):
        out += _spring("coil", place.at, place.home, way * sign_of(way @ towards), look)
    for way in _stiff(support.rotation_stiffness):
        a = _other(way, look.up)
        out.append(glyph("spiral", STEEL, place.at, look.radius * np.array([a, np.cross(way, a), way])))
    return out


def _spring(body: str, at: Floats, home: Floats, way: Floats, look: Look) -> list[Glyph]:
    """Coil from a point of the rod to a plate, which does not move with the rod from its ``home``."""
    _, wide, length = COILS[body]
    end = home + length * look.radius * way
    along, side = (end - at) / np.linalg.norm(end - at), _other(way, look.up)
    stand = np.array([side, np.cross(way, side), way]) * np.array([wide, wide, 0.2])[:, None]
    return [
        between(body, at + 0.8 * look.radius * along, end, look.radius, STEEL),
        glyph("box", GREY, end, 0.8 * BLOCK * look.radius * stand),
    ]


def _foundation(setting: Setting, s: Floats, centres: Floats, home: Floats, look: Look) -> list[Glyph]:
    """A coil at each place where there is a foundation, along the stiff direction nearest to the picture's vertical."""
    out: list[Glyph] = []
    for at, stiffness in zip(*(setting.foundation or ((), ())), strict=True):
        stiff = np.array(_stiff(stiffness))
        if len(stiff):
            node, way = int(np.argmin(abs(s - at))), -(stiff @ look.up) @ stiff
            way = way / np.linalg.norm(way) if np.linalg.norm(way) > 0.3 else stiff[-1]
            out += _spring("small coil", centres[node], home[node], way, look)
    return out


def _stiff(stiffness: Floats) -> list[Floats]:
    """Principal directions of a stiffness (3, 3) that is not zero there; those of space where they will do."""
    values, vectors = np.diag(stiffness), np.eye(3)
    if not np.allclose(stiffness, np.diag(values), rtol=0, atol=1e-3 * float(abs(stiffness).max())):
        values, vectors = np.linalg.eigh(stiffness)
    return [v for value, v in zip(values, vectors.T, strict=True) if value > 1e-3 * max(float(values.max()), POINT)]


def _tie(tie: Tie, s: Floats, centres: Floats, home: Floats, look: Look) -> list[Glyph]:
    """String between two points, or ball in a frame tangent to a surface; nothing for what has no place."""
    whole = not np.isfinite(tie.s)
    nodes = np.array([0, -1]) if whole else np.full(2, np.argmin(abs(s - tie.s)))
    if np.isfinite(tie.line).all():
        ends = tie.line + (centres - home)[nodes] * np.array([[whole], [True]])
        if np.linalg.norm(ends[1] - ends[0]) < look.radius:
            return []
        string = between("bar", ends[0], ends[1], 0.3 * look.radius, DARK)
        return [string, *(ball(end, 1.4 * look.radius, DARK) for end in ends)]
    if not np.isfinite(tie.normal).all():
        return []
    side = _other(tie.normal, look.axes[0])
    other, half = np.cross(tie.normal, side), 7.0 * look.radius
    corners = [home[nodes[0]] + half * (a * side + b * other) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))]
    bars = [between("bar", a, b, 0.3 * look.radius, STEEL) for a, b in pairwise(corners)]
    return [ball(centres[nodes[0]], 1.7 * look.radius, DARK), *bars]


def _loads(load: tuple[Floats, Floats], share: Floats, place: _Place, clear: float, look: Look) -> list[Glyph]:
    """Arrows of a force and of a moment, by their ``share`` (2,) of the greatest ones, ``clear`` of the support.

    A force ends at the rod where it pushes against it, and begins there where it pulls.
    """
    (force, moment), out = load, list[Glyph]()
    if share[0] > POINT:
        size = ARROW * look.radius * max(share[0], 0.4)
        way = force / np.linalg.norm(force)
        pushes, sideways = way @ place.outward < -POINT, abs(way @ place.outward) < 0.5
        start = place.at - (clear + size) * way if pushes else place.at + (0.5 if sideways else 1.0) * clear * way
        out.append(between("arrow", start, start + size * way, 0.48 * look.radius, LOAD))
    if share[1] > POINT:
        centre = place.at + (clear + look.radius) * place.outward
        out.append(turn(centre, moment, 5.0 * look.radius, look.axes[2], LOAD))
    return out


def _distributed(setting: Setting, s: Floats, pose: tuple[Floats, Floats], look: Look) -> list[Glyph]:
    """Arrows in proportion to a distributed force: on the rod, or next to it if the force is along the rod."""
    if setting.distributed is None:
        return []
    (centres, frames), (places, dead, follower) = pose, setting.distributed
    nodes = np.abs(s[:, None] - places).argmin(axis=0)
    forces = dead + np.einsum("nij,nj->ni", frames[nodes], follower)
    strength = np.linalg.norm(forces, axis=1)
    along = abs(np.sum(forces * frames[nodes, :, 2], axis=1)).sum() > 0.5 * strength.sum()
    sizes = 0.6 * ARROW * look.radius * strength / max(strength.max(), TINY)
    out = []
    for node, force, size in zip(nodes, forces, sizes, strict=True):
        if size >= look.radius:
            way = force / np.linalg.norm(force)
            tip = centres[node] - 1.6 * look.radius * way
            if along:
                tip = centres[node] + size / 2 * way + 5.5 * look.radius * _across(way, look.axes[2])
            out.append(between("arrow", tip - size * way, tip, 0.3 * look.radius, LOAD))
    return out

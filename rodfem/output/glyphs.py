"""A rod, its supports and its loads as surfaces of triangles: bodies that pictures place by affine maps.

A picture has few bodies (a box, a ball, a coil, an arrow) at many places.  A glyph is a body, a colour and the map that
places it.  So a support that moves with its state is the same body elsewhere, and a spring that is stretched is a coil
whose map is stretched along its axis.  All bodies are lofts through closed rings of points.

The directors decide the body of a support (block where they are held, axle where they turn about an axis, ball on a
point where they turn freely), free components of the position the rails on which it slides, stiffnesses the springs.
So a slide is a block on rails, a pin that slides a ball on a wedge on rails; a free end is nothing.  An elastic
foundation is a row of coils.  In a motion rails, and what springs are fixed to, stay where the rod was.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rodfem.output.style import DARK, GREY, LOAD, STEEL
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD, Setting, Support
from rodfem.tolerances import NEGLIGIBLE, TINY

Floats = NDArray[np.float64]
Surface = tuple[Floats, NDArray[np.int64]]  # corners (n, 3), and the numbers (k, 3) of those of each triangle

FLATTEST = 7.0  # greatest proportion of the sides of a rod's cross-section that is drawn
SIDES = 24  # corners of a round cross-section
COILS = {"coil": (6, 1.5, 11.0), "small coil": (4, 0.9, 7.0)}
"""Turns of a spring, their radius, and its length at rest, in radii of the rod."""
POINT = 1e-9  # a length, or a part of one, below this has no direction in a picture: also the floor of a divisor
BLOCK, ARROW = 2.4, 13.0  # half the size of a block, and the length of an arrow, in radii of the rod


# --- bodies


class Solid(NamedTuple):
    """A surface in a colour."""

    points: Floats
    triangles: NDArray[np.int64]
    color: str


class Glyph(NamedTuple):
    """A ``body`` of :func:`body_of` in a colour, where the ``map`` (4, 3) places it: ``(x, 1) @ map``."""

    body: str
    color: str
    map: Floats

    @property
    def points(self) -> Floats:
        """Corners (n, 3)."""
        return body_of(self.body)[0] @ self.map[:3] + self.map[3]

    @property
    def triangles(self) -> NDArray[np.int64]:
        """Numbers of the corners of each triangle (k, 3)."""
        return body_of(self.body)[1]


@cache
def body_of(name: str) -> Surface:
    """Surface of a body.

    ``box`` and ``wedge`` have half sides of one, ``ball`` the radius one.  ``bar``, ``arrow`` and coils go from zero to
    one along z, with a radius of one, of coils in radii of the rod.  ``spiral`` lies in the plane of x and y, and
    ``turn`` is an arrow three quarters of the way about z, whose head is at x.
    """
    if name in ("box", "wedge"):
        top = 0.22 if name == "wedge" else 1.0
        corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
        return _loft(np.array([np.column_stack([size * corners, np.full(4, z)]) for size, z in ((1, -1), (top, 1))]))
    if name == "ball":
        angle = np.linspace(0, np.pi, 13)
        return _swept(np.outer(-np.cos(angle), (0, 0, 1)), np.sin(angle))
    if name == "bar":
        return _swept(np.outer((0.0, 1.0), (0, 0, 1)), 1.0)
    if name == "arrow":
        return _swept(np.outer((0, 0.76, 0.76, 1), (0, 0, 1)), np.array([1, 1, 2.6, 0]))
    if name == "spiral":
        angle = np.linspace(0, 5 * np.pi, 120)
        return _swept(_ring(np.linspace(1.6, 3.4, 120), angle, 0 * angle), 0.22)
    if name == "turn":
        angle = np.append(np.linspace(-1.6 * np.pi, -0.585, 40), 0.0) + 0.29
        path, radii = _ring(1.0, angle, 0.5 + 0.6 * angle / np.pi), np.full(42, 0.09)
        radii[-2:] = 2.6 * 0.09, 0.0
        return _swept(np.insert(path, 40, path[39], axis=0), radii)
    turns, wide, length = COILS[name]
    t = np.linspace(0, 1, 24 * turns + 1)
    winding = _ring(wide * np.minimum(1, 8 * np.minimum(t, 1 - t)), 2 * np.pi * turns * t, length * (0.1 + 0.8 * t))
    points, triangles = _swept(np.vstack([np.zeros(3), winding, (0, 0, length)]), 0.22, sides=10)
    return points / (1, 1, length), triangles


def _ring(radius: ArrayLike, angle: Floats, height: Floats) -> Floats:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])


def _swept(path: Floats, radii: ArrayLike, sides: int = SIDES) -> Surface:
    """Round solid along a ``path`` (n, 3) of ``radii`` (n,); a point may be repeated, with another radius."""
    tangents = np.gradient(path.astype(float), axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normal, angles, rings = across(tangents[0]), 2 * np.pi * np.arange(sides) / sides, []
    for point, tangent, radius in zip(path, tangents, np.broadcast_to(radii, len(path)), strict=True):
        normal = normal - (normal @ tangent) * tangent  # carried along without twist
        normal = normal / np.linalg.norm(normal)
        around = np.outer(np.cos(angles), normal) + np.outer(np.sin(angles), np.cross(tangent, normal))
        rings.append(point + radius * around)
    return _loft(np.array(rings))


def _loft(rings: Floats) -> Surface:
    """Surface through n closed rings of k points, (n, k, 3), with flat lids."""
    n, k = rings.shape[:2]
    i, j = (x.ravel() for x in np.indices((n - 1, k)))
    a, b, c, d = i * k + j, i * k + (j + 1) % k, (i + 1) * k + (j + 1) % k, (i + 1) * k + j
    around, last = np.arange(k), (n - 1) * k
    first = np.column_stack([np.full(k, n * k), np.roll(around, -1), around])
    second = np.column_stack([np.full(k, n * k + 1), last + around, last + np.roll(around, -1)])
    points = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(axis=1)])
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d]), first, second])
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return points, triangles[area > NEGLIGIBLE * max(area.max(), TINY)]


def glyph(body: str, color: str, at: Floats, axes: ArrayLike) -> Glyph:
    """A ``body`` of a ``color`` ``at`` a place (3,), whose directions x, y, z become the rows of ``axes`` (3, 3)."""
    return Glyph(body, color, np.vstack([axes, at]))


def _ball(at: Floats, radius: float) -> Glyph:
    return glyph("ball", DARK, at, radius * np.eye(3))


def between(body: str, start: Floats, end: Floats, radius: float, color: str) -> Glyph:
    """A ``body`` of a ``color`` along z, from ``start`` (3,) to ``end`` (3,), with this ``radius``."""
    a = across(end - start)
    b = np.cross(end - start, a)
    return glyph(body, color, start, [radius * a, radius * b / np.linalg.norm(b), end - start])


def turn(centre: Floats, axis: Floats, size: float, front: Floats, color: str) -> Glyph:
    """Arrow of a ``color`` about an ``axis`` (3,) through ``centre``, in the sense of a moment along it."""
    return glyph("turn", color, centre, size * _triad(axis / np.linalg.norm(axis), front))


def _triad(axis: Floats, wanted: Floats) -> Floats:
    """Unit vectors as rows (3, 3), the third one along a unit vector ``axis``, the first as ``wanted`` across it."""
    side = across(axis, wanted)
    return np.array([side, np.cross(axis, side), axis])


def across(direction: Floats, wanted: Floats | None = None) -> Floats:
    """Unit vector (3,) across a direction, which is a unit vector if one is ``wanted``: near that where possible."""
    if wanted is not None:
        out = wanted - (wanted @ direction) * direction
        if np.linalg.norm(out) > 0.1:
            return np.asarray(out / np.linalg.norm(out))
    out = np.cross(direction, np.eye(3)[int(np.argmin(abs(direction)))])
    return np.asarray(out / np.linalg.norm(out))


def sign_of(value: Any) -> float:
    """Sign of a number, one for zero."""
    return -1.0 if value < 0 else 1.0


# --- the rod


def striped(
    pose: tuple[Floats, Floats, Floats],
    section: tuple[Floats, Floats] | None,
    radius: float,
    colors: Sequence[str],
) -> list[Solid]:
    """A rod of a mean ``radius`` with a stripe along d1, in two ``colors``."""
    s, centres, frames = pose
    around = (1.0, np.linspace(-np.pi, np.pi, 49)[:-1]), (1.02, np.linspace(-0.3, 0.3, 9))
    outlines = [size * radius * profile_of(s, section, angles) for size, angles in around]
    rings = [centres[:, None] + np.einsum("nij,nkj->nki", frames[:, :, :2], outline) for outline in outlines]
    return [Solid(*_loft(ring), color) for ring, color in zip(rings, colors, strict=True)]


def profile_of(s: Floats, section: tuple[Floats, Floats] | None, angles: Floats) -> Floats:
    """Outline of a rod's cross-sections at arclengths (n,), at angles (k,) from d1: (n, k, 2), of mean radius 1.

    It has the principal axes of the second moments of area (m, 2, 2) of ``section``, and their proportion, ``sqrt(J1 /
    J2)``, up to :data:`FLATTEST`: an ellipse where it is nearly round, a rectangle where it is flat.  Its area is
    proportional to the fourth root of their determinant.
    """
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    if section is None:
        return np.tile(circle, (len(s), 1, 1))
    at, moments = section
    moments = np.maximum(np.linalg.eigvalsh(moments).max(), TINY) * NEGLIGIBLE * np.eye(2) + moments
    J = np.stack([[np.interp(s, at, moments[:, i, j]) for j in range(2)] for i in range(2)]).transpose(2, 0, 1)
    values, axes = np.linalg.eigh(J)  # ascending
    ratio = np.minimum(np.sqrt(values[:, 1] / values[:, 0]), FLATTEST)
    size = (values[:, 0] * values[:, 1]) ** 0.125
    size = size / size.max()
    power = 2.0 / np.clip(1.0 + ratio, 2.0, 5.0)  # of a superellipse |x|^(2/power) + |y|^(2/power) = 1
    half = np.stack([size / np.sqrt(ratio), size * np.sqrt(ratio)], axis=1)
    local = np.einsum("kj,nji->nki", circle, axes)  # along the principal axes
    rounded = np.sign(local) * abs(local) ** power[:, None, None]
    return np.asarray(np.einsum("nki,nji->nkj", rounded * half[:, None, :], axes))


# --- supports and loads


class Look(NamedTuple):
    """How a picture shows a rod: its mean ``radius``, and the ``axes`` of :func:`rodfem.output.render.view_of`."""

    radius: float
    axes: Floats

    @property
    def up(self) -> Floats:
        """Upwards (3,)."""
        return np.asarray(self.axes[1])


class _Place(NamedTuple):
    """A point of the rod, before a motion at ``home``, its directors, and the ways out along rod and chord."""

    at: Floats
    home: Floats
    frame: Floats
    outward: Floats
    away: Floats


def glyphs_of(
    setting: Setting, s: Floats, pose: tuple[Floats, Floats], look: Look, home: Floats | None = None
) -> list[Glyph]:
    """Glyphs for all that holds and loads a rod, by its ``setting``, in a picture of this ``look``.

    ``pose`` has the centreline (n, 3) and the directors (n, 3, 3), ``home`` the centreline that a motion has left.
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
        out += [_ball(place.at, 2.2 * look.radius)] * bool(support.mass)
        out += _loads(load, share, place, 2.2 * size if body else 0.5 * BLOCK * look.radius, look)
    return out + _foundation(setting, s, centres, home, look) + _distributed(setting, s, pose, look)


def _body(support: Support, place: _Place, size: float, look: Look) -> list[Glyph]:
    """Body by the freedom of the directors, and rails by that of the position; ``size`` is half that of a block."""
    free, frame = support.slides, directors(support.frame)
    along = frame[:, 2] * sign_of(frame[:, 2] @ place.away)
    if support.turning == HELD:
        middle = place.at + 0.5 * size * along
        block = glyph("box", GREY, middle, size * np.array([1.0, 1.0, 0.5])[:, None] * frame.T)
        return [block, *_rails(free, middle + place.home - place.at, frame[:, 0], 1.2 * size, size)]
    if len(free) == 3:
        return []
    axes = [place.frame @ support.axis / np.linalg.norm(support.axis)] if support.turning == AXIS else []
    body = _ball(place.at, 0.68 * size)
    if axes:
        body = between("bar", place.at - 1.25 * size * axes[0], place.at + 1.25 * size * axes[0], 0.5 * size, DARK)
    elif place.away.any():
        along = place.away / np.linalg.norm(place.away)
    below = _foot(along, [*free, *axes], look.up)
    stand = _triad(below, [*axes, *free, look.up][0])  # the third one from the body to its base
    wedge = glyph("wedge", GREY, place.at + 1.05 * size * below, size * np.diag([1.0, -1.0, -0.95]) @ stand)
    plate = glyph("box", DARK, place.at + 2.2 * size * below, size * np.diag([1.4, 1.4, 0.2]) @ stand)
    return [body, wedge, plate, *_rails(free, place.home + 2.6 * size * below, below, 0.8 * size, size)]


def _rails(free: list[Floats], middle: Floats, normal: Floats, apart: float, size: float) -> list[Glyph]:
    """Two rails for each direction in which a body moves freely, across ``normal`` where that is possible."""
    places = [(way, middle + sign * apart * np.cross(way, across(way, normal))) for way in free for sign in (-1.0, 1.0)]
    return [between("bar", at - 3.4 * size * way, at + 3.4 * size * way, 0.12 * size, STEEL) for way, at in places]


def _foot(along: Floats, free: list[Floats], up: Floats) -> Floats:
    """Direction from a pin to its base: along the rod where nothing moves or turns about that, else downwards."""
    left = np.eye(3) - sum((np.outer(e, e) for e in free), np.zeros((3, 3)))
    for wanted in (along, -up, across(up), np.cross(up, across(up))):
        found = left @ wanted
        if np.linalg.norm(found) > 0.7:
            return np.asarray(found / np.linalg.norm(found))
    return along


def _springs(support: Support, place: _Place, look: Look) -> list[Glyph]:
    """A coil along each principal direction of translational stiffness, a spiral about each of rotational stiffness."""
    out: list[Glyph] = []
    towards = place.outward - 0.3 * look.up - 0.2 * look.axes[2]
    for way in _stiff(support.translation_stiffness):
        out += _spring("coil", place.at, place.home, way * sign_of(way @ towards), look)
    spirals = [look.radius * _triad(way, look.up) for way in _stiff(support.rotation_stiffness)]
    return out + [glyph("spiral", STEEL, place.at, axes) for axes in spirals]


def _spring(body: str, at: Floats, home: Floats, way: Floats, look: Look) -> list[Glyph]:
    """Coil from a point of the rod to a plate, which does not move with the rod from its ``home``."""
    _, wide, length = COILS[body]
    end = home + length * look.radius * way
    along = (end - at) / np.linalg.norm(end - at)
    plate = 0.8 * BLOCK * look.radius * np.diag([wide, wide, 0.2]) @ _triad(way, look.up)
    return [between(body, at + 0.8 * look.radius * along, end, look.radius, STEEL), glyph("box", GREY, end, plate)]


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


def _loads(load: tuple[Floats, Floats], share: Floats, place: _Place, clear: float, look: Look) -> list[Glyph]:
    """Arrows of a force and of a moment, by their ``share`` (2,) of the greatest ones, ``clear`` of the support."""
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
                tip = centres[node] + size / 2 * way + 5.5 * look.radius * np.cross(way, across(way, look.axes[2]))
            out.append(between("arrow", tip - size * way, tip, 0.3 * look.radius, LOAD))
    return out

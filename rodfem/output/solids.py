"""Bodies of pictures: surfaces of triangles, each placed by an affine map.

A picture has few bodies (a box, a ball, a coil, an arrow) at many places.  A glyph is a body, a colour and the map that
places it.  So a support that moves with its state is the same body elsewhere, and a spring that is stretched is a coil
whose map is stretched along its axis.  All bodies are lofts through closed rings of points.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rodfem.tolerances import NEGLIGIBLE, TINY

Floats = NDArray[np.float64]

FLATTEST = 7.0
"""Greatest proportion of the sides of a rod's cross-section that is drawn."""
SIDES = 24
"""Corners of a round cross-section."""
COILS = {"coil": (6, 1.5, 11.0), "small coil": (4, 0.9, 7.0)}
"""Turns of a spring, their radius, and its length at rest, in radii of the rod."""


class Solid(NamedTuple):
    """Corners ``points`` (n, 3), ``triangles`` (k, 3) of their numbers, and a colour."""

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
def body_of(name: str) -> tuple[Floats, NDArray[np.int64]]:
    """Corners and triangles of a body.

    ``box`` and ``wedge`` have half sides of one, ``ball`` the radius one.  ``bar`` and ``arrow`` go from zero to one
    along z, with radii of one for the bar and the arrow's shaft.  ``coil`` and ``small coil`` go so, too, with x and y
    in radii of the rod.  ``spiral`` lies in the plane of x and y, and ``turn`` is an arrow three quarters of the way
    about z, whose radius is one, and whose head is at x.
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


def _swept(path: Floats, radii: ArrayLike, sides: int = SIDES) -> tuple[Floats, NDArray[np.int64]]:
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


def _loft(rings: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Surface through n closed rings of k points, (n, k, 3), with flat lids."""
    n, k = rings.shape[:2]
    i, j = (x.ravel() for x in np.indices((n - 1, k)))
    a, b, c, d = i * k + j, i * k + (j + 1) % k, (i + 1) * k + (j + 1) % k, (i + 1) * k + j
    around, last = np.arange(k), (n - 1) * k
    lids = [
        np.stack([np.full(k, n * k), np.roll(around, -1), around], axis=1),
        np.stack([np.full(k, n * k + 1), last + around, last + np.roll(around, -1)], axis=1),
    ]
    points = np.concatenate([rings.reshape(-1, 3), rings[[0, -1]].mean(axis=1)])
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1), *lids])
    corners = points[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return points, triangles[area > NEGLIGIBLE * max(area.max(), TINY)]


def glyph(body: str, color: str, at: Floats, axes: ArrayLike) -> Glyph:
    """A ``body`` of a ``color`` ``at`` a place (3,), whose directions x, y, z become the rows of ``axes`` (3, 3)."""
    return Glyph(body, color, np.vstack([axes, at]))


def ball(at: Floats, radius: float, color: str) -> Glyph:
    """Ball about a place (3,)."""
    return glyph("ball", color, at, radius * np.eye(3))


def between(body: str, start: Floats, end: Floats, radius: float, color: str) -> Glyph:
    """A ``body`` of a ``color`` along z, from ``start`` (3,) to ``end`` (3,), with this ``radius``."""
    a = across(end - start)
    b = np.cross(end - start, a)
    return glyph(body, color, start, [radius * a, radius * b / np.linalg.norm(b), end - start])


def turn(centre: Floats, axis: Floats, size: float, front: Floats, color: str) -> Glyph:
    """Arrow of a ``color`` about an ``axis`` (3,), in the sense of a moment along it.

    It winds along the axis a little, so that it is seen from all sides.  Its head is in the direction ``front``,
    ``centre`` (3,) is its own, ``size`` the radius of the arc.
    """
    axis = axis / np.linalg.norm(axis)
    a = front - (front @ axis) * axis
    a = across(axis) if np.linalg.norm(a) < 0.1 else a / np.linalg.norm(a)
    return glyph("turn", color, centre, size * np.array([a, np.cross(axis, a), axis]))


def across(direction: Floats) -> Floats:
    """Some unit vector (3,) across a direction."""
    out = np.cross(direction, np.eye(3)[int(np.argmin(abs(direction)))])
    return np.asarray(out / np.linalg.norm(out))


def striped(
    pose: tuple[Floats, Floats, Floats],
    section: tuple[Floats, Floats] | None,
    radius: float,
    colors: Sequence[str],
    sides: int = 2 * SIDES,
) -> list[Solid]:
    """A rod of a mean ``radius`` and so many ``sides`` with a stripe along d1, in two ``colors``.

    Its ``pose`` has arclengths (n,), centreline (n, 3) and directors (n, 3, 3), in whose planes of d1 and d2 are the
    cross-sections of :func:`profile_of`, by the ``section`` that it takes.
    """
    s, centres, frames = pose
    around = (1.0, np.linspace(-np.pi, np.pi, sides + 1)[:-1]), (1.02, np.linspace(-0.3, 0.3, sides // 6 + 1))
    outlines = [size * radius * profile_of(s, section, angles) for size, angles in around]
    rings = [centres[:, None] + np.einsum("nij,nkj->nki", frames[:, :, :2], outline) for outline in outlines]
    return [Solid(*_loft(ring), color) for ring, color in zip(rings, colors, strict=True)]


def profile_of(s: Floats, section: tuple[Floats, Floats] | None, angles: Floats) -> Floats:
    """Outline of a rod's cross-sections at arclengths (n,), at angles (k,) from d1: (n, k, 2), of mean radius 1.

    ``section`` has second moments of area (m, 2, 2) at arclengths (m,), up to a factor; round without it.  The outline
    has their principal axes and their proportion, ``sqrt(J1 / J2)``, as far as it is not flatter than :data:`FLATTEST`;
    it is an ellipse where it is nearly round, and tends to a rectangle where it is flat.  Its area is proportional to
    the fourth root of their determinant.
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

"""Solids for pictures: surfaces of triangles, swept along a path by a cross-section that may change on the way.

All are made by :func:`loft` from closed rings of points: boxes, cylinders, cones, balls, coils, arrows and rods alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

from rodfem.problem.quaternions import directors
from rodfem.tolerances import NEGLIGIBLE, TINY

Floats = NDArray[np.float64]

FLATTEST = 7.0
"""Greatest proportion of the sides of a rod's cross-section that is drawn."""
SIDES = 24


@dataclass(frozen=True)
class Solid:
    """Corners ``points`` (n, 3), ``triangles`` (k, 3) of their numbers, and a colour."""

    points: Floats
    triangles: NDArray[np.int64]
    color: str


def loft(rings: Floats, color: str) -> Solid:
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
    return Solid(points, triangles[area > NEGLIGIBLE * max(area.max(), TINY)], color)


def sweep(path: ArrayLike, radii: ArrayLike, color: str, sides: int = SIDES) -> Solid:
    """Round solid along a ``path`` (n, 3) of ``radii`` (n,); a point may be repeated, with another radius.

    It has ``sides`` faces around, of one ``color``.
    """
    path = np.asarray(path, dtype=float)
    radii = np.broadcast_to(np.asarray(radii, dtype=float), len(path))
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normal = across(tangents[0])
    angles = 2 * np.pi * np.arange(sides) / sides
    rings = []
    for point, tangent, radius in zip(path, tangents, radii, strict=True):
        normal = normal - (normal @ tangent) * tangent  # carried along without twist
        normal = normal / np.linalg.norm(normal)
        other = np.cross(tangent, normal)
        rings.append(point + radius * (np.outer(np.cos(angles), normal) + np.outer(np.sin(angles), other)))
    return loft(np.array(rings), color)


def curve_of(s: Floats, r: Floats, q: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Centreline (n, 3) and directors (n, 3, 3) at arclengths ``at`` (n,) of a state, by splines through its nodes.

    The nodes are at ``s`` (m,), with positions ``r`` (m, 3) and quaternions ``q`` (m, 4) of any length and sign.
    """
    opposite = np.sum(q[1:] * q[:-1], axis=1) < 0.0  # q and -q are the same rotation
    signs = np.append(1.0, np.cumprod(np.where(opposite, -1.0, 1.0)))
    return CubicSpline(s, r)(at), directors(CubicSpline(s, q * signs[:, None])(at))


def across(direction: Floats) -> Floats:
    """Some unit vector (3,) across a direction."""
    out = np.cross(direction, np.eye(3)[int(np.argmin(abs(direction)))])
    return np.asarray(out / np.linalg.norm(out))


def box(centre: Floats, frame: Floats, half: ArrayLike, color: str, top: float = 1.0) -> Solid:
    """Box about ``centre`` (3,) of sizes 2 ``half`` (3,) along the columns of ``frame`` (3, 3), of one ``color``.

    ``top`` scales the sides of one end.
    """
    a, b, c = np.asarray(half, dtype=float)
    corners = np.array([(a, b), (-a, b), (-a, -b), (a, -b)])
    rings = [np.column_stack([size * corners, np.full(4, z)]) for size, z in ((1.0, -c), (top, c))]
    return loft(centre + np.array(rings) @ frame.T, color)


def ball(centre: Floats, radius: float, color: str) -> Solid:
    """Ball about a centre (3,)."""
    angle = np.linspace(0, np.pi, 13)
    path = centre - radius * np.outer(np.cos(angle), (0.0, 0.0, 1.0))
    return sweep(path, radius * np.sin(angle), color)


def coil(start: Floats, end: Floats, radius: float, wire: float, turns: int, color: str) -> Solid:
    """Spring from a point to another, with straight ends.

    From ``start`` (3,) to ``end`` (3,) there are so many ``turns`` of the ``radius``, of a wire of radius ``wire``;
    ``color`` is its colour.
    """
    direction = end - start
    a = across(direction)
    b = np.cross(direction / np.linalg.norm(direction), a)
    t = np.linspace(0, 1, 24 * turns + 1)
    angle, size = 2 * np.pi * turns * t, radius * np.minimum(1.0, 8 * np.minimum(t, 1 - t))
    along = start + np.outer(0.1 + 0.8 * t, direction)
    winding = along + (size * np.cos(angle))[:, None] * a + (size * np.sin(angle))[:, None] * b
    return sweep(np.concatenate([[start], winding, [end]]), wire, color, sides=10)


def arrow(path: ArrayLike, radius: float, color: str) -> Solid:
    """Arrow along a path (n, 3), whose head, of 5 radii, begins at the path's last but one point."""
    path = np.asarray(path, dtype=float)
    radii = np.full(len(path) + 1, radius)
    radii[-2:] = 2.6 * radius, 0.0
    return sweep(np.concatenate([path[:-1], path[-2:-1], path[-1:]]), radii, color)


def straight_arrow(start: Floats, end: Floats, radius: float, color: str) -> Solid:
    """Arrow from ``start`` (3,) to ``end`` (3,), with a shaft of this ``radius``, of one ``color``."""
    size = float(np.linalg.norm(end - start))
    neck = end - min(6.5 * radius / size, 0.7) * (end - start)
    return arrow([start, neck, end], radius, color)


def round_arrow(centre: Floats, axis: Floats, size: float, radius: float, color: str, front: Floats) -> Solid:
    """Arrow three quarters of the way about an axis (3,), in the sense of a moment along it.

    It winds along the axis a little, and its head is in the direction ``front``, so that it is seen from all sides.
    ``centre`` (3,) and ``axis`` (3,) are its own, ``size`` is the radius of the arc, ``radius`` that of the shaft,
    ``color`` its colour.
    """
    axis = axis / np.linalg.norm(axis)
    a = front - (front @ axis) * axis
    a = across(axis) if np.linalg.norm(a) < 0.1 else a / np.linalg.norm(a)
    b = np.cross(axis, a)
    head = min(6.5 * radius / size, 1.2)
    angle = np.append(np.linspace(-1.6 * np.pi, -head, 40), 0.0) + head / 2
    along = np.outer(size * (0.5 + 0.6 * angle / np.pi), axis)
    return arrow(centre + size * (np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b)) + along, radius, color)


def rod(centres: Floats, frames: Floats, profile: Floats, color: str) -> Solid:
    """Rod with the cross-sections of :func:`profile_of`, (n, k, 2), in the planes of d1 and d2 of ``frames``.

    ``centres`` (n, 3) and ``frames`` (n, 3, 3) are those of the cross-sections, ``profile`` their outlines, ``color``
    its colour.
    """
    return loft(centres[:, None] + np.einsum("nij,nkj->nki", frames[:, :, :2], profile), color)


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

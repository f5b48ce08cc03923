r"""Writhe of a curve: its Gauss integral with itself, by polygons.

Two straight edges contribute the signed solid angle under which they cross,

    Wr = 1/(2 pi) sum_{i<j} Omega_ij,

by four arc sines (Klenin and Langowski, Biopolymers 54 (2000) 307, method 1a).  Of a smooth curve a polygon misses an
error of second order in its edges, which two polygons eliminate, one with edges half as long (Richardson 1911).  What
is left is of third order where the curve ends, of fourth where it is closed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rodfem.tolerances import SAME_PLACE, TINY

Floats = NDArray[np.float64]
FEW, MOST = 16, 1024  # edges of the first polygon, and of the last one, where curves touch
TOUCHING = 1e-8  # squared distance, over that of a 256th of the curve, at which two of its parts are at one place


def writhe(curve: Callable[[Floats], Floats], ends: tuple[float, float], to: float = 1e-3) -> float:
    """Writhe of a smooth curve; of an open one the Gauss integral over it alone.

    ``curve`` has points (n, 3) at parameters (n,) between its ``ends``; it is closed where its points there are one.
    Edges are halved until that changes the writhe by less than ``to``, relative to it or to one: ten times its error.
    """

    def polygon(edges: int) -> float:
        points = curve(np.linspace(*ends, edges + 1))
        if np.allclose(points[0], points[-1], rtol=0.0, atol=SAME_PLACE * float(np.ptp(points))):
            points[-1] = points[0]
        return of_polygon(points)

    coarse, edges, found = polygon(FEW), 2 * FEW, np.inf
    while True:
        fine = polygon(edges)
        before, found = found, (4 * fine - coarse) / 3
        if abs(found - before) <= to * max(1.0, abs(found)) or edges >= MOST:
            return float(found)
        coarse, edges = fine, 2 * edges


def of_polygon(points: Floats) -> float:
    """Writhe of the polygon through ``points`` (n, 3), exact but for round-off; a closed one ends where it began."""
    i, j = np.triu_indices(len(points) - 1, 2)
    if np.array_equal(points[0], points[-1]):  # the first edge meets the last one, as it does its neighbour
        apart = (i > 0) | (j < len(points) - 2)
        i, j = i[apart], j[apart]
    a, b, c, d = points[i], points[i + 1], points[j], points[j + 1]
    normals = [np.cross(c - a, d - a), np.cross(d - a, d - b), np.cross(d - b, c - b), np.cross(c - b, c - a)]
    units = [n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), TINY) for n in normals]
    angles = [np.arcsin(np.clip(np.sum(units[k] * units[(k + 1) % 4], axis=1), -1.0, 1.0)) for k in range(4)]
    side = np.sign(np.sum(np.cross(d - c, b - a) * (c - a), axis=1))
    return float(np.sum(np.sum(angles, axis=0) * side) / (2 * np.pi))


def lies_on_itself(curve: Callable[[Floats], Floats], ends: tuple[float, float]) -> bool:
    """Whether a closed ``curve``, as for :func:`writhe`, meets itself: its writhe is that of either side then."""
    from scipy.optimize import minimize  # slow to load

    places, number = np.linspace(*ends, MOST // 4, endpoint=False), MOST // 4
    points, step = curve(places), (ends[1] - ends[0]) / number
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    i, j = np.indices(apart.shape)
    between = abs(i - j)
    apart[np.minimum(between, number - between) < FEW] = np.inf  # neighbours
    nearest = np.unravel_index(apart.argmin(), apart.shape)
    start = places[list(nearest)] / step

    def squared(pair: Floats) -> float:
        a, b = curve(pair * step) / step
        return float((a - b) @ (a - b))

    found = minimize(squared, start, tol=TOUCHING**2)
    along = abs(found.x[0] - found.x[1]) % number
    return bool(found.fun < TOUCHING and min(along, number - along) > FEW / 2)

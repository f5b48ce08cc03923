r"""Writhe of curves: the Gauss integral of a polygon with itself.

Two straight edges contribute the solid angle under which they cross,

    Wr = 1/(2 pi) sum_{i<j} Omega_ij,

by four arc sines (Klenin and Langowski, Biopolymers 54 (2000) 307, method 1a).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rodfem.tolerances import TINY

Floats = NDArray[np.float64]


def writhe(curve: Floats) -> float:
    """Writhe of the polygon through points (n, 3); of an open curve the Gauss integral over it alone."""
    i, j = np.triu_indices(len(curve) - 1, 2)
    a, b, c, d = curve[i], curve[i + 1], curve[j], curve[j + 1]
    normals = [np.cross(c - a, d - a), np.cross(d - a, d - b), np.cross(d - b, c - b), np.cross(c - b, c - a)]
    units = [n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), TINY) for n in normals]
    angles = [np.arcsin(np.clip(np.sum(units[k] * units[(k + 1) % 4], axis=1), -1.0, 1.0)) for k in range(4)]
    side = np.sign(np.sum(np.cross(d - c, b - a) * (c - a), axis=1))
    return float(np.sum(np.sum(angles, axis=0) * side) / (2 * np.pi))

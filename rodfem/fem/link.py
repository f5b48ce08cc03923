"""Twist, writhe and linking number of a closed rod.

The linking number of the edge traced by a director with the centreline is ``Lk = Tw + Wr`` (Calugareanu 1959,
White 1969), with the twist ``Tw = 1/(2 pi) int k3 ds`` and the writhe ``Wr`` of the centreline.  It is an integer, and
does not change while the rod is deformed without passing through itself: it belongs to the scene's start.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rodfem.errors import InputError
from rodfem.problem.quaternions import CONJUGATE, product


def writhe(r: np.ndarray) -> float:
    """Writhe of the closed polygon through the points ``r`` (m, 3), the first not repeated at the end.

    The sum over pairs of edges of their signed solid angles: Klenin & Langowski, Biopolymers 54 (2000) 307-317.
    """
    a, b = r, np.roll(r, -1, axis=0)
    i, j = (x.ravel() for x in np.triu_indices(len(r), k=2))
    apart = ~((i == 0) & (j == len(r) - 1))
    i, j = i[apart], j[apart]
    r13, r14, r24, r23 = a[j] - a[i], b[j] - a[i], b[j] - b[i], a[j] - b[i]
    normals = [np.cross(p, q) for p, q in ((r13, r14), (r14, r24), (r24, r23), (r23, r13))]
    sizes = [np.linalg.norm(n, axis=1, keepdims=True) for n in normals]
    units = [n / np.where(s > 0, s, 1.0) for n, s in zip(normals, sizes, strict=True)]
    angle = sum(np.arcsin(np.clip(np.sum(units[k] * units[(k + 1) % 4], axis=1), -1.0, 1.0)) for k in range(4))
    sign = np.sign(np.sum(np.cross(b[j] - a[j], b[i] - a[i]) * r13, axis=1))
    return float(np.sum(sign * angle) / (2 * np.pi))


def twist(s: np.ndarray, q: np.ndarray) -> float:
    """Twist ``1/(2 pi) int k3 ds`` of directors given by quaternions ``q`` (m, 4) at ascending ``s`` (m,)."""
    from scipy.integrate import trapezoid
    from scipy.interpolate import CubicSpline

    unit = q / np.linalg.norm(q, axis=1, keepdims=True)
    spline = CubicSpline(s, unit)
    fine = np.linspace(s[0], s[-1], 8 * len(s) + 1)
    p, d = spline(fine), spline(fine, 1)
    k3 = 2 * product(p * CONJUGATE, d)[:, 3] / np.sum(p * p, axis=1)
    return float(trapezoid(k3, fine)) / (2 * np.pi)


def link(sample: dict[str, Any], points: int = 400) -> tuple[int, float, float]:
    """Linking number, twist and writhe of a state of a closed rod, given by :meth:`~rodfem.fem.shape.Shape.sample`.

    Raises :class:`InputError` where the sum of the last two is not near an integer: the rod is not closed, or touches
    itself.
    """
    from scipy.interpolate import CubicSpline

    s, r = np.asarray(sample["s"]), np.asarray(sample["r"])
    fine = np.linspace(s[0], s[-1], points + 1)[:-1]
    closed = r.copy()
    closed[-1] = closed[0]
    Tw, Wr = twist(s, np.asarray(sample["q"])), writhe(CubicSpline(s, closed, bc_type="periodic")(fine))
    Lk = round(Tw + Wr)
    if abs(Tw + Wr - Lk) > 0.05:
        raise InputError(f"Twist {Tw:.4f} plus writhe {Wr:.4f} is no integer: close the rod, without contact.")
    return Lk, Tw, Wr

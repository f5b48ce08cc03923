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
from rodfem.writhe import writhe

TO = 1e-5
"""Change with which the writhe is accepted."""


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


def link(sample: dict[str, Any]) -> tuple[int, float, float]:
    """Linking number, twist and writhe of a state of a closed rod, given by :meth:`~rodfem.fem.shape.Shape.sample`.

    Raises :class:`InputError` where the sum of the last two is not near an integer: the rod is not closed, or touches
    itself.
    """
    from scipy.interpolate import CubicSpline

    s, closed = np.asarray(sample["s"]), np.array(sample["r"])
    closed[-1] = closed[0]
    Wr = writhe(CubicSpline(s, closed, bc_type="periodic"), (s[0], s[-1]), to=TO)
    Tw = twist(s, np.asarray(sample["q"]))
    Lk = round(Tw + Wr)
    if abs(Tw + Wr - Lk) > 0.05:
        raise InputError(f"Twist {Tw:.4f} plus writhe {Wr:.4f} is no integer: close the rod, without contact.")
    return Lk, Tw, Wr

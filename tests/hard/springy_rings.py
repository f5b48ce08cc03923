"""Pressed rings on springs that repeat n times around: multiple branch points by the symmetry of a regular n-gon.

The circle of radius and bending stiffness one is held by springs ``k0 + k1 cos(n s)`` to where its points were.  It
does not stretch: displacements inward ``w`` and along the ring ``u`` have ``u' = w``, and the second variation under
the pressure P is

    int (w'' + w)^2 - P (w'^2 - w^2) + (k0 + k1 cos(n s)) (w^2 + u^2) ds.

Its critical loads are those of a symmetric matrix of Fourier coefficients, which converge exponentially.  By the group
of the n-gon a mode of m waves is double, unless 2 m is a multiple of n.
"""

from typing import Any

import classics
import numpy as np
import ufl
from classics import column
from hard.case import Change, Measured, compare, run, said, singular
from scipy.linalg import eigh
from scipy.optimize import brentq

from rodfem import Discretization, Ring
from rodfem.forms import loads

WAVES, MOST = 40, 14.0
"""Fourier modes of the reference; greatest pressure."""
MEAN, MODULATION = 18.0, 6.0
"""Stiffness at which, if it does not vary, two waves and three buckle at one pressure, 10.5; its amplitude."""


def modes(n: int, k0: float, k1: float) -> tuple[np.ndarray, np.ndarray]:
    """Critical pressures in order, and coefficients ``u_m`` with ``w_m = i m u_m``, m = -WAVES to WAVES, in columns."""
    m = np.arange(-WAVES, WAVES + 1)
    holds = k0 * np.eye(len(m)) + k1 / 2 * (abs(m[:, None] - m) == n)
    stiff = np.diag(m * m * (m * m - 1.0) ** 2) + holds * (1 + np.outer(m, m))
    inverse, vectors = eigh(np.diag(m * m * (m * m - 1.0)), stiff)
    return 1 / inverse[: -WAVES - 1 : -1], vectors[:, : -WAVES - 1 : -1]


def coincident(n: int) -> float:
    """Mean stiffness at which the pairs of two waves and of three buckle at one pressure on springs that vary."""

    def apart(k0: float) -> float:
        pressures, vectors = modes(n, k0, MODULATION)
        two = abs(vectors[[WAVES - 2, WAVES + 2], :4]).sum(axis=0) > abs(vectors[[WAVES - 3, WAVES + 3], :4]).sum(
            axis=0
        )
        return float(pressures[:4][two].mean() - pressures[:4][~two].mean())

    return float(brentq(apart, MEAN - 1, MEAN + 1, xtol=1e-14))


def ring(n: int) -> Measured:
    """All critical pressures below 14 with their multiplicities; n = 0: springs that do not vary."""
    k1 = MODULATION if n else 0.0
    k0 = coincident(n) if n == 7 else MEAN
    expected: list[Change] = []
    for i, p in enumerate(p for p in modes(n or 1, k0, k1)[0] if p < MOST):
        if expected and p - expected[-1].load < 1e-9:
            expected[-1] = Change(expected[-1].load, expected[-1].before, i + 1)
        else:
            expected.append(Change(float(p), i, i + 1))

    def potential(x: Any, c: Any) -> Any:
        away = x.r - ufl.as_vector((1 - ufl.cos(c.s), 0.0, ufl.sin(c.s)))
        springs = (c.k + c.k1 * ufl.cos(c.n * c.s)) / 2 * ufl.dot(away, away)
        return loads.pressure(x.r, x.dr, c.P) + springs

    scene = column(
        "springy ring", Ring(), (8.0, MOST), start=classics.circle, planar="e2", potential=potential,
        constants={"P": 8.0, "B2": 1.0, "k": k0, "k1": k1, "n": float(n)}, **classics.ROUND,
    )  # fmt: skip
    diagram = run(scene, Discretization("pointwise", 10, 6))
    return compare(singular(diagram[0]), expected, said(diagram))

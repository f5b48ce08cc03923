"""What is known of the straight hemitropic rod without finite elements.

The straight rod at lam has stretch 1 - lam, no twist, thrust 10 lam and moment -A lam.  To second order in a small
rotation theta = theta_1 + i theta_2 of its cross-sections across the axis, its energy is

    1/2 int C |theta'|^2 + A lam Im(conj(theta) theta') - P |theta|^2 ds,   P = 10 lam (1 - lam),

for all theta that vanish at the clamps and have int theta ds = 0, so that the ends stay opposite each other.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq


def buckling(lam: float, A: float, B: float, C: float, half: float) -> float:
    """Transcendental function that vanishes where the straight rod buckles (B plays no part).

    With a = A lam/(2C), Om^2 = a^2 + P/C, p = half (a - Om), q = half (a + Om) the condition is
    sin(q - p) = (q - p) sin p sin q/(p q), here divided by q - p: it has no poles, and vanishes at lam = 0.
    """
    a = A * lam / (2 * C)
    om = np.sqrt(a**2 + 10 * lam * (1 - lam) / C)
    p, q = half * (a - om), half * (a + om)

    def sinc(x: float) -> float:
        return float(np.sinc(x / np.pi))

    return sinc(q - p) - sinc(p) * sinc(q)


def loads(A: float, B: float, C: float, half: float, below: float = 0.95) -> list[float]:
    """All loads in (0, below) at which the straight rod buckles."""
    grid = np.linspace(1e-3, below, 4000)
    values = [buckling(x, A, B, C, half) for x in grid]
    changes = np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:]))
    return [
        float(brentq(buckling, grid[i], grid[i + 1], args=(A, B, C, half), xtol=1e-15, rtol=1e-14)) for i in changes
    ]


def index(lam: float, A: float, B: float, C: float, half: float, modes: int = 40) -> int:
    """Negative eigenvalues of the second variation of the straight rod, by Ritz's method with sines.

    The rest of the second variation, in stretch and twist, is positive where 10 B > A^2.
    """
    m = np.arange(1, modes + 1)
    k = m * np.pi / (2 * half)
    odd = (m[:, None] + m) % 2 == 1
    with np.errstate(divide="ignore", invalid="ignore"):
        # 1/half int sin(k_m x) (sin(k_n x))' dx over the rod's length 2 half
        gradient = np.where(odd, 4 * m[:, None] * m / (m[:, None] ** 2 - m**2) / (2 * half), 0.0)
    energy = np.diag(C * k**2 - 10 * lam * (1 - lam)) - 1j * A * lam * gradient
    mean = np.where(m % 2 == 1, 1.0 / m, 0.0)
    kernel = np.linalg.svd(mean[None, :])[2][1:].T
    return 2 * int((np.linalg.eigvalsh(kernel.T @ energy @ kernel) < 0).sum())

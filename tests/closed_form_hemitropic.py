"""What is known of the straight hemitropic rod without finite elements.

The straight rod at lam has stretch 1 - lam, no twist, thrust 10 lam and moment -A lam.  To second order in a small
rotation theta = theta_1 + i theta_2 of its cross-sections across the axis, its energy is

    1/2 int C |theta'|^2 + A lam Im(conj(theta) theta') - P |theta|^2 ds,   P = 10 lam (1 - lam),

for all theta that vanish at the clamps and have int theta ds = 0, so that the ends stay opposite each other.
"""

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space
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


def spectrum(lam: float, A: float, B: float, C: float, half: float, degree: int = 30) -> np.ndarray:
    """Eigenvalues of the second variation of the straight rod relative to the integral of its squared rotation.

    Those of rotations across the axis, each twice, by Ritz's method with the polynomials (1 - x^2) P_j(x); those of
    twist with the stretch that follows it are known: (B - A^2/10) (m pi/(2 half))^2.
    """
    x, weights = legendre.leggauss(degree + 4)
    shapes = [legendre.legmul([2 / 3, 0, -2 / 3], row) for row in np.eye(degree)]
    f = np.array([legendre.legval(x, c) for c in shapes])
    df = np.array([legendre.legval(x, legendre.legder(c)) for c in shapes])
    mass = half * (f * weights) @ f.T
    energy = C / half * (df * weights) @ df.T - 10 * lam * (1 - lam) * mass - 1j * A * lam * (f * weights) @ df.T
    kernel = null_space((f @ weights)[None, :])
    across = eigh(kernel.T @ (energy + energy.conj().T) / 2 @ kernel, kernel.T @ mass @ kernel, eigvals_only=True)
    twist = (B - A**2 / 10) * (np.arange(1, degree) * np.pi / (2 * half)) ** 2
    return np.sort(np.concatenate([across, across, twist]))


def index(lam: float, A: float, B: float, C: float, half: float) -> int:
    """Negative eigenvalues of the second variation of the straight rod."""
    return int((spectrum(lam, A, B, C, half) < 0).sum())

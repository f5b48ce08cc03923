"""Closed forms for the cord and for the rod under a follower load."""

from collections.abc import Callable
from math import pi, sqrt

import numpy as np
from numpy.polynomial import Legendre
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve
from scipy.special import ellipe, ellipk, jv

TORQUE = 2 * brentq(lambda x: x * np.cos(x) - np.sin(x), 4.4, 4.6, xtol=1e-15, rtol=1e-14)
"""Greenhill's torque between clamped ends; squared, the second critical load of a clamped column."""
HEAVY = 9 / 4 * brentq(lambda x: jv(-1 / 3, x), 1.5, 2.2, xtol=1e-15, rtol=1e-14) ** 2
"""Greenhill's weight of a column."""


def elastica(P: float) -> tuple[float, float]:
    """Tip of a bent cantilever of stiffness and length one, along and across: ``2 k / sqrt(P)``, ``K(k) = sqrt(P)``."""
    w = sqrt(P)
    m = brentq(lambda m: ellipk(m) - w, 0.0, 1 - 1e-15, xtol=1e-16, rtol=1e-14)
    return 2 * float(ellipe(m)) / w - 1, 2 * sqrt(m) / w


def waves(number: int = 6) -> list[float]:
    """Zeros of sin(w/2) (tan(w/2) - w/2) in ascending order, without 0."""
    across = [brentq(lambda x: x * np.cos(x) - np.sin(x), n * pi, (n + 0.5) * pi) for n in range(1, number)]
    return sorted([2 * pi * n for n in range(1, number)] + [2 * x for x in across])


def tensions(turns: float) -> list[float]:
    """Loads at which the straight state bifurcates: into space, and (compressed only) in the plane of the coil."""
    return sorted([(2 * pi * turns) ** 2 - w**2 for w in waves()] + [-(w**2) for w in waves()], reverse=True)


def coil(lam: float, turns: float = 1.5, loops: int = 2) -> tuple[float, float, float]:
    """Ordinate, energy and k2(0) of the planar state in which the rod makes so many loops about d2: a pendulum."""
    k0 = 2 * pi * turns
    angle = 2 * pi * np.arange(4000) / 4000
    weight = 2 * pi / 4000

    def speed(c: float) -> np.ndarray:  # theta'^2 / 2 + lam cos theta is constant
        return np.sqrt(c + 2 * abs(lam) - 2 * lam * np.cos(angle))

    c = brentq(lambda c: (weight / speed(c)).sum() - 1 / loops, 1e-3, 1e5, xtol=1e-12, rtol=1e-14)
    k = speed(c)
    energy = loops * weight * k.sum() / 2 - k0 * 2 * pi * loops + k0**2 / 2
    return 1 - loops * weight * (np.cos(angle) / k).sum(), float(energy), float(k[0])


def beck(mu: complex, P: float, EI: float = 1.0, J: float = 0.0) -> complex:
    """Zero at the eigenvalues: ``EI w'''' + (P + J mu) w'' = mu w``, ``w'' = EI w''' + J mu w' = 0`` at s = 1."""
    half = (P + J * mu) / (2 * EI)
    root = np.sqrt(half**2 + mu / EI + 0j)
    a, b = np.sqrt(root - half), np.sqrt(root + half)
    # w = A (cosh as - cos bs) + B (sinh(as)/a - sin(bs)/b) is clamped at s = 0
    bending = a * a * np.cosh(a) + b * b * np.cos(b), a * np.sinh(a) + b * np.sin(b)
    slope = a * np.sinh(a) + b * np.sin(b), np.cosh(a) - np.cos(b)
    shear = a**3 * np.sinh(a) - b**3 * np.sin(b), a * a * np.cosh(a) + b * b * np.cos(b)
    force = [EI * s + J * mu * t for s, t in zip(shear, slope, strict=True)]
    return complex(bending[0] * force[1] - bending[1] * force[0])


def column(near: complex, P: float, EI: float = 1.0, J: float = 0.0) -> complex:
    """Eigenvalue of Beck's column close to ``near``, nan where the secant method finds none."""
    a, b = complex(near), complex(near) * (1 + 1e-5) + 1e-6
    fa, fb = beck(a, P, EI, J), beck(b, P, EI, J)
    for _ in range(40):
        if fa == fb or abs(b - a) < 1e-13 * abs(b):
            return b
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        fb = beck(b, P, EI, J)
    return complex("nan")


def double(P: float, mu: float, J: float = 0.0) -> np.ndarray:
    """Load and eigenvalue at which two eigenvalues of the column meet."""

    def equations(z: np.ndarray) -> list[float]:
        return [beck(z[1], z[0], 1.0, J).real, beck(complex(z[1], 1e-20), z[0], 1.0, J).imag / 1e-20]

    return fsolve(equations, [P, mu], xtol=1e-13)


def tip(
    mu: complex, P: float, share: float = 1.0, spring: float = 0.0, mass: float = 0.0, middle: float = 0.0
) -> complex:
    """Zero at the eigenvalues of ``w'''' + P w'' = mu w`` under a thrust, a ``share`` of which follows the tip.

    There is a ``spring`` across the tip, and a ``mass`` at it and in the ``middle``.
    """
    A, passed = np.eye(4, k=1, dtype=complex), np.eye(4, dtype=complex)
    A[3, 0], A[3, 2], passed[3, 0] = mu, -P, mu * middle
    half = expm(A / 2)
    y = (half @ passed @ half)[:, 2:]
    return complex(np.linalg.det([y[2], y[3] + (1 - share) * P * y[1] + (mu * mass - spring) * y[0]]))


def flutter(P: float, mu: float, **column: float) -> tuple[float, float]:
    """Load and eigenvalue at which two of them meet, from about ``P``, ``mu``."""

    def equations(z: np.ndarray) -> list[float]:
        h = 1e-20
        return [tip(z[1], z[0], **column).real, tip(complex(z[1], h), z[0], **column).imag / h]

    found = fsolve(equations, [P, mu], xtol=1e-13)
    return float(found[0]), float(found[1])


def polynomials(number: int, clamped: bool = True) -> tuple[np.ndarray, np.ndarray, Callable[..., np.ndarray]]:
    """Places and weights of integrals, and values of derivatives of polynomials, clamped at 0 or not: for Galerkin."""
    x, weight = np.polynomial.legendre.leggauss(40)
    factor = Legendre([1 / 3, 1 / 2, 1 / 6] if clamped else [1.0], domain=[0, 1])  # s^2
    basis = [factor * Legendre.basis(i, domain=[0, 1]) for i in range(number)]
    return (x + 1) / 2, weight / 2, lambda n, s=(x + 1) / 2: np.array([f.deriv(n)(np.asarray(s)) for f in basis])

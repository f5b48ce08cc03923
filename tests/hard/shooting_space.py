"""Equilibria of clamped rods in space by shooting: their branches, special points and indices, without rodfem.

A rod of length one, bending stiffness one about both axes and twisting stiffness C has the curvature ``k0`` about d2
where it is free of moments.  With quaternion (w, u), force n, moment m, and the force f along the rod,

    K = m + (1/C - 1) (m.d3) d3 + k0 d2,    q' = K q/2,    r' = d3,    m' = n x d3,    n = n0 - f s.

The index of a rod whose ends are both held is the number of its conjugate points: places s in (0, 1) at which

    d(r, theta)(s)/d(m, n)(0),    theta the vector of small rotation,

is singular (Manning, Rogers & Maddocks 1998, Proc. R. Soc. A 454; Hoffman 2004).  Derivatives are by complex steps.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from hard.case import Change
from hard.shooting_plane import STEP, linear, steps
from scipy.optimize import brentq

COARSE, FINE = 32, 96
"""Steps along a rod, by the coefficients of scipy's DOP853: to follow a branch, and for its special points."""
BEGIN = 0.1
"""No rod is so unstable that a part of this length buckles between clamps."""
TURN, FIRST, LONGEST, SHORTEST = 0.93, 0.2, 0.6, 1e-4
"""Least cosine between tangents of successive points; first step, longest, and shortest, with unknowns scaled."""
NEAR, ROUND_OFF, FAR = 1e-11, 1e-7, 0.3
"""Last step of Newton's method; singular values that count for nothing at a branch point, and the last step that they
allow there; a step that it does not return from."""
Misfit = Callable[[np.ndarray, int], np.ndarray]
"""What must vanish, by all unknowns (m + 1, columns), the last of them the load, and the number of steps."""
W, U, M, R = 0, slice(1, 4), slice(4, 7), slice(7, 10)
"""Rows of a state."""


def cross(a: Any, b: Any) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def times(p: Any, q: Any) -> np.ndarray:
    """Product of quaternions (4, columns)."""
    return np.array([p[0] * q[0] - (p[1:] * q[1:]).sum(0), *(p[0] * q[1:] + q[0] * p[1:] + cross(p[1:], q[1:]))])


def about_e3(angle: Any) -> np.ndarray:
    return np.array([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)])


@dataclass(frozen=True)
class Rod:
    """Twisting stiffness, curvature about d2, force along it."""

    C: float = 1.0
    k0: float = 0.0
    f: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def states(self, m: Any, n: Any, pieces: int = COARSE) -> np.ndarray:
        """State (10, columns) after each step, for moment and force (3, columns) at the first clamp."""
        n = np.asarray(n, dtype=complex)
        twist, k0, (f1, f2, f3) = 1 / self.C - 1, self.k0, self.f

        def slope(s: float, y: np.ndarray, out: np.ndarray) -> None:
            w, x1, x2, x3, m1, m2, m3 = y[:7]
            a, b, c = 2 * (x1 * x3 + w * x2), 2 * (x2 * x3 - w * x1), w * w - x1 * x1 - x2 * x2 + x3 * x3  # d3
            out[7], out[8], out[9] = a, b, c
            t = twist * (m1 * a + m2 * b + m3 * c)
            k1, k2, k3 = m1 + t * a, m2 + t * b, m3 + t * c
            if k0:
                k1 = k1 + 2 * k0 * (x1 * x2 - w * x3)
                k2 = k2 + k0 * (w * w - x1 * x1 + x2 * x2 - x3 * x3)
                k3 = k3 + 2 * k0 * (x2 * x3 + w * x1)
            out[0] = -0.5 * (k1 * x1 + k2 * x2 + k3 * x3)
            out[1] = 0.5 * (w * k1 + k2 * x3 - k3 * x2)
            out[2] = 0.5 * (w * k2 + k3 * x1 - k1 * x3)
            out[3] = 0.5 * (w * k3 + k1 * x2 - k2 * x1)
            n1, n2, n3 = n[0] - f1 * s, n[1] - f2 * s, n[2] - f3 * s
            out[4], out[5], out[6] = n2 * c - n3 * b, n3 * a - n1 * c, n1 * b - n2 * a

        y = np.zeros((10, np.shape(m)[1]), dtype=complex)
        y[W], y[M] = 1.0, m
        return np.array(list(steps(slope, y, pieces)))

    def index(self, m: Any, n: Any, *, pieces: int = COARSE, to_the_end: bool = False) -> int:
        """Number of conjugate points for moment and force (3,) at the first clamp, by so many ``pieces`` of the rod.

        Those of the last piece count where it is looked at ``to_the_end``, at which all states of a rod that may turn
        are singular.
        """
        start = np.repeat(np.array([*m, *n], dtype=complex)[:, None], 6, axis=1) + 1j * STEP * np.eye(6)
        passed = self.states(start[:3], start[3:], pieces)
        signs = []
        for y in passed[int(BEGIN * pieces) : None if to_the_end else -1]:
            back = np.array([y[W], *-y[U]]).real
            matrix = np.vstack([y[R].imag, times(y[:4].imag, back)[1:]]) / STEP
            signs.append(np.linalg.slogdet(matrix)[0])
        return int((np.diff(signs) != 0).sum())


@dataclass(frozen=True)
class Branch:
    """Equilibria (m + 1,) along a branch, the last entry of each the load, and the scaled derivatives (m, m + 1)."""

    misfit: Misfit
    scale: np.ndarray
    points: list[np.ndarray]
    derivatives: list[np.ndarray]

    @classmethod
    def follow(
        cls,
        misfit: Misfit,
        u: Any,
        scale: Sequence[float],
        span: tuple[float, float],
        back: float | None = None,
    ) -> "Branch":
        """Continue from a guess of all unknowns at the load ``span[0]`` until the load leaves ``span``.

        Or, if it is given, until the load has turned and comes back to ``back``.
        """
        branch = cls(misfit, np.array(scale), [], [])
        u, derivative = branch.correct(np.array([*u[:-1], span[0]]), np.eye(len(u))[-1])
        t = tangent(derivative)
        t, step, (low, high) = t * np.sign(t[-1] * (span[1] - span[0])), FIRST, sorted(span)
        ahead = np.sign(span[1] - span[0])
        while True:
            branch.points.append(u)
            branch.derivatives.append(derivative)
            if len(branch.points) > 1:
                before = branch.points[-2][-1]
                turned = back is not None and ahead * (u[-1] - back) <= 0 < ahead * (before - back)
                if turned or not low < u[-1] < high:
                    return branch
            u, derivative, t, step = branch.onward(u, t, step)

    def onward(self, u: np.ndarray, t: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
        """Next point, its derivative and tangent, and the step from there."""
        while step > SHORTEST:
            try:
                new, derivative = self.correct(u + step * self.scale * t, t)
            except (AssertionError, np.linalg.LinAlgError):
                step /= 2
                continue
            ahead = tangent(derivative)
            ahead *= np.sign(ahead @ t)
            if ahead @ t > TURN:
                return new, derivative, ahead, min(LONGEST, step * (1.5 if ahead @ t > 1 - (1 - TURN) / 2 else 1.0))
            step /= 2
        raise AssertionError(f"the branch of the reference ends at {u}")

    def correct(self, u: np.ndarray, normal: np.ndarray, pieces: int = COARSE) -> tuple[np.ndarray, np.ndarray]:
        """Point in the plane through ``u`` across the scaled ``normal``, and the scaled derivative a last step away."""
        for _ in range(10):
            left, derivative = linear(lambda u: self.misfit(u, pieces), u)
            derivative = derivative * self.scale
            step = np.linalg.lstsq(np.vstack([derivative, normal]), [*left, 0.0], rcond=ROUND_OFF)[0]
            u = u - step * self.scale
            if abs(step).max() < NEAR:
                return u, derivative
            if abs(step).max() > FAR:
                break
        assert abs(step).max() < ROUND_OFF, "shooting does not converge"
        return u, derivative

    def changes(self, index: Callable[[np.ndarray], int]) -> list[Change]:
        """Loads at which the determinant changes its sign, and the index halfway to the next of them."""
        steps = np.flatnonzero(np.diff([np.sign(determinant(d)) for d in self.derivatives]))
        bounds = [0, *steps + 1, len(self.points)]
        indices = [index(self.points[(i + j) // 2]) for i, j in pairwise(bounds)]
        return [Change(self.zero(i), *between) for i, between in zip(steps, pairwise(indices), strict=True)]

    def zero(self, i: int) -> float:
        """Load at which the determinant vanishes between a point and the next."""
        u, chord = self.points[i], self.points[i + 1] - self.points[i]
        known = {0.0: u, 1.0: u + chord}

        def at(part: float) -> np.ndarray:
            near = min(known, key=lambda other: abs(other - part))
            known[part] = self.correct(known[near] + (part - near) * chord, chord / self.scale, FINE)[0]
            return known[part]

        def singular(part: float) -> float:
            return determinant(linear(lambda u: self.misfit(u, FINE), at(part))[1] * self.scale)

        return float(at(brentq(singular, 0.0, 1.0, xtol=1e-12))[-1])


def tangent(derivative: np.ndarray) -> np.ndarray:
    """Unit vector that the derivative takes to zero."""
    return np.asarray(np.linalg.svd(derivative)[2][-1])


def determinant(derivative: np.ndarray) -> float:
    """What vanishes at folds and branch points."""
    return float(np.linalg.det(derivative[:, :-1]))

"""Equilibria of a rod by shooting: an initial value problem in quaternion, moment and centreline, integrated by scipy.

Derivatives with respect to what is shot for are exact, by complex steps. No finite element has a part in it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from scipy.integrate import solve_ivp

STEP = 1e-30


@dataclass(frozen=True)
class Rod:
    """Bending and twisting stiffness, intrinsic strains ``k``, stiffness in ``n3 = stretching log v3``; length 1."""

    stiffness: tuple[float, float, float] = (1.0, 1.0, 1.0)
    intrinsic: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stretching: float = inf

    def integrate(self, p: np.ndarray) -> np.ndarray:
        """State at s = 1 for force and moment ``p`` (6, m) at s = 0: rows q (4), m (3, fixed axes), r (3), energy."""
        p = np.atleast_2d(p.T).T
        n, columns = p[:3], p.shape[1]
        b, k0 = np.array(self.stiffness)[:, None], np.array(self.intrinsic)[:, None]

        def slope(_: float, y: np.ndarray) -> np.ndarray:
            y = y.reshape(11, columns)
            w, u = y[0], y[1:4]
            d = self._rotate(-u, w, y[4:7]) / b  # k - k0 in the body frame
            k = d + k0
            d3 = self._rotate(u, w, np.array([0.0, 0.0, 1.0])[:, None] + 0 * u)
            v3 = np.exp((n * d3).sum(axis=0) / self.stretching)
            stretch = 0.0 if self.stretching == inf else self.stretching * (v3 * np.log(v3) - v3 + 1)
            dw = -0.5 * (u * k).sum(axis=0)
            du = 0.5 * (w * k + self._cross(u, k))
            energy = 0.5 * (b * d * d).sum(axis=0) + stretch
            return np.vstack([dw, du, self._cross(n, v3 * d3), v3 * d3, energy]).ravel()

        y = np.zeros((11, columns), dtype=p.dtype)
        y[0], y[4:7] = 1.0, p[3:]
        found = solve_ivp(slope, (0, 1), y.ravel(), method="DOP853", rtol=3e-13, atol=1e-13, max_step=0.03)
        return found.y[:, -1].reshape(11, columns)

    @staticmethod
    def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])

    def _rotate(self, u: np.ndarray, w: np.ndarray, a: np.ndarray) -> np.ndarray:
        t = 2 * self._cross(u, a)
        return a + w * t + self._cross(u, t)


@dataclass(frozen=True)
class Problem:
    """A rod with rows of its end state that must vanish, and as many entries of ``p`` that are shot for."""

    rod: Rod
    rows: Sequence[int]
    shot: Sequence[int]

    def jacobian(self, p: np.ndarray, shot: Sequence[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """End state for ``p``, and the derivative of what must vanish with respect to what is shot for."""
        columns = self.shot if shot is None else shot
        complex_p = np.repeat(p[:, None].astype(complex), len(columns), axis=1)
        complex_p[columns, range(len(columns))] += 1j * STEP
        end = self.rod.integrate(complex_p)
        return end[:, 0].real, end[self.rows].imag / STEP

    def singular(self, p: np.ndarray) -> float:
        """Determinant that vanishes at folds and branch points."""
        return float(np.linalg.det(self.jacobian(p)[1]))

    def solve(self, p: np.ndarray, shot: Sequence[int] | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Newton's method from ``p``: the solution, and its end state."""
        columns = list(self.shot if shot is None else shot)
        p = np.array(p, dtype=float)
        for _ in range(12):
            end, derivative = self.jacobian(p, columns)
            step = np.linalg.solve(derivative, end[self.rows])
            p[columns] -= step
            if abs(step).max() < 1e-9 * (1 + abs(p).max()):
                break
        else:
            raise AssertionError("shooting does not converge")
        return p, self.rod.integrate(p)[:, 0]

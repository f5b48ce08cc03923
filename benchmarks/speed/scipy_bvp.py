"""The same rods with scipy's solve_bvp: what a Python user would try.

    python -m benchmarks.speed.scipy_bvp cord "branch 1" 1e-6 60 49 40 36      # tolerance, loads in the order to solve

The equations are those of `benchmarks/auto/rod.f90`: quaternion, moment and centreline, unknown forces as parameters,
derivatives by scipy's finite differences.  From a shot state near the reference load each load in turn starts from the
solution at the one before (natural continuation) on 41 even nodes: on scipy's own mesh, which only grows, it takes far
longer.  A line of JSON for each tells time and ordinate.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, nan, pi
from time import process_time
from typing import Any

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp

MOST = 20_000
"""Mesh nodes at which solve_bvp is to give up."""


def rotated(q: np.ndarray, a: np.ndarray, sign: float = 1.0) -> np.ndarray:
    """R(q) a, or with sign -1 its transpose times a; (4, n) and (3, n), |q| = 1."""
    t = 2 * np.cross(sign * q[1:], a, axis=0)
    return a + q[0] * t + np.cross(sign * q[1:], t, axis=0)


NormalForm = Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Rod:
    """A boundary value problem: law (m, n3) -> (k, v), end conditions, unknown parameters and a first state.

    ``force(load, p)`` is the contact force, ``drift(p)`` what is added to q' and m' for conditions that are stated
    twice, and for a symmetry; ``residual(a, b, load)`` the conditions on the end states; ``p`` and ``m`` (moment at the
    first end) start the integration of a first guess at load ``at``; ``across(r)`` is the ordinate at ``place``.
    """

    law: NormalForm
    interval: tuple[float, float]
    force: Callable[[float, np.ndarray], list[float]]
    residual: Callable[[np.ndarray, np.ndarray, float], np.ndarray]
    at: float
    p: tuple[float, ...]
    m: tuple[float, float, float]
    place: float
    ordinate: Callable[[np.ndarray], float]
    eps: int | None = None
    delta: int | None = None

    def slope(self, y: np.ndarray, p: np.ndarray, load: float) -> np.ndarray:
        """Right-hand side for states in columns."""
        q, m, r = y[:4], y[4:7], y[7:]
        force = np.array(self.force(load, p), dtype=float)[:, None] + 0 * m
        n = rotated(q, force, -1.0)
        k, v = self.law(m, n[2])
        dq = 0.5 * np.vstack([-(q[1:] * k).sum(axis=0), q[0] * k + np.cross(q[1:], k, axis=0)])
        dm = -np.cross(k, m, axis=0) - v * np.vstack([-n[1], n[0], 0 * n[0]])
        along = np.zeros_like(m)
        along[2] = v
        if self.eps is not None:
            dq += p[self.eps] * q
        if self.delta is not None:
            dm += p[self.delta] * rotated(q, np.vstack([-r[2], 0 * r[2], 0 * r[2]]), -1.0)
        return np.vstack([dq, dm, rotated(q, along)])

    def guess(self, nodes: int = 41) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mesh, state and parameters near the solution at ``at``, by integration from the first end."""
        a, b = self.interval
        left = self.residual(np.zeros(10), np.zeros(10), self.at)
        start = np.array([1.0, 0, 0, 0, *self.m, 0, 0, -left[6]])
        p = np.array(self.p)
        x = np.linspace(a, b, nodes)

        def slope(_: float, y: np.ndarray) -> np.ndarray:
            return self.slope(y[:, None], p, self.at)[:, 0]

        return x, solve_ivp(slope, (a, b), start, t_eval=x, rtol=1e-8, atol=1e-10).y, p


def diagonal(stiffness: tuple[float, float, float], k2: float = 0.0, stretching: float = np.inf) -> NormalForm:
    """Uncoupled law with intrinsic curvature k2, and v = exp(n3/stretching)."""
    B, k0 = np.array(stiffness)[:, None], np.array([[0.0], [k2], [0.0]])
    return lambda m, n3: (m / B + k0, np.exp(n3 / stretching))


def coupled(m: np.ndarray, n3: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The hemitropic law: n3 = 10 (v - 1) - 3 k3, m3 = -3 (v - 1) + k3."""
    return np.vstack([m[0], m[1], 10 * m[2] + 3 * n3]), 1 + n3 + 3 * m[2]


def both_clamped(a: np.ndarray, b: np.ndarray, load: float) -> np.ndarray:
    """Aligned clamps at -+3 (1 - load) e3."""
    left = [a[0] - 1, a[1], a[2], a[3], a[7], a[8], a[9] + 3 * (1 - load)]
    right = [b[0] - 1, b[1], b[2], b[3], b[7], b[8], b[9] - 3 * (1 - load)]
    return np.array(left + right)


def aligned(a: np.ndarray, b: np.ndarray, load: float) -> np.ndarray:
    """Clamp at the origin; at the other end no rotation, and no displacement across."""
    return np.array([a[0] - 1, *a[1:4], *a[7:10], b[0] - 1, *b[1:4], b[7], b[8]])


def cantilever(a: np.ndarray, b: np.ndarray, load: float) -> np.ndarray:
    """Clamp at the origin, no moment at the other end."""
    return np.array([a[0] - 1, *a[1:4], *a[7:10], *b[4:7]])


def cord(m: tuple[float, float, float], N2: float) -> Rod:
    """The telephone cord; parameters N1, N2, eps."""
    return Rod(
        *(diagonal((1, 1, 1), 3 * pi), (0.0, 1.0), lambda lam, p: [p[0], p[1], lam], aligned, 40.0, (0.0, N2, 0.0), m),
        *(1.0, lambda r: 1 - r[2], 2),
    )


def hemitropic(m: tuple[float, float, float], N2: float, N3: float) -> Rod:
    """The hemitropic rod; parameters N2, N3, eps, delta, and N1 = 0 as phase condition."""
    return Rod(
        *(coupled, (-3.0, 3.0), lambda lam, p: [0.0, p[0], p[1]], both_clamped, 0.5, (N2, N3, 0.0, 0.0), m),
        *(0.0, lambda r: hypot(r[0], r[1]), 2, 3),
    )


RODS = {
    ("cord", "branch 1"): cord((-4.7871, -2.3612, 0.0001), 0.0),
    ("cord", "branch 2"): cord((9.7816, -7.1178, 1.4009), -35.3826),
    ("hemitropic", "branch 1"): hemitropic((-0.6625, -0.9745, 0.169), 0.4417, -1.004),
    ("hemitropic", "branch 2"): hemitropic((-1.3197, 0.8184, 0.4109), 0.8798, -1.9326),
    ("ruler", "branch 1"): Rod(
        *(diagonal((1, 10, 1), 0.0, 20.0), (0.0, 1.0), lambda lam, p: [lam, 0.0, 0.0], cantilever, 6.0, ()),
        *((0.0, 4.9949, -2.6007), 1.0, lambda r: abs(r[1])),
    ),
}


def solve(rod: Rod, load: float, x: np.ndarray, y: np.ndarray, p: np.ndarray, tolerance: float) -> Any:
    """Solve at one load from a guess."""

    def slope(_: np.ndarray, y: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        return rod.slope(y, np.zeros(0) if p is None else p, load)

    def ends(a: np.ndarray, b: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
        return rod.residual(a, b, load)

    return solve_bvp(slope, ends, x, y, p if len(p) else None, tol=tolerance, max_nodes=MOST)


def follow(rod: Rod, loads: list[float], tolerance: float) -> None:
    """Solve at the first load's guess, then at each load in turn, printing as it goes."""
    x, y, p = rod.guess()
    first = solve(rod, rod.at, x, y, p, tolerance)
    for way in ([load for load in loads if load >= rod.at], [load for load in loads[::-1] if load < rod.at]):
        found = first
        for load in way:
            started = process_time()
            guess = np.array([]) if found.p is None else found.p
            new = solve(rod, load, x, found.sol(x), guess, tolerance)
            seconds = process_time() - started
            ordinate = rod.ordinate(new.sol(rod.place)[7:]) if new.success else nan
            if not new.success or ordinate < 1e-3:  # fallen back to the branch that it leaves
                print(json.dumps({"load": load, "stopped": new.message}), flush=True)
                break
            found = new
            print(json.dumps({"load": load, "seconds": seconds, "nodes": len(new.x), "ordinate": ordinate}), flush=True)


def main() -> None:
    """Print what is measured."""
    scene, branch, tolerance, *loads = sys.argv[1:]
    follow(RODS[scene, branch], sorted(map(float, loads)), float(tolerance))


if __name__ == "__main__":
    main()

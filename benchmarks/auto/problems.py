"""The boundary value problems of the demos for AUTO: what each Fortran file holds, and which branches to trace."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.auto.output import State
from benchmarks.targets import TARGETS, Target


@dataclass(frozen=True)
class Branch:
    """One run of AUTO: the first starts from STPNT, the others from a branch point of the first.

    ``stop`` are loads at which to stop, ``until`` is AUTO's SP (special points at which to stop), ``start`` the branch
    point to start from, counted from 0.
    """

    name: str
    targets: tuple[Target, ...]
    ds: float
    dsmax: float
    stop: tuple[float, ...] = ()
    until: str = ""
    start: int | None = None


@dataclass(frozen=True)
class Problem:
    """A boundary value problem for AUTO, and the branches to trace.

    ``icp`` are the free parameters (the first is the load), then what PVLS computes; ``ordinate`` is a parameter or a
    function of the state.
    """

    name: str
    sources: tuple[str, ...]
    ndim: int
    nbc: int
    icp: tuple[int, ...]
    free: int
    branches: tuple[Branch, ...]
    ordinate: int | Callable[[State], float] = 0
    note: str = ""


def midpoint(state: State) -> float:
    """Transverse displacement of the middle of the hemitropic rod.

    AUTO is accurate to order 2 NCOL at mesh points, and to order NCOL + 1 only between them.  Hence the equations
    are integrated from the mesh point nearest to the middle: half an interval at most, by Runge-Kutta's method.
    """
    nodes = np.arange(0, len(state.t), state.ncol)
    start = nodes[np.argmin(abs(state.t[nodes] - 0.5))]
    u, steps = state.u[start], 32
    step = 6 * (0.5 - state.t[start]) / steps  # of arclength: the rod's length is 6
    for _ in range(steps if step else 0):
        k1 = slope(u, state.par)
        k2 = slope(u + step / 2 * k1, state.par)
        k3 = slope(u + step / 2 * k2, state.par)
        u = u + step / 6 * (k1 + 2 * k2 + 2 * k3 + slope(u + step * k3, state.par))
    return math.hypot(u[7], u[8])


def slope(u: np.ndarray, par: np.ndarray) -> np.ndarray:
    """The right-hand side of hemitropic.f90, without eps and delta, which are zero."""
    a, w, m = u[0], u[1:4], u[4:7]
    force = np.array([0.0, par[1], par[2]])
    n = (a * a - w @ w) * force + 2 * (w @ force) * w - 2 * a * np.cross(w, force)
    k = np.array([m[0], m[1], 10 * m[2] + 3 * n[2]])
    v = np.array([0.0, 0.0, 1 + n[2] + 3 * m[2]])
    dr = (a * a - w @ w) * v + 2 * (w @ v) * w + 2 * a * np.cross(w, v)
    return np.concatenate([[-w @ k / 2], (a * k + np.cross(w, k)) / 2, -np.cross(k, m) - np.cross(v, n), dr])


def branch(
    scene: str, name: str, ds: float, dsmax: float, *stop: float, until: str = "", start: int | None = None
) -> Branch:
    """A branch with the targets that all programs share."""
    return Branch(name, TARGETS[scene][name], ds, dsmax, stop, until, start)


CORD = Problem(
    name="cord",
    sources=("rod", "cord"),
    ndim=10,
    nbc=13,
    icp=(1, 2, 3, 4, 5),
    free=4,
    ordinate=5,
    branches=(
        branch("cord", "straight", -0.5, 5.0, 0.0),
        branch("cord", "branch 1", 0.1, 5.0, 49.5, until="BP1", start=0),
        branch("cord", "branch 2", 0.1, 5.0, 60.0, start=1),
    ),
    note="branch 1 ends where it meets another branch, at lam = 35.80",
)

HEMITROPIC = Problem(
    name="hemitropic",
    sources=("rod", "hemitropic_law", "hemitropic"),
    ndim=10,
    nbc=14,
    icp=(1, 2, 3, 4, 5),
    free=5,
    ordinate=midpoint,
    branches=(
        branch("hemitropic", "straight", 0.01, 0.2, 0.95),
        branch("hemitropic", "branch 1", 0.01, 0.2, 0.95, start=0),
        branch("hemitropic", "branch 2", 0.01, 0.2, 0.6, start=1),
    ),
    note="branch 2 stops at lam = 0.6: at 0.6124 the stretch reaches zero, which AUTO does not notice",
)

HALF = replace(
    HEMITROPIC,
    name="hemitropic-half",
    sources=("rod", "hemitropic_law", "hemitropic_half"),
    nbc=12,
    icp=(1, 2, 3, 4),
    free=3,
    ordinate=4,
    note="half the rod, using the flip symmetry",
)

RULER = Problem(
    name="ruler",
    sources=("rod", "ruler"),
    ndim=8,
    nbc=8,
    icp=(1, 2),
    free=1,
    ordinate=2,
    branches=(
        branch("ruler", "plane", 0.1, 0.5, 12.0),
        branch("ruler", "branch 1", 0.1, 0.5, 12.0, start=0),
    ),
)

FOLLOWER = Problem(
    name="follower",
    sources=("rod", "follower"),
    ndim=7,
    nbc=10,
    icp=(1, 2, 3, 4),
    free=4,
    branches=(Branch("straight", (), 0.5, 2.0, (25.0,)),),
    note="no branch point up to P = 25: nothing for statics to find",
)

FLUTTER = Problem(
    name="flutter",
    sources=("flutter",),
    ndim=4,
    nbc=5,
    icp=(1, 2),
    free=2,
    ordinate=2,
    branches=(
        Branch(
            "mu1, mu2",
            tuple(replace(t, kind="LP" if t.kind == "HB" else t.kind) for t in TARGETS["follower"]["straight"]),
            *(0.5, 20.0, (-1.0,)),
        ),
    ),
    note="vibrations about the straight rod, linearised by hand: AUTO does not do that",
)

PROBLEMS = {problem.name: problem for problem in (CORD, HEMITROPIC, HALF, RULER, FOLLOWER, FLUTTER)}

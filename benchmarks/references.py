"""The reference values, computed anew when the benchmark runs: by none of the programs that are measured.

Straight states: roots of transcendental equations, and eigenvalues by Ritz's method with polynomials.  Bent states:
shooting with scipy's Runge-Kutta method of order 8.  Closed forms are those of the tests.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh, null_space
from scipy.optimize import newton

from benchmarks.shooting_solver import Problem, Rod
from benchmarks.targets import TARGETS

sys.path.append(str(Path(__file__).parents[1] / "tests"))

import closed_form_hemitropic
import closed_forms
import reference_values

K0 = 3 * pi
CORD = Problem(Rod(intrinsic=(0.0, K0, 0.0)), rows=[1, 2, 3, 7, 8], shot=[0, 1, 3, 4, 5])
RULER = Problem(Rod((1.0, 10.0, 1.0), stretching=20.0), rows=[4, 5, 6], shot=[3, 4, 5])
HEMITROPIC = (-3.0, 1.0, 1.0, 3.0)


@dataclass(frozen=True)
class Spectrum:
    """Left-most eigenvalues ``mu = omega^2`` of a straight rod at a load, and what they belong to."""

    scene: str
    load: float
    words: str
    values: tuple[float, ...]
    rho_A: float = 0.0
    rho_I: tuple[float, float, float] = (1.0, 1.0, 1.0)


def spectra() -> dict[str, Spectrum]:
    """Eigenvalues with closed forms or by Ritz's method, by name."""
    inertia = (1e-3, 1e-3, 2e-3)
    beck = tuple(float(closed_forms.column(near, 10.0).real) for near in (26.8, 345.5))
    return {
        "cord": Spectrum("cord", 20.0, "straight cord, unit rotary inertia", straight_cord(20.0)),
        "cord with mass": Spectrum(
            *("cord", 20.0, "straight cord, mass 1, rotary inertia 0.001 (1, 1, 2)"),
            *(straight_cord(20.0, 1.0, inertia), 1.0, inertia),
        ),
        "hemitropic": Spectrum(
            *("hemitropic", 0.2, "straight hemitropic rod, unit rotary inertia"),
            tuple(closed_form_hemitropic.spectrum(0.2, *HEMITROPIC)[:3]),
        ),
        "follower": Spectrum(
            "follower", 10.0, "rod under a follower load, mass 1, weak plane", beck, 1.0, (0.0, 0.0, 0.0)
        ),
    }


def straight_cord(
    lam: float, rho_A: float = 0.0, rho_I: tuple[float, float, float] = (1.0, 1.0, 1.0), degree: int = 32
) -> tuple[float, ...]:
    """Three left-most eigenvalues of the straight cord, by Ritz's method with the polynomials (1 - x^2) P_j(x).

    To second order in a small rotation theta its energy is

        1/2 int |theta'|^2 + k0 (theta_3 theta_1' - theta_1 theta_3') + lam (theta_1^2 + theta_2^2) ds

    for all theta that vanish at the clamps, with int theta_1 = int theta_2 = 0; (r_1, r_2)' = (theta_2, -theta_1).
    """
    x, weights = legendre.leggauss(degree + 6)
    half = 0.5
    shapes = [legendre.legmul([2 / 3, 0, -2 / 3], row) for row in np.eye(degree)]
    f = np.array([legendre.legval(x, c) for c in shapes])
    df = np.array([legendre.legval(x, legendre.legder(c)) for c in shapes]) / half
    integral = np.array([legendre.legval(x, legendre.legint(c, lbnd=-1)) for c in shapes]) * half
    ds, zero = half * weights, np.zeros((degree, degree))
    mass, across = (f * ds) @ f.T, (integral * ds) @ integral.T
    stiff, mixed = (df * ds) @ df.T, K0 * (f * ds) @ df.T
    K = np.block(
        [[stiff + lam * mass, zero, mixed.T], [zero, stiff + lam * mass, zero], [mixed, zero, stiff]],
    )
    M = np.block(
        [[(rho_I[i] * mass + (rho_A * across if i < 2 else 0)) if i == j else zero for j in range(3)] for i in range(3)]
    )
    constraints = np.zeros((3 * degree, 2))
    constraints[:degree, 0] = constraints[degree : 2 * degree, 1] = f @ ds
    kernel = null_space(constraints.T)
    values = eigh(kernel.T @ K @ kernel, kernel.T @ M @ kernel, eigvals_only=True)
    return tuple(float(v) for v in values[:3])


def shot_cord(load: float, guess: tuple[float, ...]) -> float:
    """Ordinate 1 - r3(1) of a bent cord; ``guess`` has force and moment at s = 0."""
    p = np.array(guess)
    p[2] = load
    return float(1 - CORD.solve(p)[1][9])


def fold_of_cord() -> float:
    """Load at which, on the second branch, the linearised problem of shooting is singular."""
    state = np.array([0.0, -10.508, 7.8066, 4.86, -8.93, -0.042])

    def singular(moment: float) -> float:
        state[4] = moment
        state[:] = CORD.solve(state, shot=[0, 1, 2, 3, 5])[0]
        return CORD.singular(state)

    newton(singular, -8.93, x1=-8.931, tol=1e-9)
    return float(state[2])


def ruler_buckles() -> float:
    """Load at which the linearised problem of shooting is singular on the way that stays in the plane."""

    def singular(lam: float) -> float:
        return RULER.singular(RULER.solve(np.array([lam, 0, 0, 0, 0.8 * lam, 0]))[0])

    return float(newton(singular, 4.43, x1=4.44, tol=1e-11))


def shot_ruler(load: float) -> float:
    """Tip displacement out of the plane on the first buckled branch, followed from load 6."""
    p = np.array([6.0, 0, 0, 0, 5.0, -2.6])
    for lam in np.linspace(6.0, load, 5):
        p[0] = lam
        p, end = RULER.solve(p)
    return float(abs(end[8]))


def again() -> dict[tuple[str, str, str], float]:
    """The references of :data:`benchmarks.targets.TARGETS` by scene, branch and name, computed anew."""
    first, second = closed_forms.tensions(1.5)[:2]
    one, two = closed_form_hemitropic.loads(*HEMITROPIC)[:2]
    P, _ = closed_forms.double(20.0, 120.0)
    found = {
        "cord": (
            *(first, second, shot_cord(40.0, (0, 0, 40, -4.79, -2.36, 0))),
            *(fold_of_cord(), shot_cord(40.0, (0, -35.38, 40, 9.78, -7.12, 1.40))),
        ),
        "hemitropic": (
            one,
            two,
            reference_values.FIRST[0.5][0],
            reference_values.FOLD[0],
            reference_values.SECOND[0.5][0],
        ),
        "ruler": (ruler_buckles(), shot_ruler(8.0)),
        "follower": (float(P), *(float(closed_forms.column(near, 10.0).real) for near in (26.8, 345.5))),
    }
    names = {scene: [(b, t.name) for b, ts in branches.items() for t in ts] for scene, branches in TARGETS.items()}
    return {
        (scene, *name): value
        for scene, values in found.items()
        for name, value in zip(names[scene], values, strict=True)
    }


def deviation() -> float:
    """Largest relative difference between the table of targets and what is computed anew."""
    values = again()
    return max(
        abs(values[scene, branch, target.name] / target.reference - 1)
        for scene, branches in TARGETS.items()
        for branch, targets in branches.items()
        for target in targets
    )


if __name__ == "__main__":
    for key, value in again().items():
        print(*key, repr(value), sep="; ")
    print("largest relative deviation", deviation())
    for name, spectrum in spectra().items():
        print(name, spectrum.values)

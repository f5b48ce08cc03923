"""Equilibria and folds of rods in a plane by shooting: an initial value problem by the Runge-Kutta method of order 8.

Derivatives are exact, by complex steps.  No finite element, and nothing of rodfem, has a part in it.

The plane is that of e1 and e3; the section at ``s`` has the angle ``a``, with ``d1 = (cos a, -sin a)`` and
``d3 = (sin a, cos a)``.  With force n and moment m about e2,

    a' = k0 + m/B,    r' = (n.d1/GA) d1 + (1 + n.d3/EA) d3,    n' = -f,    m' = x' n_z - z' n_x.
"""

from collections.abc import Callable, Iterator
from math import inf
from typing import Any

import numpy as np
from scipy.integrate import DOP853

PIECES = 40
"""Steps along a rod, by the coefficients of scipy's DOP853."""
STEP, APART = 1e-30, 1e-5
"""Complex step of a derivative, and real step of one of a determinant, which Newton's method alone uses."""
ANGLE, X, Z, MOMENT, NX, NZ = range(6)
"""Rows of a state."""
ROWS, WEIGHTS = DOP853.A.astype(complex), DOP853.B.astype(complex)
"""Those coefficients."""
Slope = Callable[[float, np.ndarray, np.ndarray], None]
"""What writes the derivative of a state (m, columns), at a part of the length, into an array of the same shape."""
Misfit = Callable[[np.ndarray], np.ndarray]
"""What has to vanish, (m, columns), of m + 1 unknowns, (m + 1, columns), the last of which is the load."""


def steps(slope: Slope, y: np.ndarray, pieces: int, length: Any = 1.0) -> Iterator[np.ndarray]:
    """States (m, columns) after each of the ``pieces`` of a ``length``, which may be that of each column."""
    h, stages = length / pieces, np.zeros((len(DOP853.C), *y.shape), dtype=complex)
    flat = stages.reshape(len(stages), -1)  # the same memory
    for i in range(pieces):
        for j, c in enumerate(DOP853.C):
            slope((i + c) / pieces, y + h * (ROWS[j, :j] @ flat[:j]).reshape(y.shape), stages[j])
        y = y + h * (WEIGHTS @ flat).reshape(y.shape)
        yield y


def integrate(
    start: Any, B: Any = 1.0, EA: Any = inf, GA: Any = inf, k0: Any = 0.0, f: Any = (0.0, 0.0), length: Any = 1.0
) -> np.ndarray:
    """State at the end of a rod, (6, columns), from that at its start; constants may be those of columns."""
    rows = [np.asarray(row, dtype=complex) for row in start]
    y = np.array(np.broadcast_arrays(*rows, np.asarray(f[0]), np.asarray(length))[:6], dtype=complex)

    def slope(_: float, y: np.ndarray, out: np.ndarray) -> None:
        a, _, _, m, nx, nz = y
        cos, sin = np.cos(a), np.sin(a)
        shear, stretch = (nx * cos - nz * sin) / GA, 1 + (nx * sin + nz * cos) / EA
        dx, dz = shear * cos + stretch * sin, -shear * sin + stretch * cos
        out[X], out[Z] = dx, dz
        out[ANGLE], out[MOMENT] = k0 + m / B, dx * nz - dz * nx
        out[NX], out[NZ] = -f[0], -f[1]

    for end in steps(slope, y, PIECES, length):
        y = end
    return y


def linear(misfit: Misfit, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Misfit at ``u``, and its derivative (m, m + 1)."""
    columns = np.repeat(u[:, None].astype(complex), len(u), axis=1) + 1j * STEP * np.eye(len(u))
    found = misfit(columns)
    return found[:, 0].real, found.imag / STEP


def determinant(misfit: Misfit, u: np.ndarray) -> float:
    """What vanishes at folds and branch points."""
    return float(np.linalg.det(linear(misfit, u)[1][:, :-1]))


def solve(misfit: Misfit, guess: Any, load: float) -> np.ndarray:
    """Equilibrium at a load, by Newton's method; raises :class:`AssertionError` where it does not converge."""
    u = np.array([*guess, load], dtype=float)
    for _ in range(8):
        left, derivative = linear(misfit, u)
        step = np.linalg.solve(derivative[:, :-1], left)
        u[:-1] -= step
        if abs(step).max() < 1e-11 * (1 + abs(u).max()):
            return u
    raise AssertionError("shooting does not converge")


def fold(misfit: Misfit, guess: Any) -> np.ndarray:
    """Fold near a guess of all unknowns: there the determinant vanishes, too."""
    u = np.array(guess, dtype=float)
    for _ in range(30):
        left, derivative = linear(misfit, u)
        shifts = APART * np.diag(1 + abs(u))
        slopes = [(determinant(misfit, u + h) - determinant(misfit, u - h)) / (2 * h.sum()) for h in shifts]
        step = np.linalg.solve(np.vstack([derivative, slopes]), [*left, determinant(misfit, u)])
        u -= step
        if abs(step).max() < 1e-10 * (1 + abs(u).max()):
            return u
    raise AssertionError("the fold is not found")

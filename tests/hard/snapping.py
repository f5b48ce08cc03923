"""Rods that snap in a plane as their clamps are turned by ``t``, against shooting; length and stiffness are one.

The ends of a strip are D apart; the last clamp is turned by t, the first one by ``ratio t``.  The arch that bends to
one side is followed from t = 0 until it loses its stability (Cazzolli & Dal Corso 2019, Int. J. Solids Struct. 162).

A cantilever of natural curvature k0 carries a dead load P at its tip, against the direction of the clamp at t = 0.  By
the angle b of the tip, where no moment acts, the angle t of the clamp is explicit: its extremes are the two folds of a
hysteresis (Dhanakoti 2024, arXiv 2407.07601).
"""

from __future__ import annotations

from math import inf, pi, sqrt
from typing import Any

import numpy as np
import ufl
from classics import column
from hard.case import Change, Measured, compare, run, said, singular
from hard.shooting_plane import ANGLE, STEP, Misfit, X, Z, determinant, fold, integrate, solve
from scipy.optimize import brentq

from forms.energy import bending_and_twist
from rodfem import Discretization, Ordinate, Scene, clamped, free

SHALLOW = 0.9
"""Distance at which moment and force of the shallow arch are a first guess."""
MARCH = 0.15
"""Steps of t of the reference, over the greatest angle of the arch."""


def between_clamps(distance: float, ratio: float) -> Misfit:
    """Angle and position of the last end, by moment and force at the first."""

    def misfit(u: np.ndarray) -> np.ndarray:
        m, nx, nz, t = u
        end = integrate((ratio * t, 0.0, 0.0, m, nx, nz))
        return np.array([end[ANGLE] - t, end[X], end[Z] - distance])

    return misfit


def snap(distance: float, ratio: float) -> float:
    """Angle t of the first fold."""
    misfit, bow = between_clamps(distance, ratio), 2 * sqrt(1 - distance)
    passed = [np.array([2 * pi * bow, 0.0, -4 * pi * pi, 0.0])]
    for nearer in np.linspace(max(distance, SHALLOW), distance, 6):
        passed = [solve(between_clamps(nearer, ratio), passed[0][:-1], 0.0)]
    sign = np.sign(determinant(misfit, passed[0]))
    while np.sign(determinant(misfit, passed[-1])) == sign:
        guess = passed[-1] if len(passed) < 2 else 2 * passed[-1] - passed[-2]
        try:
            passed.append(solve(misfit, guess[:-1], passed[-1][-1] + MARCH * bow))
        except (AssertionError, np.linalg.LinAlgError):
            break
    return float(fold(misfit, 1.5 * passed[-1] - 0.5 * passed[-2])[-1])


def strip(distance: float, ratio: float) -> Scene:
    """The arch between its clamps, the load t."""
    bow = sqrt(1 - distance)

    def turned(part: float) -> Any:
        return lambda c: (ufl.cos(part * c.t / 2), 0.0, ufl.sin(part * c.t / 2), 0.0)

    def start(s: np.ndarray) -> np.ndarray:
        half = bow * np.sin(2 * pi * s)
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    return column(
        "strip", (clamped(rotation=turned(ratio)), clamped(lambda c: (0.0, 0.0, c.D), turned(1.0))),
        (0.0, 4 * bow), load="t", planar="e2", constants={"t": 0.0, "D": distance, "B2": 1.0}, start=start,
        ordinate=Ordinate("rise", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip


def snapping(distance: float, ratio: float) -> Measured:
    """The first loss of stability, and the index on either side."""
    diagram = run(strip(distance, ratio), Discretization("auto", 8, 6))
    found = singular(diagram[0])[:1]
    if not found:
        return Measured(inf, 1.0, said(diagram), f"{diagram[0]} without a loss of stability")
    return compare(found, [Change(snap(distance, ratio), 0, 1)], said(diagram))


CURVED = 0.5
"""Natural curvature of the cantilever."""
RANGE = 2.0
"""Largest angle of its clamp."""


def clamp_of(tip: np.ndarray, load: float) -> np.ndarray:
    """Angles of the clamp for angles of the tip, (m,)."""
    return np.asarray(integrate((tip, 0.0, 0.0, 0.0, 0.0, -load), k0=CURVED, length=-1.0)[ANGLE])


def extremes(load: float) -> list[float]:
    """Angles of the clamp within the range that are extreme for some angle of the tip."""

    def slope(tip: Any) -> np.ndarray:
        return np.asarray(clamp_of(np.atleast_1d(tip) + 1j * STEP, load).imag / STEP)

    tips = np.linspace(-2 * pi, 2 * pi, 401)
    change = np.flatnonzero(np.diff(np.sign(slope(tips))))
    found = [brentq(lambda b: slope(b)[0], tips[i], tips[i + 1], xtol=1e-14) for i in change]
    angles = clamp_of(np.array(found), load).real
    return [float(t) for t in angles if abs(t) < RANGE]


def hysteresis(load: float) -> Measured:
    """Both folds, and the index on either side of each."""
    scene = column(
        "hysteresis", (clamped(rotation=lambda c: (ufl.cos(c.t / 2), 0.0, ufl.sin(c.t / 2), 0.0)),
                       free(lambda c: (0.0, 0.0, -c.P))),
        (-RANGE, RANGE), load="t", planar="e2", constants={"t": -RANGE, "P": load, "B2": 1.0, "k": CURVED},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k, k[2]), (c.B1, c.B2, c.C)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]),
    )  # fmt: skip
    diagram = run(scene, Discretization("auto", 8, 6))
    high, low = sorted(extremes(load), reverse=True)
    return compare(singular(diagram[0]), [Change(high, 0, 1), Change(low, 1, 0)], said(diagram))

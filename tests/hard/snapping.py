"""Rods that snap in a plane as their clamps are turned by ``t``, against shooting; length and stiffness are one.

The ends of a strip are D apart; the last clamp is turned by t, the first one by ``ratio t``.  The arch that bends to
one side is followed from t = 0 until it loses its stability (Cazzolli & Dal Corso 2019, Int. J. Solids Struct. 162).
For the ratios -1 and 1 the clamps have a symmetry, and a pitchfork takes the place of the fold.

A cantilever of natural curvature k0 carries a dead load P at its tip, against the direction of the clamp at t = 0.  By
the angle b of the tip, where no moment acts, the angle t of the clamp is explicit: its extremes are the two folds of a
hysteresis (Dhanakoti 2024, arXiv 2407.07601).
"""

from collections.abc import Callable
from math import inf, pi, sqrt
from typing import Any

import numpy as np
import ufl
from classics import BEAM, column
from hard.case import Change, Measured, compare, run, said, singular
from hard.shooting_plane import ANGLE, MOMENT, STEP, Misfit, X, Z, determinant, fold, integrate, solve
from hard.shooting_space import Branch
from scipy.optimize import brentq

from rodfem import Discretization, Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

SHALLOW = 0.9
"""Distance at which moment and force of the shallow arch are a first guess."""
FLAT = 0.99
"""Distance at which those of the S are."""
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


def conjugate(u: np.ndarray, ratio: float) -> int:
    """Index of an arch in its plane: places where turns and shifts are singular in moment and force at the start."""
    start = np.repeat(np.asarray(u[:3], dtype=complex)[:, None], 3, axis=1) + 1j * STEP * np.eye(3)
    lengths = np.linspace(0.1, 0.99, 41)
    ends = integrate((ratio * u[3], 0.0, 0.0, *np.tile(start, len(lengths))), length=np.repeat(lengths, 3))
    matrices = ends[[ANGLE, X, Z]].imag.reshape(3, len(lengths), 3).transpose(1, 0, 2) / STEP
    return int((np.diff(np.linalg.slogdet(matrices)[0]) != 0).sum())


def pitchfork(branch: Branch, across: Callable[[np.ndarray], float]) -> float:
    """Load at which perturbations across the symmetry are singular, on a branch of symmetric states."""
    signs = np.sign([across(u) for u in branch.points])
    (i,) = np.flatnonzero(np.diff(signs))
    u, chord = branch.points[i], branch.points[i + 1] - branch.points[i]

    def at(part: float) -> np.ndarray:
        return branch.correct(u + part * chord, chord / branch.scale)[0]

    return float(at(brentq(lambda part: across(at(part)), 0.0, 1.0, xtol=1e-13))[-1])


def symmetric(distance: float) -> list[Change]:
    """Clamps turned in opposite directions: pitchfork and fold of the arch without transverse force."""
    misfit, most = between_clamps(distance, -1.0), 4 * sqrt(1 - distance)

    def whole(u: np.ndarray) -> np.ndarray:
        return np.array([u[0], 0 * u[0], u[1], u[2]])

    def half(u: np.ndarray) -> np.ndarray:
        end = integrate((-u[2], 0.0, 0.0, u[0], 0.0, u[1]), length=0.5)
        return np.array([end[ANGLE], end[Z] - distance / 2])

    def sideways(u: np.ndarray) -> float:
        return determinant(misfit, whole(u)) / determinant(half, u)

    u = np.array([4 * pi * sqrt(1 - SHALLOW), 0.0, -4 * pi * pi, 0.0])
    for nearer in np.linspace(SHALLOW, distance, 6):
        u = solve(between_clamps(nearer, -1.0), u[:-1], 0.0)
    branch = Branch.follow(lambda u, pieces: half(u), u[[0, 2, 3]], (10.0, 50.0, 1.0), (0.0, most))
    (top,) = branch.changes(lambda u: conjugate(whole(u), -1.0))
    lost = pitchfork(branch, sideways)
    ends = [conjugate(whole(u), -1.0) for u in (branch.points[0], branch.points[-1])]
    return [Change(lost, ends[0], ends[0] + 1), Change(top.load, ends[1] - 1, ends[1])]


def sigmoid(distance: float) -> list[Change]:
    """Clamps turned alike: the S, downwards from where it has no thrust, x = t (s - 3 s^2 + 2 s^3) if it is flat."""
    misfit = between_clamps(distance, 1.0)

    def half(u: np.ndarray, distance: float = distance) -> np.ndarray:
        end = integrate((u[3], 0.0, 0.0, u[0], u[1], u[2]), length=0.5)
        return np.array([end[MOMENT], end[X], end[Z] - distance / 2])

    t = sqrt(10 * (1 - FLAT))
    u = np.array([-6 * t, -12 * t, 0.0, t])
    for bow in np.linspace(sqrt(1 - FLAT), sqrt(1 - distance), 40):
        u = solve(lambda u, D=1 - bow**2: half(u, D), u[:-1], sqrt(10) * bow)
    branch = Branch.follow(lambda u, pieces: half(u), u, (10.0, 50.0, 50.0, 1.0), (u[-1], 0.0))
    lost = pitchfork(branch, lambda u: determinant(misfit, u) / determinant(half, u))
    return [Change(lost, *(conjugate(u, 1.0) for u in (branch.points[0], branch.points[-1])))]


def opposite(distance: float) -> Measured:
    """Ratio -1: the symmetric arch is lost at a pitchfork shortly before its fold."""
    diagram = run(strip(distance, -1.0), Discretization("auto", 8, 6))
    return compare(singular(diagram[0]), symmetric(distance), said(diagram))


def alike(distance: float) -> Measured:
    """Ratio 1: the arch ends, stable, in an S that is stable from there on, and is not before."""
    (lost,) = sigmoid(distance)
    diagram = run(strip(distance, 1.0), Discretization("auto", 8, 6), depth=1)
    sides = {
        (p.load > lost.load, p.negative)
        for b in diagram.branches[1:]
        for p in b.points
        if abs(p.load - lost.load) > 1e-6
    }
    if len(diagram.branches) != 3 or sides != {(True, lost.before), (False, lost.after)}:
        return Measured(inf, 1.0, said(diagram), f"{diagram.branches} where {lost} was expected")
    return compare(singular(diagram[0]), [Change(lost.load, 0, 0)], said(diagram))


CURVED = 0.5
"""Natural curvature of the cantilever."""
RANGE = 2.0
"""Largest angle of its clamp."""


def clamp_of(tip: np.ndarray, load: float, share: float = 0.0) -> np.ndarray:
    """Angles of the clamp for angles of the tip, (m,), which a ``share`` of the load follows."""
    force = -share * load * np.sin(tip), -load * (1 - share + share * np.cos(tip))
    return np.asarray(integrate((tip, 0.0, 0.0, 0.0, *force), k0=CURVED, length=-1.0)[ANGLE])


def extremes(load: float, share: float = 0.0) -> list[float]:
    """Angles of the clamp within the range that are extreme for some angle of the tip."""

    def slope(tip: Any) -> np.ndarray:
        return np.asarray(clamp_of(np.atleast_1d(tip) + 1j * STEP, load, share).imag / STEP)

    tips = np.linspace(-2 * pi, 2 * pi, 401)
    change = np.flatnonzero(np.diff(np.sign(slope(tips))))
    found = [brentq(lambda b: slope(b)[0], tips[i], tips[i + 1], xtol=1e-14) for i in change]
    angles = clamp_of(np.array(found), load, share).real
    return [float(t) for t in angles if abs(t) < RANGE]


def turning(load: float, share: float, span: tuple[float, float]) -> Scene:
    """The cantilever whose clamp turns through a ``span`` of angles, and whose load follows its tip by a ``share``."""
    follower = {"follower": lambda c: (0.0, 0.0, -share * c.P)} if share else {}
    return column(
        "hysteresis", (clamped(rotation=lambda c: (ufl.cos(c.t / 2), 0.0, ufl.sin(c.t / 2), 0.0)),
                       free(lambda c: (0.0, 0.0, (share - 1) * c.P), **follower)),
        span, load="t", planar="e2", constants={"t": span[0], "P": load, "B2": 1.0, "k": CURVED},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k, k[2]), (c.B1, c.B2, c.C)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]), inertia=BEAM,
    )  # fmt: skip


def hysteresis(load: float) -> Measured:
    """Both folds, and the index on either side of each."""
    diagram = run(turning(load, 0.0, (-RANGE, RANGE)), Discretization("auto", 8, 6))
    high, low = sorted(extremes(load), reverse=True)
    return compare(singular(diagram[0]), [Change(high, 0, 1), Change(low, 1, 0)], said(diagram))

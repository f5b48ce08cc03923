"""Tendons against shooting: the balances of rod and tendons together, from ``W + sum T |v + k x d + d'|``."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
import ufl
from scipy.integrate import solve_ivp
from scipy.optimize import root
from scipy.spatial.transform import Rotation

import rodfem
from rodfem import Discretization, InputError, Ordinate, Scene, SceneError, clamped, free, tendon
from rodfem.forms.energy import bending_and_twist, shear_and_stretch

RADIUS, LENGTH, HALF = 0.7e-3, 0.4, 0.2
E, G, AREA, INERTIA = 54e9, 54e9 / 2.6, pi * RADIUS**2, pi * RADIUS**4 / 4
STRAINS, BENDING = np.array([G, G, E]) * AREA, np.array([E, E, 2 * G]) * INERTIA
FIRST, BOTH, E3 = (0.0, 0.01), (0.01 * cos(pi / 6), -0.01 * sin(pi / 6)), np.array([0.0, 0.0, 1.0])

STEPS = 10


@dataclass(frozen=True)
class Cable:
    """Tendon at ``d(s)`` (3,) of slope ``slope(s)`` (3,) as far as ``end``."""

    d: Callable[[float], np.ndarray]
    slope: Callable[[float], np.ndarray] = lambda s: np.zeros(3)
    end: float = LENGTH


def strains(n: np.ndarray, m: np.ndarray, cables: list[tuple[float, np.ndarray, np.ndarray]]) -> np.ndarray:
    """Strains ``v`` and ``k`` (6,) of contact force and moment along the directors, by Newton's method."""
    x = np.concatenate([E3 + n / STRAINS, m / BENDING])
    for _ in range(50):
        f = np.concatenate([STRAINS * (x[:3] - E3) - n, BENDING * x[3:] - m])
        J = np.diag(np.concatenate([STRAINS, BENDING]))
        for T, d, slope in cables:
            across = np.array([[0, -d[2], d[1]], [d[2], 0, -d[0]], [-d[1], d[0], 0]])  # d x
            u, A = x[:3] - across @ x[3:] + slope, np.hstack([np.eye(3), -across])
            size = float(np.linalg.norm(u))
            f += T * A.T @ u / size
            J += T * A.T @ (np.eye(3) - np.outer(u, u) / size**2) @ A / size
        step = np.linalg.solve(J, f)
        x -= step
        if abs(step).max() < 1e-13:
            break
    return x


def shot(cables: list[Cable], tensions: list[float], force: Any, guess: Any, lengths: dict[int, float]) -> np.ndarray:
    """Tip (3,), tensions and lengths of cables: tensions of those of given ``lengths``, by number, are sought."""
    force = np.array(force)

    def slopes(s: float, y: np.ndarray, T: np.ndarray, end: float) -> np.ndarray:
        R = Rotation.from_quat(y[3:7]).as_matrix()
        d = {i: (cable.d(s), cable.slope(s)) for i, cable in enumerate(cables) if end <= cable.end}
        x = strains(R.T @ force, R.T @ y[7:10], [(T[i], *d[i]) for i in d])
        a, b, c = x[3:]
        turned = np.array([[0, c, -b, a], [-c, 0, a, b], [b, -a, 0, c], [-a, -b, -c, 0]]) @ y[3:7] / 2
        run = [np.linalg.norm(x[:3] + np.cross(x[3:], d[i][0]) + d[i][1]) if i in d else 0.0 for i in range(len(T))]
        return np.concatenate([R @ x[:3], turned, np.cross(force, R @ x[:3]), run])

    def tip(unknown: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        T = np.array(tensions)
        T[list(lengths)] = unknown[3:]
        y = np.concatenate([np.zeros(6), [1.0], unknown[:3], 0 * T])
        for a, b in ((0.0, HALF), (HALF, LENGTH)):
            y = solve_ivp(slopes, (a, b), y, method="DOP853", args=(T, b), rtol=1e-11, atol=1e-13).y[:, -1]
        return y, T

    def miss(unknown: np.ndarray) -> np.ndarray:
        y, _ = tip(unknown)
        return np.concatenate([y[7:10], [y[10 + i] - length for i, length in lengths.items()]])

    found = root(miss, guess, tol=1e-13).x
    assert abs(miss(found)).max() < 1e-10
    y, T = tip(found)
    return np.concatenate([y[:3], T, y[10:]])


def robot(force: Any, *tendons: Any) -> Scene:
    """The robot of the page, whose tensions and force grow in proportion to ``part``."""
    return Scene("robot", (0.0, LENGTH), "flexible",
                 lambda v, k, c: shear_and_stretch(v, STRAINS.tolist()) + bending_and_twist(k, BENDING.tolist()),
                 {"part": 0.0}, "part", (clamped(), free(lambda c: [c.part * x for x in force])),
                 Ordinate("height", s=LENGTH, of=lambda r, q: r[2]), (0.0, 1.0), constraints=tendons)  # fmt: skip


CABLES = [Cable(lambda s: np.array([*FIRST, 0.0]), end=HALF), Cable(lambda s: np.array([*BOTH, 0.0]))]
PULLED = tendon(lambda c: 4 * c.part, at=FIRST, interval=(0.0, HALF))


@pytest.mark.parametrize("force", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_two_tendons_and_a_force_on_the_tip(force: tuple[float, ...]) -> None:
    diagram = rodfem.trace(robot(force, PULLED, tendon(lambda c: 2 * c.part, at=BOTH)), depth=0, error_bars=False)
    point = diagram[0].points[-1]
    expected = shot(CABLES, [4.0, 2.0], force, point.moment_in_space[0], {})
    np.testing.assert_allclose(point.r[-1], expected[:3], rtol=1e-8)
    if not any(force):
        known = (0.1276076029, 0.1434674228, 0.3364067994, 4.0, 2.0)
        np.testing.assert_allclose(expected[:5], known, rtol=2e-9)
        assert abs(LENGTH - expected[6] - 0.0039473627) < 1e-9  # as the page has it


def test_a_tendon_of_given_length() -> None:
    """Shortened by 20 mm, next to one that is pulled; its tension is a multiplier."""
    short = tendon(at=BOTH, length=lambda c: LENGTH - 0.02 * c.part)
    solver = rodfem.Solver(robot((0.0, 0.0, 0.0), PULLED, short))
    point = None
    for part in (0.0, 0.5, 1.0):
        point = solver.equilibrium(part, guess=point)
    assert point is not None and point.stable
    tension = solver.equilibria.system.scalar(point.x, "g2")
    guess = [*point.moment_in_space[0], tension]
    expected = shot(CABLES, [4.0, 0.0], (0.0, 0.0, 0.0), guess, {1: LENGTH - 0.02})
    np.testing.assert_allclose([*point.r[-1], 4.0, tension], expected[:5], rtol=1e-8)


def test_a_tendon_that_winds_around_the_rod() -> None:
    """Its coordinates are functions of the arclength."""
    turn = 2.0 / LENGTH
    wound = tendon(3.0, at=lambda c: (0.01 * ufl.cos(turn * c.s), 0.01 * ufl.sin(turn * c.s)))
    diagram = rodfem.trace(robot((0.2, 0.0, -0.1), wound), Discretization(elements=16), depth=0, error_bars=False)
    point = diagram[0].points[-1]
    cable = Cable(
        lambda s: 0.01 * np.array([cos(turn * s), sin(turn * s), 0.0]),
        lambda s: 0.01 * turn * np.array([-sin(turn * s), cos(turn * s), 0.0]),
    )
    expected = shot([cable], [3.0], (0.2, 0.0, -0.1), point.moment_in_space[0], {})
    np.testing.assert_allclose(point.r[-1], expected[:3], rtol=1e-8)


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda: tendon(at=FIRST), "tension None and the length None: give one of the two"),
        (lambda: tendon(4.0, at=0.01), "at is 0.01: give 2 numbers"),
        (lambda: tendon(4.0, at=FIRST, interval=(0.2, 0.0)), "from s = 0.2 to 0: give the lesser"),
        (lambda: robot(E3, tendon(4.0, at=FIRST, interval=(0.0, 0.5))), "end of a tendon at s = 0.5 is not on"),
        (lambda: robot(E3, tendon(lambda c: c.pull, at=FIRST)), "tension of a tendon asks for a constant 'pull'"),
    ],
)
def test_mistakes(mistake: Callable[[], object], words: str) -> None:
    with pytest.raises((InputError, SceneError), match=words):
        mistake()

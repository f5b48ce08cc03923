"""Rods that are symmetric but for what is round-off beside a stiff strain: no eigenvalue is a symmetry's zero."""

from __future__ import annotations

from math import pi

import pytest

from rodfem import Discretization, Ordinate, Plan, Scene, free, pinned, trace

CURVATURE, LEAST = 4e-9, 3e-5
"""Own curvature of the rod; eigenvalues below the other are not compared: those below 1e-5 count as zero."""


@pytest.mark.long
@pytest.mark.alone
def test_an_eigenvalue_near_zero_is_no_rotation() -> None:
    """A round rod on pins, with a curvature that a stiff twist hides: its lowest eigenvalues are 1 - P/pi^2.

    Its turning about itself is the one that is zero.
    """
    rod = Scene(
        "nearly straight", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (k[0] ** 2 + (k[1] - CURVATURE) ** 2 + 1e4 * k[2] ** 2) / 2, {"P": 0.0}, "P",
        (pinned(), pinned(lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P))),
        Ordinate("x", s=0.5, of=lambda r, q: r[0]), (9.8, 9.87),
    )  # fmt: skip
    (branch,) = trace(rod, Discretization(elements=6, degree=4), Plan(depth=0))
    rows = [point for point in branch.points if 1 - point.load / pi**2 > LEAST]
    assert max(point.load for point in rows) > pi**2 * (1 - 10 * LEAST)
    assert {(point.negative, point.zero) for point in rows} == {(0, 1)}


@pytest.mark.long
def test_a_pendulum_beside_a_stiff_twist_falls() -> None:
    """A rod on a ball joint, pulled and then pushed at its tip by a small force w: both rotations have mu = w.

    Beside a twist 3e7 times as stiff as bending they were zeros of two symmetries, and the rod was stable at w < 0.
    """
    rod = Scene(
        "pendulum", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (k[0] ** 2 + k[1] ** 2 + 3e7 * k[2] ** 2) / 2, {"w": 0.0}, "w",
        (pinned(), free(lambda c: (0.0, 0.0, c.w))), Ordinate("x", s=1.0, of=lambda r, q: r[0]), (1e-4, -1e-4),
    )  # fmt: skip
    (branch,) = trace(rod, Discretization(elements=4, degree=4), Plan(depth=0, error_bars=False))
    fallen = [point for point in branch.points if point.load < -1e-5]
    assert len(fallen) > 3
    assert {point.negative + point.undecided for point in fallen} == {2}

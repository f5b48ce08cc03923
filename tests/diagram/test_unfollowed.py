"""A fine mesh with unstable motions beyond those that a sweep follows: all are looked at now and then."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from rodfem import Attachment, Discretization, Inertia, Ordinate, Plan, Ring, Scene, trace


def place(s: float) -> tuple[float, float, float]:
    return 1 - cos(s), 0.0, sin(s)


@pytest.mark.long
@pytest.mark.alone
def test_they_are_said_whatever_the_range() -> None:
    """A ring on three springs: dozens of slow motions, and one that grows from p = 0.2 on.

    Of 500 rows with mass the last load alone was looked at, where the motions followed flutter already.
    """
    springs = tuple(
        Attachment(at, energy=lambda x, c, at=at: sum((x.r[i] - place(at)[i]) ** 2 for i in range(3)))
        for at in (1.0, 3.0, 5.0)
    )
    ring = Scene(
        "ring", (0.0, 2 * pi), "unshearable and inextensible",
        lambda v, k, c: (1.2 * k[0] ** 2 + k[1] ** 2 - 2 * k[1] + 1.5 * k[2] ** 2) / 2, {"p": 0.0}, "p", Ring(),
        Ordinate("b", s=pi, of=lambda r, q: r[0]), (0.0, 1.5),
        start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
        follower=lambda c: (c.p, 0.0, 0.1 * c.p), attachments=springs,
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.05, 0.04, 0.06)),
    )  # fmt: skip
    found = trace(ring, Discretization("pointwise", 12, 6), Plan(depth=0, error_bars=False))
    assert found.special("flutter")[0].point.load == pytest.approx(1.191245, abs=1e-5)  # of those that are followed
    (words,) = found.warnings
    assert words.startswith("At p = 0.375 an eigenvalue of this mesh")
    assert found.assess(found.at(0.375)[0]).negative > 0

"""Branches that end on a state known before: their own start, or that of another branch."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

from rodfem import Discretization, Ordinate, Plan, Ring, Scene, StepControl, trace
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.alone

EXCESS = 0.04


@pytest.mark.long
def test_two_states_of_a_twisted_ring_are_joined_at_any_step() -> None:
    """Michell: rings twisted by none and by two turns lose stability where ``C |twist - t0| = sqrt 3``, both found.

    At the second one the branch meets states with one more free motion, along which Newton's method slides away.
    """
    ring = Scene(
        "ring",
        (0.0, 2 * pi),
        "unshearable and inextensible",
        lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.t0), (1.0, 1.0, 1.5)),
        {"t0": 0.0},
        "t0",
        Ring(),
        Ordinate("twist", s=None, of=lambda x, c: x.k[2] / (2 * pi)),
        (0.0, 1.5),
        start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
    )
    plan = Plan(depth=1, error_bars=False, steps=StepControl(largest=0.025))
    diagram = trace(ring, Discretization(elements=8, degree=6), plan)
    first, last = diagram["ring"].special[0], diagram["branch 1"].special[-1]
    assert first.point.load == pytest.approx(2 / sqrt(3), abs=1e-8)
    assert last.point.load == pytest.approx(2 - 2 / sqrt(3), abs=1e-8)
    assert last.point.ordinate == pytest.approx(2.0, abs=1e-9)
    assert diagram["branch 1"].ended.startswith("meets another branch")
    assert not diagram.warnings

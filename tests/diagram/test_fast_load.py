"""A load that varies fast with the parameter is followed along a branch that does not move, or it is said."""

from __future__ import annotations

from dataclasses import replace
from math import asin, log, pi, sqrt, tan
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from scipy.optimize import brentq

import rodfem
from rodfem import Discretization, Inertia, Ordinate, Plan, Scene, clamped, free
from rodfem.continuation.kinds import FLUTTER
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.fast_load import FastLoad


def column(thrust: rodfem.problem.local_state.OfConstants, span: tuple[float, float] = (0.0, 1.0)) -> Scene:
    """Straight inextensible column under a force at its free end."""
    return Scene(
        name="fast",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 2.0, 1.0)),
        parameters={"P": 0.0},
        load="P",
        ends=(clamped(), free(force=thrust)),
        ordinate=Ordinate("x", s=1.0, of=lambda r, q: r[0]),
        span=span,
    )


@pytest.mark.long
@pytest.mark.alone
@pytest.mark.parametrize("rate", [70.0, 200.0])
def test_a_thrust_that_is_a_fast_sine(rate: float) -> None:
    """It passes the critical one, ``pi^2/4``, twice in each of many periods."""
    once = asin(pi**2 / 12)
    exact = [(x + 2 * pi * j) / rate for j in range(40) for x in (once, pi - once)]
    found = rodfem.trace(column(lambda c: (0.0, 0.0, -3 * ufl.sin(rate * c.P))), None, Plan(depth=0))
    loads = [s.point.load for s in found.special("branch point")]
    np.testing.assert_allclose(loads, [x for x in exact if x < 1], rtol=0, atol=1e-7)
    assert not found.warnings


def test_what_is_faster_than_any_step_is_said() -> None:
    fast = FastLoad(column(lambda c: (0.0, 0.0, -3 * ufl.sin(1e5 * c.P))), (0.0, 1.0))
    assert fast.doubt.startswith("The force on the right end changes too fast with P about P = ")


def test_ordinary_functions_bound_no_step() -> None:
    for power in (1, 2, 3):
        fast = FastLoad(column(lambda c, n=power: (1e-13, 2e-4, -(c.P**n))), (0.0, 4.0))
        assert not fast.doubt
        assert not len(fast.low)


def test_each_range_has_a_row_inside() -> None:
    """What comes and goes in a range is told by three rows: one in its inside, wherever the rows before it are."""
    fast = FastLoad(column(lambda c: (0.0, 0.0, -3 * ufl.sin(20 * c.P))), (0.0, 1.0))
    assert len(fast.low) > 4
    for slope in (1.0, -0.3):
        rows = [0.0 if slope > 0 else 1.0]
        while 0.0 <= rows[-1] <= 1.0:
            rows.append(rows[-1] + slope * fast.room(rows[-1], slope))
        for low, high in zip(fast.low, fast.high, strict=True):
            assert sum(low < row < high for row in rows) >= 1


def test_a_notch_that_the_energy_hides() -> None:
    """Bending softens at one load; of the energy itself that is a part of 1e-7, of its second derivative a half."""
    thrust = lambda c: (0.0, 0.0, -2.0)  # noqa: E731
    notch = lambda c: 1.0 - 0.5 * ufl.exp(-(((c.P - 0.3712) / 1e-3) ** 2))  # noqa: E731
    hidden = lambda v, k, c: bending_and_twist(k, (notch(c), 9.0, 1.0)) + 1e7 * ufl.sin(c.P)  # noqa: E731
    fast = FastLoad(replace(column(thrust), energy=hidden), (0.0, 1.0))
    about = (fast.low < 0.3722) & (fast.high > 0.3702)
    assert (fast.high - fast.low)[about].max() < 1e-3


@pytest.mark.long
@pytest.mark.alone
def test_a_notch_of_one_piece() -> None:
    """At ``P = 0.5123`` four fifths of the column soften, ahead of its free end: 80 % of Euler's load is too much.

    Its critical stiffness ``B`` solves ``tan(a k) tan((1 - a) l) = l/k``, ``k^2 = T``, ``l^2 = T/B``, ``a = 0.2``.
    """
    thrust, width = 0.2 * pi**2, 1e-3

    def stiffness(c: Any) -> Any:
        return ufl.conditional(ufl.lt(c.s, 0.2), 1.0, 1 - 0.9 * ufl.exp(-(((c.P - 0.5123) / width) ** 2)))

    rod = column(lambda c: (0.0, 0.0, -thrust))
    rod = replace(rod, energy=lambda v, k, c: bending_and_twist(k, (stiffness(c), 9.0, 1.0)), breaks=(0.2,))
    k = sqrt(thrust)
    B = brentq(lambda B: tan(0.2 * k) * tan(0.8 * k / sqrt(B)) - 1 / sqrt(B), 0.6, 1.0, xtol=1e-14)
    off = width * sqrt(-log((1 - B) / 0.9))
    loads = [s.point.load for s in rodfem.trace(rod, None, Plan(depth=0)).special("branch point")]
    np.testing.assert_allclose(loads, [0.5123 - off, 0.5123 + off], rtol=0, atol=1e-9)


@pytest.mark.long
@pytest.mark.alone
def test_a_sweep_of_a_fast_sine(monkeypatch: pytest.MonkeyPatch) -> None:
    """A follower thrust 25 sin(200 P): it flutters where that passes Beck's load, twice in each of six periods.

    A row every 0.01, as of a hundred from 0 to 1, is three in a period.
    """
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 21)
    ends = clamped(), free(follower=lambda c: (0.0, 0.0, -25 * ufl.sin(200 * c.P)))
    mass = Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0))
    rod = classics.column("sweep", ends, (0.0, 0.2), inertia=mass)
    (branch,) = rodfem.trace(rod, Discretization("auto", 6, 4), Plan(error_bars=False))
    found = [s.point.load for s in branch.special if s.kind == FLUTTER]
    beck = asin(20.0509536 / 25)
    true = [(2 * pi * i + x) / 200 for i in range(32) for x in (beck, pi - beck)]
    assert found == pytest.approx([x for x in true if x < 0.2], abs=1e-8)

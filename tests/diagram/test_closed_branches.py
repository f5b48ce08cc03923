"""A closed branch ends where it begins: the isola of a cantilever, whose folds are known in closed form."""

from __future__ import annotations

from math import sqrt

import pytest
from hard.isolas import scene

from rodfem import Discretization, Plan, trace

EXCESS = 0.04


@pytest.mark.alone
@pytest.mark.parametrize("at", [0.0, 0.07])
def test_a_closed_branch_ends_at_its_start(at: float) -> None:
    """At a load between the folds there are two states of the isola: each is reported once."""
    plan = Plan(at=(at,), tries=6, error_bars=False)
    _, isola = trace(scene(EXCESS), Discretization("auto", 6, 6), plan)
    first, last = isola.points[0], isola.points[-1]
    assert isola.ended == "closed loop"
    assert last.load == first.load
    assert (last.ordinate, last.energy) == pytest.approx((first.ordinate, first.energy), abs=1e-12)
    assert (last.slope, last.negative) == (pytest.approx(first.slope, abs=1e-9), first.negative)
    folds = sorted(s.point.load for s in isola.special if s.kind == "fold")
    assert folds == pytest.approx([-sqrt(EXCESS), sqrt(EXCESS)], abs=1e-6)
    asked = [s.point for s in isola.special if s.kind == "user"]
    assert [p.load for p in asked] == [at, at]
    assert sorted(p.negative for p in asked) == [0, 1]
    inside = [p.ordinate for p in isola.points if p.load == first.load]
    assert len({round(x, 9) for x in inside}) == 2

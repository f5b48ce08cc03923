"""Pairs of critical loads of a sweep that come out of a thrust's greatest value, about as large as the critical one.

The thrust on a column is a parabola in a parameter, and its greatest value at a row of the sweep or between two.  What
is critical of the column is known: flutter of Beck's, divergence of one whose thrust follows the tip in part.
"""

from __future__ import annotations

from math import sqrt
from typing import Any

import classics
import pytest
from hard.thrusts import AT_ROW, peaked
from test_close_critical_loads import DIVERGES, FLUTTERS, SHARE

from rodfem import Plan, clamped, free
from rodfem.diagram.diagram import trace
from rodfem.fem.fields import Discretization
from rodfem.forms.energy import bending_and_twist

FINE, COARSE = Discretization("pointwise", 4, 6), Discretization("pointwise", 2, 4)


@pytest.mark.long
@pytest.mark.alone
def test_two_loads_beside_a_third_one() -> None:
    """In one step of the sweep flutter comes and goes in one plane, and in the other one the column diverges."""

    def push(part: float) -> Any:
        return lambda c: (0.0, 0.0, -part * (FLUTTERS + 1e-5 - (c.p - 5.007) ** 2))

    scene = classics.column(
        "two planes",
        (clamped(), free(force=push(1 - SHARE), follower=push(SHARE))),
        (4.0, 6.0),
        load="p",
        inertia=classics.BEAM,
        constants={"p": 4.0},
        energy=lambda v, k, c: bending_and_twist(k, (1.0, FLUTTERS / DIVERGES * (1 + 0.1 * (c.p - 5.015)), 1.0)),
    )
    diagram = trace(scene, FINE, Plan(depth=0))
    inside = sorted((s.point.load, s.kind.words) for s in diagram.special() if 5.0 < s.point.load < 5.02)
    assert [kind for _, kind in inside] == ["flutter", "flutter", "divergence"]
    exact = [5.007 - sqrt(1e-5), 5.007 + sqrt(1e-5)]
    assert [load for load, _ in inside[:2]] == pytest.approx(exact, abs=1e-8)
    assert not diagram.warnings


@pytest.mark.long
@pytest.mark.alone
def test_prediction_without_an_error() -> None:
    """One that is as good as none could be: its square was below zero, and the sweep ended with an exception."""
    diagram = peaked("late flutter", -1e-1, AT_ROW, COARSE)
    assert len(diagram.special("divergence")) == 4
    assert not diagram.special("flutter")

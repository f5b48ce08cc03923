"""Frequencies that meet at a load of the sweep itself, to round-off: found once, with the numbers on both sides."""

from dataclasses import replace
from math import nextafter

import classics
import pytest

from rodfem import Diagram, Discretization, Plan, trace
from rodfem.continuation.kinds import DIVERGENCE, FLUTTER, USER

MESH = Discretization("auto", 4, 6)
BECK = 20.0509536189738
Found = list[tuple[str, float, int, int]]


def swept(share: float, strong: float, span: tuple[float, float], *at: float) -> Diagram:
    plan = Plan(depth=0, at=at, error_bars=False)
    return trace(replace(classics.partly_following(share, span, strong), span=span), MESH, plan)


def critical(diagram: Diagram) -> Found:
    kinds = (FLUTTER, DIVERGENCE)
    found = [
        (str(s.kind), s.point.load, s.negative_before, s.negative_after) for s in diagram[0].special if s.kind in kinds
    ]
    return sorted(found, key=lambda one: one[1])


@pytest.mark.long
@pytest.mark.parametrize(("span", "at"), [((0.3, 25.0), 0.1 * 3), ((0.0, 20.1), nextafter(20.1, 0.0))])
def test_loads_that_differ_by_round_off_are_one(span: tuple[float, float], at: float) -> None:
    """A step of one unit in the last place ended the sweep."""
    diagram = swept(1.0, 10.0, span, at)
    (flutter,) = critical(diagram)
    assert flutter[1] == pytest.approx(BECK, abs=1e-9)
    (asked,) = diagram.special(USER)
    assert asked.point.load in span and diagram[0].ended == "end of range"

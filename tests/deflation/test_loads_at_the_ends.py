"""States at a load that is asked for and ends the range, or begins it: all are known, and none is found twice."""

from __future__ import annotations

from typing import Any

import pytest
from classics import column, push

from rodfem import Discretization, End, Plan, clamped, free, trace
from rodfem.problem.scene import Scene

MESH = Discretization("reduced", 5, 6)


def cantilever(sideways: float = 0.0) -> Scene:
    """Its thrust buckles it at ``(2 n + 1)^2 pi^2 / 4``: 2.47, 22.2; with a force across it nowhere."""
    tip: End = free(lambda c: (sideways * c.P, 0.0, -c.P))
    return column("cantilever", (clamped(), tip if sideways else free(push)), (0.0, 12.0), planar="e2")


@pytest.mark.parametrize("span", [(0.0, 12.0), (12.0, 0.0)])
@pytest.mark.parametrize("at", [(), (12.0,), (0.0, 12.0), (0.0,)])
def test_states_at_the_ends(span: tuple[float, float], at: tuple[float, ...]) -> None:
    """The straight one and, of the two bent ones that are mirror images, one: at 12; at 0 the straight one alone."""
    diagram = trace(cantilever(), MESH, Plan(span, at=at, error_bars=False))
    assert sorted(round(p.ordinate, 6) > 0 for p in diagram.at(12.0)) == [False, True]
    assert [round(p.ordinate, 6) for p in diagram.at(0.0)] == [0.0]


@pytest.mark.parametrize("span", [(0.0, 1.0), (1.0, 0.0)])
def test_a_search_at_the_end_finds_no_known_state(span: tuple[float, float]) -> None:
    """Under a load below the critical one there is a single equilibrium that is not wound up."""
    plan: dict[str, Any] = {"at": (1.0,), "tries": 6, "depth": 0, "error_bars": False}
    diagram = trace(cantilever(0.1), MESH, Plan(span, **plan))
    assert len(diagram) == 1 and "coexist" not in diagram.in_words()
    assert diagram.search(1.0) == []


def test_a_branch_found_where_the_range_begins_is_followed_to_its_end() -> None:
    """It leaves the range at once on one side: that is no step, and no fault."""
    diagram = trace(cantilever(0.1), MESH, Plan((12.0, 0.0), at=(12.0,), tries=8, depth=0, error_bars=False))
    assert len(diagram) > 1
    assert {branch.ended for branch in diagram} == {"end of range"}

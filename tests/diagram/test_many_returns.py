"""A branch that goes back to shorter steps however often, on a stack that does not grow by that."""

from __future__ import annotations

import inspect
import sys
from typing import Any

import pytest
from classics import column, push

from rodfem import Discretization, Plan, clamped, free, trace
from rodfem.diagram.shorter_steps import Unresolved
from rodfem.diagram.special_search import SpecialSearch

OFTEN, DEEP = 400, 300


@pytest.mark.long
@pytest.mark.alone
def test_no_stack_overflows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four hundred times, where three hundred calls are left: the rows are those that are found without."""
    scene = column("column", (clamped(), free(push)), (0.0, 4.0), planar="e2")
    mesh, plan = Discretization("auto", 2, 4), Plan(depth=0, error_bars=False)
    (expected,) = trace(scene, mesh, plan)
    after, left = SpecialSearch.after, [OFTEN]

    def doubting(search: SpecialSearch, *step: Any) -> Any:
        if left[0]:
            left[0] -= 1
            raise Unresolved
        return after(search, *step)

    monkeypatch.setattr(SpecialSearch, "after", doubting)
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(len(inspect.stack()) + DEEP)
    try:
        (found,) = trace(scene, mesh, plan)
    finally:
        sys.setrecursionlimit(limit)
    assert not left[0] and found.ended == expected.ended == "end of range"
    assert [p.load for p in found.points] == pytest.approx([p.load for p in expected.points], abs=1e-9)

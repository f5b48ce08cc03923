"""A branch that goes back to shorter steps however often, on a stack that does not grow by that."""

from __future__ import annotations

import inspect
import sys
from math import inf
from types import SimpleNamespace
from typing import Any

import pytest
from classics import column, push

from rodfem import Discretization, Plan, clamped, free, trace
from rodfem.continuation.observer import Observer
from rodfem.diagram.special_search import PARTS, SHORTER, SpecialSearch, Unresolved

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


def test_steps_are_short_about_pieces_that_are_to_be_resolved_and_not_for_ever() -> None:
    """A branch that goes back far before a piece does not creep towards it, nor to and fro between two."""

    def row(arclength: float) -> Any:
        return SimpleNamespace(arclength=arclength, mesh=0)

    meshes, gaps = SimpleNamespace(solvers=[None]), SimpleNamespace(reach=lambda solver, point: inf)
    search, asked = SpecialSearch(meshes, gaps, Observer()), 0  # type: ignore[arg-type]
    for first in (3.0, 5.0) * 10:
        try:
            search._shorten(row(first), row(first + 0.2))
        except Unresolved:
            asked += 1
    assert asked == 2 * SHORTER
    assert search.reach(row(0.5)) == pytest.approx(2.5) and search.reach(row(6.0)) == inf
    assert search.reach(row(3.1)) == search.reach(row(5.1)) == pytest.approx(0.2 / PARTS)
    assert search.reach(row(3.5)) == pytest.approx(1.5)

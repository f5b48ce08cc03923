"""A load asked for that is an end of the range: its states are known once, and branches found there end there."""

from itertools import pairwise
from math import hypot

import classics
import pytest

from rodfem import Diagram, Discretization, Ordinate, Plan, Scene, clamped, free, trace

LEAN = 0.05
HIGH = 6.0
TIPS = [-0.6568800122681323, -0.03794700789747826, 0.6697463255175139]
"""Where the tip of the cantilever is in all its equilibria at that load, by shooting from the clamp."""


def column() -> Scene:
    """Pinned ends: of its Euler loads ``pi^2`` and ``2 pi^2``, in its two planes, are below 20."""
    aside = Ordinate("q", s=0.3, of=lambda r, q: hypot(r[0], r[1]))
    return classics.column("column", classics.SUPPORTS["pinned-pinned"], (0.0, 20.0), ordinate=aside)


def cantilever(high: float = HIGH) -> Scene:
    """In its plane ``2 a'' = -(P sin a + LEAN cos a)``, ``a(0) = a'(1) = 0``, with the slope ``a`` of the rod."""
    ends, tip = (clamped(), free(lambda c: (LEAN, 0.0, -c.P))), Ordinate("tip", s=1.0, of=lambda r, q: r[0])
    return classics.column("cantilever", ends, (0.0, high), ordinate=tip, planar="e2")


def rows_are_apart(diagram: Diagram) -> bool:
    """Whether no two rows of a branch are at one place."""
    return all(b.arclength - a.arclength > 1e-6 for branch in diagram for a, b in pairwise(branch.points))


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("span", "at", "accuracy"),
    [((0.0, 20.0), (20.0,), None), ((20.0, 0.0), (20.0, 20.0, 0.0), None), ((0.0, 20.0), (0.0, 20.0), 1e-6)],
)
def test_states_at_the_ends_of_the_range(span: tuple[float, float], at: tuple[float, ...], accuracy: float) -> None:
    """Straight with index 2, bent in the one plane and stable, bent in the other one with index 1; a row each."""
    found = trace(column(), plan=Plan(span, at=at, depth=1, accuracy=accuracy, error_bars=False))
    assert sorted(p.index for p in found.at(20.0)) == [0, 1, 2]
    assert [p.index for p in found.at(0.0)] == [0]
    assert [p.load for p in found.at(20.0)] == [20.0] * 3
    asked = [s.point.load for branch in found for s in branch.special if s.kind == "user"]
    assert sorted(asked) == sorted([20.0] * 3 + [0.0] * (0.0 in at))
    assert rows_are_apart(found)
    # new are others, as the one that hangs, in tension, and one whose ends meet
    known, new = ({(p.index, round(p.energy, 6)) for p in points} for points in (found.at(20.0), found.search(20.0, 6)))
    assert not known & new


def test_states_at_a_branch_point() -> None:
    """What leaves it begins with its state: there is one."""
    found = trace(column(), plan=Plan((5.0, 15.0), depth=1, error_bars=False))
    (special,) = found.special("branch point")
    assert len(found) == 2
    assert len(found.at(special.point.load)) == 1


@pytest.mark.few(1)
@pytest.mark.parametrize("span", [(0.0, HIGH), (HIGH, 0.0)])
def test_branches_that_are_found_at_an_end_of_the_range(span: tuple[float, float]) -> None:
    """All states that shooting finds, each once, on branches that end with the range."""
    found = trace(cantilever(), plan=Plan(span, at=(HIGH,), tries=8, error_bars=False))
    assert len(found) == 2
    assert [branch.ended for branch in found] == ["end of range"] * 2
    assert found.warnings == []
    assert sorted(p.ordinate for p in found.at(HIGH)) == pytest.approx(TIPS, abs=1e-6)
    assert [p.load for branch in found for p in (branch.points[0], branch.points[-1])].count(HIGH) == 3
    assert rows_are_apart(found)


@pytest.mark.long
def test_a_load_at_the_start_where_the_first_step_asks_for_another_mesh() -> None:
    """The first row is that of the request on whatever mesh."""
    coarse = Discretization(elements=2, degree=2, vertices=(0.0, 0.5, 1.0))
    found = trace(cantilever(60.0), coarse, Plan(at=(0.0,), depth=0, accuracy=1e-10))
    assert len(found.solvers) > 1
    assert [(s.point.load, s.row) for s in found[0].special if s.kind == "user"] == [(0.0, 0)]
    assert rows_are_apart(found)

"""The name of the first branch is true: whether a rod is straight is known from its mechanics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import classics
import demo_cases
import pytest

from rodfem import Discretization, Plan, Scene, trace
from rodfem.continuation.branch import Branch
from rodfem.diagram.explorer import Explorer

pytestmark = pytest.mark.alone

MESH = Discretization("auto", 6, 4)


def heavy(share: float) -> Scene:
    """A cantilever whose weight grows from nothing: along its axis, and a ``share`` of it across."""
    return replace(classics.heavy(), distributed=lambda c: (-share * c.P, 0.0, -c.P), span=(0.0, 2.0))


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "name"),
    [
        (lambda: heavy(0.0), "straight"),
        (lambda: heavy(1e-3), "first branch"),  # straight only as long as it has no weight
        (lambda: demo_cases.scene("cord"), "straight"),  # of curvatures that vanish, and strains that do not
        (lambda: demo_cases.scene("ruler"), "plane"),  # as the scene says
        (lambda: replace(demo_cases.scene("ruler"), states=None), "first branch"),
        (lambda: replace(demo_cases.scene("ring"), states=None), "ring"),
        (lambda: classics.arch(0.5, dead=False), "first branch"),
        (lambda: classics.spring(3.0, 2.0), "first branch"),
        (lambda: classics.timoshenko(50.0), "straight"),
        (classics.beck, "straight"),
        (lambda: replace(classics.beck(), distributed=lambda c: (1e-3, 0.0, 0.0)), "first branch"),
    ],
)
def test_only_what_is_straight_is_called_so(scene: Callable[[], Scene], name: str) -> None:
    rod = scene()
    start, stop = rod.span
    plan = Plan((start, start + 0.02 * (stop - start)), depth=0, error_bars=False)
    diagram = trace(rod, MESH, plan)
    assert diagram.branches[0].name == name
    sentence = diagram.in_words()
    assert sentence.startswith("The first branch is " if name == "first branch" else f"The first branch, {name}, is ")


@pytest.mark.long
def test_no_two_branches_have_one_name() -> None:
    """What leaves a branch that a search found was called ``branch 1``, as what leaves the first: files have one."""
    explorer = Explorer.__new__(Explorer)
    explorer.branches = [Branch("branch 1", ("straight", 0), 1), Branch("found 1 at 0.5", None, 0)]
    assert explorer._unused("branch ") == "branch 2"
    assert explorer._unused("found ", " at 0.5") == "found 2 at 0.5"  # of another load with these digits, say

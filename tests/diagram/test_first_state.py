"""First states: their name, which is true, one on all meshes, and a column in units far from one."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import pi
from typing import Any

import classics
import demo_cases
import numpy as np
import pytest
from classics import circle
from fem.test_reactions import cable
from hard.published import radial

from rodfem import Branch, Discretization, InputError, Ordinate, Plan, Ring, Scene, Solver, pinned, trace
from rodfem.diagram.explorer import Explorer
from rodfem.forms.energy import bending_and_twist

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
        (lambda: replace(demo_cases.scene("ruler"), states=None), "first branch"),
        (lambda: classics.spring(3.0, 2.0), "first branch"),
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


@pytest.mark.long
def test_of_two_equilibria_the_one_beside_the_start() -> None:
    """A tapered ring under dead loads inwards is 0.17 from the circle, and unstable: turned by pi it is stretched.

    Newton's method without forces led there, on the meshes of 7 and 10 elements.
    """

    def stiff(v: Any, k: Any, c: Any) -> Any:
        return (1 - 0.15 * c.s) * (1.335 * (k[0] ** 2 + k[1] ** 2) + 1.1 * k[2] ** 2 + 20 * (v[2] - 1) ** 2)

    ring = classics.column(
        "tapered ring", Ring(), (0.2, 5.0), interval=(0.0, 2 * pi), rod="unshearable", energy=stiff, planar="e2",
        ordinate=Ordinate("bending", None, of=lambda x, c: x.k[0] ** 2 + x.k[1] ** 2), start=circle, distributed=radial,
    )  # fmt: skip
    found = [Solver(ring, Discretization("auto", elements, 5)).equilibrium(0.2) for elements in (7, 8, 10, 14)]
    assert [point.negative for point in found] == [1] * 4
    assert [point.ordinate for point in found] == pytest.approx([found[-1].ordinate] * 4, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(("stiffness", "push"), [(1e-20, 1e-15), (1e20, 1e15)])
def test_a_column_buckles_in_any_units(stiffness: float, push: float) -> None:
    """At ``pi^2``, with ``P = pi^2 (1 + (pi x)^2 / 8)`` for the amplitude ``x`` in the middle, in lengths.

    Reactions that vanish are round-off of forces of the size of the stiffness.
    """
    one = stiffness / push
    scene = classics.column(
        "column", (pinned(), pinned(classics.ON_AXIS, lambda c: (0.0, 0.0, -c.P * push))), (8 * one, 11 * one),
        energy=lambda v, k, c: bending_and_twist(k, (9 * stiffness, stiffness, stiffness)), planar="e2",
        ordinate=Ordinate("middle", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip
    found = trace(scene, plan=Plan(depth=1))
    (special,) = found.special("branch point")
    assert abs(special.point.load - pi**2 * one) <= special.error_estimate < 1e-8 * one
    assert special.law.coefficient == pytest.approx(pi**4 / 8 * one, rel=1e-6)
    assert [branch.ended for branch in found] == ["end of range"] * 2
    assert found.warnings == []


@pytest.mark.parametrize("run", [lambda rod: Solver(rod).equilibrium(280.0), trace, partial(trace, accuracy=1e-6)])
def test_a_first_state_of_more_half_waves_than_a_mesh_holds(run: Callable[[Scene], Any]) -> None:
    """A slack cable as a straight rod in compression, two per cent too long: its index grows with the mesh."""
    rod = replace(
        cable(), parameters={"x": 280.0}, span=(280.0, 170.0),
        start=lambda s: np.stack([np.cos(0.1555) + 0 * s, 0 * s, np.sin(0.1555) + 0 * s, 0 * s], axis=1),
    )  # fmt: skip
    with pytest.raises(InputError, match=r"more half-waves .* or a start nearer to the equilibrium"):
        run(rod)


def test_a_first_index_of_the_mesh_that_a_run_goes_on_with() -> None:
    """A cantilever buckles at ``(2 k - 1)^2 pi^2 / 4``, 55 times below 30,000; four elements hold half of that."""
    scene = classics.column(
        "column", classics.SUPPORTS["clamped-free"], (30000.0, 30010.0), planar="e2", constants={"B2": 1.0}
    )
    found = trace(scene, accuracy=1e-6, depth=0)
    assert {point.negative for point in found[0].points} == {55}
    assert found.notes == ["the first state is unstable already (index 55): stability was lost outside the range"]

"""The index of each row is that of its own state, and from row to row it changes by what the special points say."""

from dataclasses import replace
from math import cos, pi, sin, sqrt

import golden_cases
import numpy as np
import pytest
from classics import ON_AXIS, column, explore, push

from rodfem import Discretization, Ordinate, Plan, Scene, StepControl, clamped, free, pinned, sliding, trace
from rodfem.continuation.branch import breaks
from rodfem.continuation.follow import follow
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.output.table import branch_data

EULER = pi**2 / 4
"""Buckling load of the clamped-free column."""


def localised(turns: int = 27) -> Scene:
    """A rod twisted by many turns and pulled by T between clamps: van der Heijden & Thompson (2000), in other units."""
    return column(
        "localised",
        (clamped(), sliding(ON_AXIS, (cos(turns * pi), 0.0, 0.0, sin(turns * pi)), lambda c: (0.0, 0.0, c.T))),
        (3200.0, 2450.0), load="T", constants={"T": 3200.0, "B2": 1.0, "C": 0.789 / 1.345},
        start=lambda s: np.stack([np.cos(turns * pi * s), 0 * s, 0 * s, np.sin(turns * pi * s)], axis=1),
        ordinate=Ordinate("end shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    )  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize(("elements", "told"), [(16, True), (40, False)])
def test_a_mesh_too_coarse_for_the_turns_of_a_rod_is_told(elements: int, told: bool) -> None:
    """The straight rod is stable under a high tension: m < 2 sqrt(T), whatever a mesh says."""
    assert 27 * 2 * pi * 0.789 / 1.345 < 2 * sqrt(3200.0)
    diagram = trace(localised(), Discretization("reduced", elements, 6), Plan((3200.0, 3190.0), depth=0))
    assert any("the index is 0 to 16" in warning for warning in diagram.warnings) == told
    assert {point.stable for point in diagram[0].points} == {None if told else True}


def test_bars_of_a_double_point_hold_for_both_loads() -> None:
    """Euler's loads of two planes, 8e-6 apart, are in error by 5.6e-6 each: the point is 1.4e-5 off for one."""
    apart = 8e-6
    scene = column("nearly round", (clamped(), free(push)), (2.0, 3.0), constants={"B2": 1.0 + apart / EULER})
    (special,) = trace(scene, Discretization("reduced", 2, 3), Plan(depth=0)).special("branch point")
    assert special.multiplicity == 2 and special.resolved
    assert [abs(special.point.load - load) <= special.error_estimate for load in (EULER, EULER + apart)] == [True, True]
    assert special.error_estimate < 2 * apart


def test_what_is_not_explained_is_kept() -> None:
    """With the special point taken out of a branch its rows contradict each other."""
    found = explore(column("euler", (pinned(), pinned(ON_AXIS, push)), (0.0, 30.0), constants={"B2": 1.3}))
    branch = found.branches[0]
    singular = [s for s in branch.special if s.kind == BRANCH_POINT]
    assert breaks(branch.points, branch.special) == []
    rows = [p for p in branch.points if p is not singular[0].point]
    (broken,) = breaks(rows, singular[1:])
    assert (broken.before, broken.after) == (0, 1)
    assert broken.a.load < singular[0].point.load < broken.b.load
    assert "index changes from 0 to 1" in str(broken)
    branch.points, branch.special = rows, singular[1:]
    branch.renumber()
    branch.explain()
    (entry,) = branch_data(branch)["unexplained"]
    assert (entry["before"], entry["after"]) == (0, 1)


def test_a_range_that_begins_at_a_branch_point() -> None:
    """What is not looked at is said: the branch point is a row that no search has before it."""
    scene = column("range", (clamped(), free(push)), (EULER, 4.0))
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(error_bars=False))
    (branch,) = diagram
    assert [p.negative for p in branch.points[1:]] == [1] * (len(branch.points) - 1)
    assert any("is singular: 1 eigenvalue vanishes there" in sentence for sentence in diagram.warnings)
    assert branch_data(branch)["singular_start"] == 1


def test_the_last_step_to_a_bound_goes_the_way_of_the_prediction() -> None:
    """From a straight state and a direction into the buckled ones the straight state at the bound is no next point."""
    scene = column("bound", (clamped(), free(push)), (0.0, 6.0))
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan((0.0, 2.6), depth=0, error_bars=False))
    (special,) = diagram.special("branch point")
    solver, last = diagram.solvers[0], diagram[0].points[-1]
    aside = last.tangent.copy()
    aside.axpy(1.0, special.null_vectors[0])
    aside.scale(1.0 / solver.system.norm(aside))
    bounds = 0.0, last.load + 0.01
    assert next(follow(solver, [last], StepControl(), bounds)).load == bounds[1]
    assert "no convergence" in next(follow(solver, [replace(last, tangent=aside)], StepControl(), bounds))


@pytest.mark.long
def test_what_is_free_on_the_trunk_alone_leaves_the_index_of_a_branch_open() -> None:
    """A straight rod between planes turns freely about its axis, a bent one does not: no change of index is missing."""
    diagram = golden_cases.trace(golden_cases.cases()["classic turning in a plane"](), error_bars=False)
    branch = next(b for b in diagram if b.parent)
    assert {p.zero for p in diagram[0].points if p.load < 15} == {1}
    assert (branch.points[1].negative, branch.points[1].zero) == (1, 0)
    assert not any(b.unexplained for b in diagram)


def test_a_branch_that_leaves_at_the_end_of_the_range_is_none() -> None:
    """All rows are within the range, of which it has nothing."""
    found = explore(column("range", (clamped(), free(push)), (0.0, EULER + 1e-9)), depth=1)
    (special,), (branch,) = found.special(), found.branches
    assert special.point.load == pytest.approx(EULER, abs=1e-11) and branch.ended == "end of range"
    assert max(p.load for p in branch.points) <= EULER * (1 + 1e-7)

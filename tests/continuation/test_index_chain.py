"""The index of each row is that of its own state, and from row to row it changes by what the special points say."""

from __future__ import annotations

import io
from dataclasses import replace
from math import cos, pi, sin, sqrt
from typing import Any

import demo_cases
import golden_cases
import hemitropic_cases
import numpy as np
import pytest
from classics import ON_AXIS, RIGID, ROUND, WIDE, circle, column, explore, push, winkler
from closed_form_hemitropic import buckling
from closed_form_hemitropic import loads as buckling_loads
from hard.two_freedoms import scene as two_freedoms
from mpi4py import MPI
from rows import verify
from scipy.optimize import brentq

from rodfem import (
    Discretization,
    End,
    Observer,
    Ordinate,
    Parameter,
    Plan,
    Ring,
    Scene,
    Solver,
    StepControl,
    clamped,
    free,
    pinned,
    sliding,
    trace,
)
from rodfem.app.terminal import Report
from rodfem.codim2.follow import locus
from rodfem.continuation.branch import Point, breaks, merge_doubles
from rodfem.continuation.follow import follow
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.continuation.switching import directions, leave
from rodfem.diagram import explorer
from rodfem.diagram.equivalence import are_images, equivalent
from rodfem.diagram.explorer import Explorer
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist
from rodfem.output.table import branch_data
from rodfem.stability.assessment import assess

pytestmark = pytest.mark.alone

EULER = pi**2 / 4
"""Buckling load of the clamped-free column."""


def localised(turns: int = 27) -> Scene:
    """A rod twisted by many turns and pulled by T between clamps: van der Heijden & Thompson (2000), in other units."""
    return Scene(
        name="localised", interval=(0.0, 1.0), rod=RIGID, load="T", span=(3200.0, 2450.0),
        energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, c.C)),
        parameters={"T": Parameter(3200.0), "C": Parameter(0.789 / 1.345)},
        ends=(clamped(), sliding(ON_AXIS, (cos(turns * pi), 0.0, 0.0, sin(turns * pi)), lambda c: (0.0, 0.0, c.T))),
        start=lambda s: np.stack([np.cos(turns * pi * s), 0 * s, 0 * s, np.sin(turns * pi * s)], axis=1),
        ordinate=Ordinate("end shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    )  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize(("elements", "told"), [(16, True), (40, False)])
def test_a_mesh_too_coarse_for_the_turns_of_a_rod_is_told(elements: int, told: bool) -> None:
    """The straight rod is stable under a high tension: m < 2 sqrt(T), whatever a mesh says."""
    assert 27 * 2 * pi * 0.789 / 1.345 < 2 * sqrt(3200.0)
    plan = Plan((3200.0, 3190.0), depth=0, error_bars=False)
    diagram = trace(localised(), Discretization("reduced", elements, 6), plan)
    assert any(f"on {elements} elements and" in warning for warning in diagram.warnings) == told
    assert (diagram[0].points[0].negative == 0) != told


@pytest.mark.long
def test_a_rod_under_high_tension() -> None:
    """Its eigenvalues are a thousand times as sensitive to its state as those of a rod without load.

    The count at the prediction is another one than at the equilibrium; the paper's reduction is a third opinion.
    """
    diagram = trace(localised(), Discretization("reduced", 40, 6), Plan(depth=1, error_bars=False))
    solver = diagram.solvers[0]
    verify(solver, diagram.branches)
    (buckled,) = diagram.branches[1:]
    assert {p.negative for p in buckled.points[1:]} == {1}
    for point in buckled.points[10::8]:
        solver.system.set_phase(point.x)
        assert assess(solver, point.x, "reduction").negative == 1


@pytest.mark.few(1)
@pytest.mark.parametrize(("apart", "most"), [(3e-3, 4.0), (1e-4, 4.0), (1e-6, 4.0), (1e-6, 40.0)])
def test_neighbours_in_one_step(apart: float, most: float) -> None:
    """A column that bends almost alike about both axes: (2n - 1)^2 pi^2 B/4, each with its own index on either side.

    Over the wider range the first two are one place, by their arclengths: their null vectors tell them apart.
    """
    scene = column(
        "neighbours", (clamped(), free(push)), (0.0, most), constants={"B1": 1.0, "B2": 1.0 + apart}
    )  # fmt: skip
    found = explore(scene).special()
    expected = [load * B for load in (EULER, 9 * EULER) for B in (1.0, 1.0 + apart) if load < most]
    assert [s.point.load for s in found] == pytest.approx(expected, abs=1e-11)
    assert [(s.negative_before, s.negative_after) for s in found] == [(n, n + 1) for n in range(len(expected))]


@pytest.mark.few(1)
@pytest.mark.parametrize("half", [1e-6, 1e-5, 1e-3])
def test_a_range_about_the_buckling_load(half: float) -> None:
    """The eigenvalue that vanishes is within the tolerance of zero at every row but the ends."""
    scene = column("range", (clamped(), free(push)), (EULER - half, EULER + half))
    found = explore(scene)
    (special,) = found.special()
    assert special.point.load == pytest.approx(EULER, abs=1e-11)
    assert (special.negative_before, special.negative_after) == (0, 1)


@pytest.mark.long
def test_a_double_point_that_the_mesh_splits() -> None:
    """Michell's ring of C = 1.5 at its fourth mode, C t0 = sqrt(15): one point, where two eigenvalues vanish."""
    scene = column(
        "ring", Ring(odd=True), (2.4, 2.7), load="k", constants={"k": 2.4, "B2": 1.0, "C": 1.5}, start=circle, **ROUND,
        energy=lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.k), (c.B1, c.B2, c.C)),
    )  # fmt: skip
    (branch,) = trace(scene, Discretization("auto", 8, 6), Plan(depth=0, steps=WIDE))
    (special,) = [s for s in branch.special if s.kind == BRANCH_POINT]
    assert (special.negative_before, special.negative_after, special.multiplicity) == (4, 6, 2)
    assert abs(special.point.load - np.sqrt(15) / 1.5) < special.error_estimate
    assert "does not tell apart" in special.note
    assert special.point.negative == min(special.negative_before, special.negative_after)
    assert not branch.unexplained


def test_bars_of_a_double_point_hold_for_both_loads() -> None:
    """Euler's loads of two planes, 8e-6 apart, are in error by 5.6e-6 each: the point is 1.4e-5 off for one."""
    apart = 8e-6
    scene = column("nearly round", (clamped(), free(push)), (2.0, 3.0), constants={"B2": 1.0 + apart / EULER})
    (special,) = trace(scene, Discretization("reduced", 2, 3), Plan(depth=0)).special("branch point")
    assert special.multiplicity == 2 and special.resolved
    assert [abs(special.point.load - load) <= special.error_estimate for load in (EULER, EULER + apart)] == [True, True]
    assert special.error_estimate < 2 * apart


def test_an_unresolved_point_is_no_half_of_a_double_one() -> None:
    """Two critical loads a tenth apart: the bar of the first one, set to 3, reaches the resolved other one."""
    scene = column("two", (clamped(), free(push)), (2.0, 3.0), constants={"B2": 1.1})
    (branch,) = trace(scene, Discretization("reduced", 4, 5), Plan(depth=0))
    first, second = branch.special[:2]
    first.error_estimate, first.resolved, bar = 3.0, False, second.error_estimate
    merge_doubles(branch)
    assert branch.special[:2] == [first, second]
    assert (second.multiplicity, second.error_estimate) == (1, bar) and bar < 1e-6
    assert not breaks(branch.points, branch.special)


def test_two_passages_of_one_load_are_no_double_point() -> None:
    """A branch comes back to the load of a branch point: in between it was elsewhere, by far more than the bars."""
    scene = column("two", (clamped(), free(push)), (2.0, 3.0), constants={"B2": 1.1})
    (branch,) = trace(scene, Discretization("reduced", 4, 5), Plan(depth=0))
    first, second = branch.special[:2]
    second.point.load = first.point.load
    merge_doubles(branch)
    assert branch.special[:2] == [first, second] and second.multiplicity == 1
    for row in branch.points:
        row.load = first.point.load
    merge_doubles(branch)
    assert branch.special[0] is second and second.multiplicity == 2


@pytest.mark.short
def test_a_family_at_the_first_load() -> None:
    """At P = 0 a ring under a radial dead load may turn freely; its branch leads across that family.

    The circle buckles in its plane at P = n^2 under a dead radial load (Bodner 1958); turned, it falls at once.
    """

    def load(c: Any) -> tuple[Any, ...]:
        import ufl

        return (c.P * ufl.cos(c.s), 0.0, -c.P * ufl.sin(c.s))

    scene = column(
        "dead ring", Ring(), (0.0, 5.0), start=circle, planar="e2", constants={"B2": 1.0}, distributed=load, **ROUND
    )  # fmt: skip
    (branch,) = explore(scene, elements=12).branches
    assert branch.ended == "end of range"
    assert len(branch.points) < 60
    assert [s.point.load for s in branch.special if s.kind == BRANCH_POINT] == pytest.approx([4.0], abs=1e-8)


@pytest.mark.long
def test_a_fold_beside_the_branch_point_that_it_comes_from() -> None:
    """At A = -2.31 the second branch of the hemitropic rod turns back 0.04 from where it begins.

    The locus of the fold at A = -2, followed to that A, has the same load.
    """
    branches = hemitropic_cases.explored(constants=(-2.31, 1.0, 1.0, 3.0))
    (fold,) = hemitropic_cases.specials(branches[2], "fold")
    assert fold.point.arclength < 0.05
    assert (fold.negative_before, fold.negative_after) == (3, 2)
    (other,) = hemitropic_cases.specials(hemitropic_cases.explored(constants=(-2.0, 1.0, 1.0, 3.0))[2], "fold")
    solver = hemitropic_cases.follower(constants=(-2.0, 1.0, 1.0, 3.0))
    found = locus(solver, other, "A", ((0.3, 0.4), (-2.31, -1.9)), error_bars=0)
    row = int(np.argmin(found.values[:, 1]))
    assert found.values[row] == pytest.approx([fold.point.load, -2.31], abs=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("largest", [0.05, 0.15])
def test_a_fold_and_a_branch_point_of_opposite_sign_in_one_step(largest: float) -> None:
    """On a foundation of k = 240 the second branch turns back 0.017 after its index has gone from 3 to 4.

    At the ends of the step it is 3.  Steps of 0.3 happen to end between the two.
    """
    scene = winkler()
    scene = replace(scene, parameters={**scene.parameters, "k": Parameter(240.0)})
    plan = Plan(depth=1, steps=StepControl(largest=largest), error_bars=False)
    branch = trace(scene, Discretization("auto", 8, 6), plan)[2]
    found = [(s.kind, s.negative_before, s.negative_after) for s in branch.special[1:3]]
    assert found == [(BRANCH_POINT, 3, 4), (FOLD, 4, 3)]
    assert [s.point.load for s in branch.special[1:3]] == pytest.approx([31.28043, 31.27381], abs=1e-5)


@pytest.mark.long
@pytest.mark.parametrize(("longer", "apart"), [(1e-3, 0.0265), (1e-4, 8.39e-3), (1e-6, 8.39e-4)])
def test_an_eigenvalue_that_passes_zero_twice_in_one_step(longer: float, apart: float) -> None:
    """Two double branch points of the straight rod, ``apart`` by the closed form: the index is 2 on either side.

    For A = 0 they depend on lam (1 - lam) l^2 alone, and meet at lam = 1/2 and a half length of 2.84188.
    """
    meet = brentq(lambda half: buckling(0.5, 0.0, 1.0, 1.0, half), 2.8, 2.9, xtol=1e-15)
    constants = (0.0, 1.0, 1.0, meet + longer)
    first = brentq(lambda lam: buckling(lam, *constants), 0.4, 0.5, xtol=1e-15)
    assert 1 - 2 * first == pytest.approx(apart, rel=5e-3)
    mesh, plan = Discretization("reduced", 16, 6), Plan(depth=0, steps=StepControl(largest=0.1), error_bars=False)
    (straight,) = trace(hemitropic_cases.scene(constants), mesh, plan)
    pair = straight.special[1:3]
    assert [(s.negative_before, s.negative_after) for s in pair] == [(2, 4), (4, 2)]
    assert [s.point.load for s in pair] == pytest.approx([first, 1 - first], abs=1e-9)
    # in a shorter rod the eigenvalue comes near zero, and turns back
    (straight,) = trace(hemitropic_cases.scene((0.0, 1.0, 1.0, meet - longer)), mesh, plan)
    assert [(s.negative_before, s.negative_after) for s in straight.special] == [(0, 2), (2, 0), (0, 0)]


@pytest.mark.long
def test_a_row_beside_a_pair_of_crossings() -> None:
    """A step of 0.3 ends 6e-4 beyond two double branch points that are 4e-3 apart, and tells nothing of them."""
    constants = (0.554629, 1.0, 1.0, 2.851609)
    expected = buckling_loads(*constants)
    plan = Plan(depth=0, steps=StepControl(largest=0.3), error_bars=False)
    (straight,) = trace(hemitropic_cases.scene(constants), Discretization("reduced", 16, 6), plan)
    found = [s for s in straight.special if s.kind == BRANCH_POINT]
    assert [s.point.load for s in found] == pytest.approx(expected, abs=1e-9)
    assert [(s.negative_before, s.negative_after) for s in found] == [(0, 2), (2, 4), (4, 2), (2, 0)]


@pytest.mark.few(1)
@pytest.mark.parametrize(("low", "high", "largest"), [
    (0.2950, 0.4994, 0.2), (0.0550, 0.4991, 0.3), (0.2950, 0.4990121, 0.1),  # beside the last row
    (0.4946, 0.6990, 0.3), (0.4940, 0.5490, 0.05),  # beside the first row
    (0.4910, 0.5050, 0.3), (0.49499, 0.5050, 0.3),  # in the only step
])  # fmt: skip
def test_a_pair_of_crossings_beside_an_end_of_a_range(low: float, high: float, largest: float) -> None:
    """The first row of a range has no row before it, and the last none after it."""
    constants = (0.554629, 1.0, 1.0, 2.851609)
    expected = [load for load in buckling_loads(*constants) if low < load < high]
    plan = Plan((low, high), depth=0, steps=StepControl(largest=largest), error_bars=False)
    (straight,) = trace(hemitropic_cases.scene(constants), Discretization("reduced", 16, 6), plan)
    found = [s for s in straight.special if s.kind == BRANCH_POINT]
    assert [s.point.load for s in found] == pytest.approx(expected, abs=1e-9)
    assert [(s.negative_before, s.negative_after) for s in found[-2:]] == [(2, 4), (4, 2)]
    assert not straight.unexplained


def test_a_pair_of_crossings_is_listed_once() -> None:
    """The row after a step with a pair may be so near to it that its determinant is far below its neighbours'."""
    constants = (0.1956061749617919, 1.0, 1.0, 3.9702302229890574)
    plan = Plan((0.42077, 0.7111), depth=0, steps=StepControl(largest=0.15), error_bars=False)
    (straight,) = trace(hemitropic_cases.scene(constants), Discretization("reduced", 16, 6), plan)
    found = [s.point.load for s in straight.special if s.kind == BRANCH_POINT]
    assert found == pytest.approx([x for x in buckling_loads(*constants) if 0.42077 < x < 0.7111], abs=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize(("slope", "largest"), [(2.0, 0.15), (2.8, 0.15), (2.8, 0.3), (-2.2, 0.15)])
def test_a_pair_of_crossings_that_no_parabola_shows(slope: float, largest: float) -> None:
    """The eigenvalue ``(P^2 - d^2)(1 + slope P)``: the parabola through three rows has its vertex too high, or in the
    step beside, and the second one may be off by more than the first.
    """
    apart = 1e-3
    model = two_freedoms(
        lambda u, f2, c: 0.6 * u**2 + 0.5 * (c.P * c.P - c.a) * (1 + c.b * c.P) * f2 + 0.1 * f2**2,
        (-0.31, 0.4), a=apart**2 / 4, b=slope,
    )  # fmt: skip
    plan = Plan(depth=0, steps=StepControl(first=largest / 2, largest=largest), error_bars=False)
    (branch,) = trace(model, Discretization("reduced", 4, 3), plan)
    found = [s for s in branch.special if s.kind == BRANCH_POINT]
    assert [(s.negative_before, s.negative_after) for s in found] == [(0, 1), (1, 0)]
    assert [s.point.load for s in found] == pytest.approx([-apart / 2, apart / 2], abs=1e-10)


@pytest.mark.long
def test_every_row_of_the_ring_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its branch comes back to where it ends, which its last rows tell, however short their steps are."""
    monkeypatch.setattr(explorer, "TAIL", 1)
    scene = demo_cases.scene("ring")
    diagram = trace(scene, Discretization("auto", 8, 6), Plan(error_bars=False))
    verify(diagram.solvers[0], diagram.branches)
    assert [b.name for b in diagram] == ["circle", "branch 1", "branch 1.1", "branch 1.2"]


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
    columns, (entry,) = branch_data(branch)["columns"], branch_data(branch)["unexplained"]
    assert (entry["before"], entry["after"]) == (0, 1)
    assert columns["load"][entry["row"]] == broken.a.load
    terminal = io.StringIO()
    Report(stream=terminal).summary({"branches": [branch_data(branch)], "parameter": "P", "range": [0.0, 30.0]})
    words = " ".join(terminal.getvalue().split())
    assert "changes its index without a special point that says why" in words or MPI.COMM_WORLD.rank > 0


@pytest.mark.long
def test_steps_that_do_not_explain_are_repeated() -> None:
    """A ring whose stiffness varies by 1e-4 along it: the double point at P = 3 is broken, and passed without a jump.

    The imperfect ring has one branch of stable states; a jump would leave it on the circle, with index 2.
    """
    import ufl

    scene = column(
        "nearly uniform", Ring(), (2.6, 3.4), start=circle, planar="e2", constants={"P": 2.6, "B2": 1.0, "e": 1e-4},
        potential=lambda x, c: loads.pressure(x.r, x.dr, c.P), **ROUND,
        energy=lambda v, k, c: (1 + c.e * ufl.cos(2 * c.s)) * bending_and_twist(k, (c.B1, c.B2, c.C)),
    )  # fmt: skip
    plan = Plan(depth=0, steps=StepControl(largest=0.1), error_bars=False)
    (branch,) = trace(scene, Discretization("auto", 12, 6), plan)
    assert {p.negative for p in branch.points} == {0}
    assert not branch.unexplained
    assert abs(branch.points[-1].ordinate - 2.0) > 0.3


@pytest.mark.few(1)
@pytest.mark.parametrize("short", [1e-9, 1e-4])
def test_branches_that_leave_at_the_end_of_the_range(short: float) -> None:
    """All rows are within the range; a branch of which it has nothing is none."""
    scene = column("range", (clamped(), free(push)), (0.0, EULER + short))
    found = explore(scene, depth=1)
    (special,) = found.special()
    assert special.point.load == pytest.approx(EULER, abs=1e-11)
    assert len(found.branches) == (2 if short == 1e-4 else 1)
    for branch in found.branches:
        assert branch.ended == "end of range"
        assert max(p.load for p in branch.points) <= scene.span[1] * (1 + 1e-7)


def test_a_range_that_begins_at_a_branch_point() -> None:
    """What is not looked at is said: the branch point is a row that no search has before it."""
    scene = column("range", (clamped(), free(push)), (EULER, 4.0))
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(error_bars=False))
    (branch,) = diagram
    assert [p.negative for p in branch.points[1:]] == [1] * (len(branch.points) - 1)
    assert any("is singular: 1 eigenvalue vanishes there" in sentence for sentence in diagram.warnings)
    assert branch_data(branch)["singular_start"] == 1


def test_a_range_that_ends_at_a_branch_point() -> None:
    scene = column("range", (clamped(), free(push)), (0.0, EULER))
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(depth=0, error_bars=False))
    assert not diagram.special() and {p.negative for p in diagram[0].points} == {0}
    assert any("ends at a singular state, at P = 2.4674011" in sentence for sentence in diagram.warnings)


def test_eigenvalues_beside_a_critical_load_are_no_family_of_equilibria() -> None:
    """Within the tolerance of a count, yet far above the round-off of their Rayleigh quotients: nothing moves.

    Nor does one stay near zero: that the range begins at its zero is what is said.
    """
    scene = column("range", (clamped(), free(push)), (EULER, EULER + 1e-6))
    diagram = trace(scene, Discretization("reduced", 8, 6), Plan(error_bars=False))
    said = " ".join((*diagram.warnings, *diagram.notes))
    assert "move freely" not in said and "zero that no symmetry" not in said
    assert "The first state, at P = 2.4674011, is singular" in said


@pytest.mark.long
def test_an_eigenvalue_that_stays_small_is_no_critical_load() -> None:
    """A spring of 5e-10 that falls by a tenth over the range: no load in it is critical, and the sign is undecided."""
    foot = End(
        position=lambda c: (0.0, 0.0, 0.0), energy=lambda x, c: loads.rotational_spring(x.q, c.k * (1 - c.P))
    )  # fmt: skip
    scene = column("soft", (foot, free()), (0.0, 0.1), constants={"k": 5e-10}, planar="e2")
    (note,) = trace(scene, Discretization("reduced", 8, 6), Plan(depth=0, error_bars=False)).notes
    assert "1 eigenvalue stays within 1e-10 of zero" in note and "their sign is undecided" in note


def test_mirror_images_are_compared_at_one_load() -> None:
    """First points at distances that differ by 1e-4, relative, are of a branch and its image all the same."""
    scene = column("mirror", (clamped(), free(push)), (0.0, 6.0))
    solver = Solver(scene, Discretization("reduced", 8, 6)).equilibria
    explorer = Explorer(solver, Plan(scene.span, depth=0, error_bars=False), Observer(), lambda: None)
    (special,) = [s for s in explorer.run()[0].special if s.kind == "branch point" and s.point.load < 4]
    (way,) = directions(solver, special)
    first = leave(solver, special, way, 0.05)
    way.scale(-1.0)
    image = leave(solver, special, way, 0.05 * (1 + 1e-4))
    assert not equivalent(first, image, solver.units)

    def images(a: Point, b: Point) -> bool:
        return are_images(solver, special, a, b, explorer.alike)

    assert images(first, image) and images(image, first)
    assert not images(replace(first, energy=1.001 * first.energy), image)
    assert not images(replace(first, negative=first.negative + 1), image)


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

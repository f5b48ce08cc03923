"""Following branches: exact loads, either direction, restarts from files, and the work of the ends."""

from itertools import pairwise
from math import pi
from pathlib import Path

import classics
import closed_form_hemitropic
import numpy as np
import pytest
import reference_values
from hard.published import pressed
from hard.writhing import clamped_rod
from hemitropic_cases import DEFAULT, explored, follower, specials, user_points
from rows import regular

import rodfem
from rodfem import Branch, Discretization, IndexStepControl, InputError, Plan, SceneError, StepControl, trace
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.output.files import load_state, states_of
from rodfem.ranks import on_first
from rodfem.whole_files import write_whole

AT = (0.05, 0.5, 0.9)


@pytest.mark.long
@pytest.mark.versions
def test_user_points_and_ends_lie_at_their_loads_exactly() -> None:
    straight, first, second = explored(at=AT)
    assert [s.point.load for s in specials(straight, "user")] == sorted(AT)
    assert [s.point.load for s in specials(first, "user")] == sorted(AT)[1:]  # the branch begins at 0.114
    assert [s.point.load for s in specials(second, "user") if s.point.load < 0.6] == [
        x for x in sorted(AT) if 0.35 < x < 0.6
    ]
    assert straight.points[0].load == 0.0
    assert straight.points[-1].load == first.points[-1].load == 0.95


def test_decreasing_load() -> None:
    """The same special points as with increasing load, met the other way round."""
    straight, *buckled = explored("reduced", 12, 6, span=(0.5, 0.05), at=(0.2,))
    found = specials(straight, "branch point")
    np.testing.assert_allclose(
        [s.point.load for s in found], closed_form_hemitropic.loads(*DEFAULT)[::-1], rtol=0, atol=1e-10
    )
    assert [(s.negative_before, s.negative_after) for s in found] == [(4, 2), (2, 0)]
    assert straight.points[0].load == 0.5
    assert straight.points[-1].load == 0.05
    second, first = buckled
    (fold,) = specials(second, "fold")
    assert fold.point.load == pytest.approx(reference_values.FOLD[0], abs=1e-10)
    assert (fold.negative_before, fold.negative_after) == (3, 2)
    assert (first.points[-1].load, second.points[-1].load) == (0.5, 0.5)
    assert user_points(first, 0.2)[0].ordinate == pytest.approx(reference_values.FIRST[0.2][0], abs=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize("start", [0.0, 0.01, 0.07 / 3, 0.05, 0.1])
def test_loads_are_located_as_precisely_as_they_claim(start: float) -> None:
    """Where the points of a branch lie must not matter, and 1/12 of the rod at degree 6 is exact for this purpose."""
    found = specials(explored("reduced", 12, 6, span=(start, 0.9), depth=0)[0], "branch point")
    for s, exact in zip(found, closed_form_hemitropic.loads(*DEFAULT), strict=True):
        assert abs(s.point.load - exact) <= 3 * s.located_to


def test_special_points_do_not_depend_on_the_steps() -> None:
    coarse = explored("reduced", 12, 6, span=(0.0, 0.6), steps=StepControl(first=0.05, largest=0.25, aim=2e-2))
    found = [s.point.load for b in coarse for s in b.special if s.kind in ("branch point", "fold")]
    np.testing.assert_allclose(
        found, [*closed_form_hemitropic.loads(*DEFAULT), reference_values.FOLD[0]], rtol=0, atol=1e-10
    )
    assert max(len(b.points) for b in coarse) < 20


def write_states(branch: Branch, solver: BranchSolver, path: Path) -> None:
    image = states_of([branch], [solver], path, first=True)
    on_first(solver.system.comm, lambda: write_whole({path: image}))


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_restart_on_another_discretisation(formulation: str, folder: Path) -> None:
    """A saved state starts Newton's method on other elements of another degree, and it lands on the exact state."""
    branch = explored(formulation, 8, 6, at=AT if formulation == "reduced" else (0.5,), depth=1)[1]
    write_states(branch, follower(formulation, 8, 6), folder / "states.h5")
    row = branch.points.index(user_points(branch, 0.5)[0])
    other = follower(formulation, 10, 8)
    guess = load_state(folder / "states.h5", branch.name, row, other)
    assert other.system.scalar(guess) == 0.5
    other.system.set_phase(guess)
    y, outcome = other.at_load(guess, 0.5, reach=1e-2)
    assert outcome.converged
    assert outcome.iterations <= 4
    assert other.shape.ordinate(y) == pytest.approx(reference_values.FIRST[0.5][0], abs=1e-10)


@pytest.mark.ranks
@pytest.mark.short
def test_restart_from_what_is_not_there(folder: Path) -> None:
    branch = explored(at=AT)[0]
    path = folder / "states.h5"
    write_states(branch, follower(), path)
    for wrong in ((folder / "nothing.h5", "straight", 0), (path, "crooked", 0), (path, "straight", 999)):
        with pytest.raises(InputError, match=r"no row .* of a branch"):
            load_state(*wrong, follower())
    with pytest.raises(InputError, match="states of the reduced formulation"):
        load_state(path, "straight", 0, follower("pointwise"))


def test_steps_that_bound_the_change_of_the_index() -> None:
    """Euler's loads of a pinned column of nearly equal stiffnesses, ``pi^2`` and ``1.0001 pi^2``: a row between."""
    rod = classics.column(
        "euler", classics.SUPPORTS["pinned-pinned"], (8.0, 12.0), constants={"B2": 1.0001}
    )  # fmt: skip
    found = {
        kind: rodfem.trace(rod, plan=Plan(depth=0, steps=kind(largest=0.2, first=0.2), error_bars=False))[0]
        for kind in (StepControl, IndexStepControl)
    }
    changes = {kind: {abs(a.index - b.index) for a, b in pairwise(regular(b))} for kind, b in found.items()}
    assert changes == {StepControl: {0, 2}, IndexStepControl: {0, 1}}
    for branch in found.values():
        loads = [s.point.load for s in branch.special if s.kind == "branch point"]
        assert loads == pytest.approx([np.pi**2, 1.0001 * np.pi**2], rel=1e-9)
    with pytest.raises(InputError, match="A change of the index of 0 leads nowhere: give change=1 or more"):
        IndexStepControl(change=0)


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize("factors", ["chain", "petsc"])
@pytest.mark.parametrize("mesh", [(4, 3), pytest.param((8, 4), marks=pytest.mark.alone)])
def test_an_equilibrium_is_a_first_state_that_stays(mesh: tuple[int, int], factors: str) -> None:
    """A circle pressed by forces of fixed direction is unstable; turned by pi, which round-off decided, it is not."""
    discretization = Discretization("pointwise", *mesh, factors=factors)
    for load in (0.2, 1.0):
        solver = rodfem.Solver(pressed("dead", (load, 5.0)), discretization).equilibria
        x, outcome = first_equilibrium(solver, load)
        assert outcome.converged
        assert solver.inertia.at(x).count().negative == 1
        r = solver.shape.sample(x)["r"]
        assert np.hypot(r[:, 0] - 1, r[:, 2]) == pytest.approx(1, abs=0.01)
        assert r[len(r) // 2] == pytest.approx((2, 0, 0), abs=0.01)


@pytest.mark.long
def test_singular_equations_are_told_in_a_sentence() -> None:
    """Two meshes of degree 1 on which the equations are exactly singular: no division by the size of nothing."""
    with pytest.raises(SceneError, match="Constraints depend on one another"):
        rodfem.trace(classics.pressed_ring(), Discretization("auto", 2, 1))
    diagram = rodfem.trace(classics.winkler(), Discretization("auto", 16, 1))
    assert diagram["straight"].ended == "end of range"
    assert any("the index is 0 or 1 (rotation about e3" in words for words in map(str, diagram.warnings))


@pytest.mark.long
@pytest.mark.parametrize("formulation", ["auto", "pointwise"])
def test_no_part_along_an_orbit_is_handed_on(formulation: str) -> None:
    """The loop of a turned rod: 350 rows, each of which may turn about the axis.

    A rod turned by 4 pi has the states of one that is not: the loads of the folds have the sum 4 pi, and the branch
    goes from the planar elastica to itself.
    """
    scene = clamped_rod(1.0, "phi", 0.45, (0.0, 4 * pi))
    (branch,) = trace(scene, Discretization(formulation, 10, 6), Plan(depth=0, error_bars=False))
    assert branch.ended == "end of range"
    first, last = (s.point.load for s in branch.special if s.kind == "fold")
    assert first + last == pytest.approx(4 * pi, abs=1e-9)
    assert branch.points[-1].energy == pytest.approx(branch.points[0].energy, rel=1e-9)

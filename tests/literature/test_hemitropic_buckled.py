"""Buckled branches against solutions of the boundary value problem by multiple shooting (see reference_values.py)."""

from math import pi

import numpy as np
import pytest
import reference_values
from classics import SUPPORTS, column
from hemitropic_cases import DEFAULT, Constants, explored, follower, specials, user_points
from rows import regular
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation
from scipy.special import ellipe, ellipk

from rodfem import Branch, Discretization, Ordinate, Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.forms import loads

AT = (0.2, 0.325, 0.5, 0.7, 0.9)
RICH = (16, 8)


def branches(
    formulation: str = "reduced", elements: int = 16, degree: int = 8, constants: Constants = DEFAULT
) -> list[Branch]:
    return explored(formulation, elements, degree, constants, at=AT, error_bars=(elements, degree) != RICH)


def from_point(all_branches: list[Branch], parent: str, number: int) -> Branch:
    """Branch that leaves the branch point of that number, from 0, on a parent."""
    origin = next(b for b in all_branches if b.name == parent)
    special = origin.special.index(specials(origin, "branch point")[number])
    (found,) = [b for b in all_branches if b.parent == (parent, special)]
    return found


@pytest.mark.long
def test_first_branch() -> None:
    first = from_point(branches(), "straight", 0)
    for load in AT:
        (p,) = user_points(first, load)
        if load in reference_values.FIRST:
            assert (p.ordinate, p.energy) == pytest.approx(reference_values.FIRST[load], abs=2e-11)
    last = first.points[-1]
    assert first.ended == "end of range"
    assert last.load == 0.95
    assert (last.ordinate, last.energy) == pytest.approx(reference_values.FIRST[0.95], abs=2e-11)
    assert {(p.negative, p.zero) for p in first.points[1:]} == {(0, 1)}


def test_second_branch() -> None:
    second = from_point(branches(), "straight", 1)
    (fold,) = specials(second, "fold")
    assert fold.point.load == pytest.approx(reference_values.FOLD[0], abs=2e-11)
    assert (fold.point.ordinate, fold.point.energy) == pytest.approx(reference_values.FOLD[1:], abs=1e-9)
    assert (fold.negative_before, fold.negative_after, fold.multiplicity) == (3, 2, 1)
    for p in regular(second)[1:]:
        assert (p.negative, p.zero) == (3 if p.arclength < fold.point.arclength else 2, 1)
    for load, ordinates in reference_values.AROUND_FOLD.items():
        assert [p.ordinate for p in user_points(second, load)] == pytest.approx(ordinates, abs=2e-11)
    for load, expected in reference_values.SECOND.items():
        (p,) = user_points(second, load)
        assert (p.ordinate, p.energy) == pytest.approx(expected, abs=2e-11)


def test_second_branch_ends_where_the_stretch_vanishes() -> None:
    second = from_point(branches(), "straight", 1)
    last = second.points[-1]
    assert second.ended == "stretch reaches zero"
    assert (last.load, last.ordinate) == pytest.approx(
        reference_values.ZERO_STRETCH, abs=2e-7
    )  # v3 is of order h^k, not h^2k
    assert abs(last.stretch) < 1e-9
    assert min(p.stretch for p in second.points[:-1]) > 0


@pytest.mark.long
def test_secondary_pitchfork() -> None:
    found = branches(constants=(0.0, 1.0, 1.0, 3.0))
    first = from_point(found, "straight", 0)
    (pitchfork,) = specials(first, "branch point")
    assert (pitchfork.point.load, pitchfork.point.ordinate) == pytest.approx(reference_values.PITCHFORK, abs=1e-10)
    assert (pitchfork.negative_before, pitchfork.negative_after, pitchfork.multiplicity) == (0, 1, 1)
    leaving = from_point(found, first.name, 0)
    assert {p.negative for p in leaving.points[1:]} == {0}
    for load, ordinate in reference_values.BEYOND_PITCHFORK.items():
        assert [p.ordinate for p in user_points(leaving, load)] == pytest.approx([ordinate], abs=1e-10)


@pytest.mark.long
@pytest.mark.parametrize(
    ("constants", "number", "load", "before", "after"),
    [
        ((-2.0, 1.0, 1.0, 3.0), 1, reference_values.FOLD_OF_SECOND, 3, 2),
        ((-3.0, 1.0, 1.0, 4.0), 2, reference_values.FOLD_OF_THIRD, 5, 4),
    ],
)
def test_folds_of_other_rods(constants: Constants, number: int, load: float, before: int, after: int) -> None:
    (fold,) = specials(from_point(branches(constants=constants), "straight", number), "fold")
    assert fold.point.load == pytest.approx(load, abs=5e-11)
    assert (fold.negative_before, fold.negative_after) == (before, after)


def test_third_branch_of_another_rod() -> None:
    third = from_point(branches(constants=(-2.0, 1.0, 1.0, 3.0)), "straight", 2)
    assert third.ended == "stretch reaches zero"
    assert third.points[-1].load == pytest.approx(reference_values.ZERO_STRETCH_OF_THIRD, abs=1e-7)


@pytest.mark.parametrize("constants", [DEFAULT, (0.0, 1.0, 1.0, 3.0), (-2.0, 1.0, 1.0, 3.0)])
def test_symmetry_leaves_no_drift(constants: Constants) -> None:
    for branch in branches(constants=constants):
        assert max(p.drift for p in branch.points) < 1e-12
        if branch.depth:
            assert min(p.zero for p in branch.points[1:]) == 1  # the circle of states that each belongs to


def test_states_have_the_flip_symmetry_of_the_paper() -> None:
    """A half turn about the axis through the middle, across e3: ``r(-s) = F r(s)``, ``R(-s) = F R(s) F``."""
    shape = follower("reduced", *RICH).shape
    for branch in branches()[1:]:
        for p in branch.points[1:-1:5]:
            sample = shape.sample(p.x)
            r, R = sample["r"], Rotation.from_quat(np.roll(sample["q"], -1, axis=1)).as_matrix()
            axis = r[len(r) // 2] / np.linalg.norm(r[len(r) // 2])
            F = 2 * np.outer(axis, axis) - np.eye(3)
            np.testing.assert_allclose(r[::-1], r @ F, atol=1e-9)
            np.testing.assert_allclose(R[::-1], F @ R @ F, atol=1e-9)


def test_formulations_agree_within_their_estimates() -> None:
    both = [branches(formulation, 10, 6) for formulation in ("reduced", "pointwise")]
    assert sum(len(b.special) for b in both[0]) > 15
    for a, b in zip(*both, strict=True):
        assert (a.name, a.ended) == (b.name, b.ended)
        for s, t in zip(a.special, b.special, strict=True):
            assert (s.kind, s.negative_before, s.negative_after) == (t.kind, t.negative_before, t.negative_after)
            assert abs(s.point.load - t.point.load) <= s.error_estimate + t.error_estimate
            assert abs(s.point.ordinate - t.point.ordinate) <= s.ordinate_error + t.ordinate_error


@pytest.mark.long
def test_an_elastica_whose_ends_meet_turns_as_a_rigid_body() -> None:
    """Where ``2 E(m) = K(m)``, at ``P0 = 4 K^2``, the ends of a pinned column meet: its loop may turn about any axis.

    The force that it carries turns with it: ``P = P0 cos(angle)``.  Two null vectors, and a circle of states at each
    load below, along which the Jacobian is singular.
    """
    m = brentq(lambda m: 2 * ellipe(m) - ellipk(m), 0.5, 0.99)
    P0 = 4 * ellipk(m) ** 2
    middle = Ordinate("middle", s=0.5, of=lambda r, q: float(np.hypot(r[0], r[1])))
    rod = column("pinned", SUPPORTS["pinned-pinned"], (0.0, 25.0), ordinate=middle)
    found = trace(rod, Discretization("reduced", 8, 6), Plan(error_bars=False))
    system = found.solvers[0].system
    (loop,) = [s for b in found if b.name == "branch 1" for s in b.special if s.kind == "branch point"]
    assert loop.point.load == pytest.approx(P0, rel=1e-9)
    assert loop.multiplicity == 2
    turned = [b for b in found if b.name.startswith("branch 1.")]
    assert turned  # one may stand for all: they are images of each other
    for branch in turned:
        assert branch.ended == "end of range"
        assert branch.points[-1].load == 0.0
        for p in branch.points[1:]:
            n = [system.scalar(p.x, name) for name in ("n1", "n2")]
            assert np.hypot(np.hypot(*n), p.load) == pytest.approx(P0, rel=1e-9)
            assert p.energy == pytest.approx(loop.point.energy, rel=1e-9)
            assert (p.negative, p.zero) == (1, 2)


@pytest.mark.long
@pytest.mark.parametrize("apart", [1e-3, 1e-5])
def test_a_branch_point_right_after_the_beginning_of_a_branch(apart: float) -> None:
    """Pinned column on a foundation k = 4 pi^4 (1 + d), where modes 1 and 2 nearly meet at P = 5 pi^2.

    With the deflection a_1 sin(pi s) + a_2 sin(2 pi s) the potential of fourth order of the inextensible rod is
    pi^6 (-11/64 a_1^4 - 5/4 a_1^2 a_2^2 + 1/4 a_2^4) there.  Mode 2 buckles at P_2 = (5 + d) pi^2 and turns unstable at
    P_2 + 3 pi^2 d / 11; mode 1 at P_1 = (5 + 4 d) pi^2, of index 2 down to P_1 - 33 pi^2 d.  One branch (and its mirror
    image) leads from one of these points to the other.
    """
    scene = column(
        "nearly double", SUPPORTS["pinned-pinned"], (48.0, 51.0), planar="e2",
        constants={"k": 4 * pi**4 * (1 + apart), "B2": 1.0}, potential=lambda x, c: loads.spring(x.r, (c.k, 0.0, 0.0)),
    )  # fmt: skip
    straight, second, first, *between = trace(scene, Discretization("auto", 8, 6), Plan(error_bars=False))
    assert [s.point.load for s in straight.special[:2]] == pytest.approx(
        [(5 + apart) * pi**2, (5 + 4 * apart) * pi**2], abs=1e-9
    )
    for branch, before, after, change in ((second, 0, 1, 3 / 11), (first, 2, 1, -33.0)):
        special = next(s for s in branch.special if s.kind == BRANCH_POINT)
        assert (special.negative_before, special.negative_after) == (before, after)
        away = special.point.load - branch.points[0].load
        assert away == pytest.approx(change * pi**2 * apart, rel=0.2 * (apart / 1e-3) ** 0.5)
        assert not branch.unexplained
    assert between
    assert {(b.parent, b.ended) for b in between} == {
        ((second.name, 0), f"meets {first.name} at P = {first.special[0].point.load:.8g}")
    }

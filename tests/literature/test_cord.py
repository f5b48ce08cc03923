"""The telephone cord against closed forms for the straight state and for the planar coils, and against shooting."""

from math import pi

import pytest
from closed_forms import coil, tensions
from demo_cases import explored
from hemitropic_cases import specials

from rodfem import Diagram

AT = (39.9, 40.0, 40.1)


def default() -> Diagram:
    return explored("cord", at=AT)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("turns", "span"),
    [(1, (30, -30)), (1.2, (60, -60)), (1.5, (60, 0)), (1.7, (90, 0)), (2, (140, 3)), (2.5, (250, 0))],
)
def test_straight_state(turns: float, span: tuple[float, float]) -> None:
    straight = (explored("cord", turns=turns, span=span, depth=0) if turns != 1.5 else default())["straight"]
    expected = [lam for lam in tensions(turns) if span[1] < lam < span[0]]
    found = specials(straight, "branch point")
    assert len(found) == len(expected) > 0
    for i, (s, lam) in enumerate(zip(found, expected, strict=True)):
        assert abs(s.point.load - lam) <= s.error_estimate
        assert s.error_estimate <= 3e-7
        assert (s.negative_before, s.negative_after, s.multiplicity) == (i, i + 1, 1)
    for p in straight.points:
        if min(abs(p.load - lam) for lam in expected) > 1e-6:
            assert (p.negative, p.zero) == (sum(lam > p.load for lam in expected), 0)
        assert (p.ordinate, p.energy) == pytest.approx((0, (2 * pi * turns) ** 2 / 2), rel=1e-12, abs=1e-12)


@pytest.mark.long
def test_range_that_ends_on_a_branch_point() -> None:
    """With whole turns the straight rod is singular at lam = 0, where a family of equal tension and energy leaves."""
    found = explored("cord", turns=1, span=(30, 0), elements=6, depth=1)
    assert [b.name for b in found.branches] == ["straight", "branch 1"]
    (s,) = specials(found["straight"], "branch point")
    assert abs(s.point.load) <= s.error_estimate <= 3e-10
    assert (s.negative_before, s.negative_after, s.law.kind) == (0, 1, "vertical branch")
    family = found["branch 1"]
    assert family.ended == "closed loop"
    (closed,) = family.special  # where an eigenvalue touches zero
    assert closed.kind in ("end", "branch point") and closed.point.ordinate == pytest.approx(1, abs=1e-9)
    assert {p.negative for p in family.points} == {0}
    assert max(p.ordinate for p in family.points) == pytest.approx(1, abs=1e-3)  # the closed ring
    for p in family.points:
        assert (p.load, p.energy) == pytest.approx((0, 2 * pi**2), abs=1e-8)


@pytest.mark.long
def test_euler_buckling_out_of_the_plane_of_curvature() -> None:
    """At -4 pi^2 the straight rod buckles about d2, which its curvature does not feel; its load enters no equation."""
    found = explored("cord", turns=1, span=(20, -60), elements=6)
    euler = specials(found["straight"], "branch point")[1]
    assert euler.point.load == pytest.approx(-4 * pi**2, abs=1e-9)
    assert euler.coupling == 0
    folds = [s for b in found.branches for s in specials(b, "fold")]
    assert all(abs(s.point.load + 4 * pi**2) > 1e-6 for s in folds)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("name", "index", "ordinate", "energy"),
    [("branch 1", 0, 0.5793314270531122, 18.619732294799), ("branch 2", 2, 0.4471009289604404, 38.650541761819)],
)
def test_perversions(name: str, index: int, ordinate: float, energy: float) -> None:
    (s,) = [s for s in default()[name].special if s.kind == "user" and s.point.load == 40.0]
    assert abs(ordinate - s.point.ordinate) <= s.error_estimate + 1e-11 <= 4e-10
    assert s.point.energy == pytest.approx(energy, abs=1e-8)
    assert s.point.negative == index
    if name == "branch 1":
        assert {q.negative for q in default()[name].points[1:]} == {0}


def test_fold() -> None:
    branch = default()["branch 2"]
    (fold,) = specials(branch, "fold")
    assert abs(fold.point.load - 7.8065554232) <= fold.error_estimate + 1e-10 <= 1e-9  # 1e-10: left by shooting
    assert (fold.negative_before, fold.negative_after) == (1, 2)
    for q in branch.points[1:]:
        if q is not fold.point:
            assert q.negative == (1 if q.arclength < fold.point.arclength else 2)


def test_first_branch_ends_on_planar_coils() -> None:
    first, above, below = (default()[name] for name in ("branch 1", "branch 1.1", "branch 1.2"))
    assert first.ended.startswith("meets another branch")
    meeting = first.special[-1]
    assert abs(meeting.point.load - 35.80096162556552) <= meeting.error_estimate <= 3e-8  # by shooting
    assert above.points[1].load > meeting.point.load > below.points[1].load
    assert ({p.negative for p in above.points[1:]}, {p.negative for p in below.points[1:]}) == ({1}, {0})
    assert (above.points[-1].load, below.points[-1].load) == (60.0, 0.0)
    for p in above.points + below.points:
        ordinate, energy, _ = coil(p.load)
        assert (p.ordinate, p.energy) == pytest.approx((ordinate, energy), abs=1e-6)
    for s in above.special + below.special:
        assert abs(s.point.ordinate - coil(s.point.load)[0]) <= s.ordinate_error

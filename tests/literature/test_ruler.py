"""The ruler against shooting: bending in its plane, lateral buckling, and what it does afterwards."""

from math import inf

import numpy as np
import pytest
from demo_cases import Found, explored
from hemitropic_cases import specials, user_points
from scipy.optimize import newton
from shooting_solver import Problem, Rod

from rodfem.continuation.branch import Point

AT = (5.95, 6.0, 6.05)
STIFFNESS = (1.0, 10.0, 1.0)
FORCES = {"e1": (1.0, 0.0, 0.0), "e2": (0.0, 1.0, 0.0)}


def shooting(stretching: float = 20.0) -> Problem:
    """The ruler, whose free end bears no moment."""
    return Problem(Rod(STIFFNESS, stretching=stretching), rows=[4, 5, 6], shot=[3, 4, 5])


def default(formulation: str = "reduced") -> Found:
    return explored("ruler", formulation, at=AT)


def shot(found: Found, point: Point, direction: str = "e1") -> np.ndarray:
    """First guess of force and moment at s = 0 for shooting."""
    _, k = found.start_of_rod(point)
    return np.concatenate([point.load * np.array(FORCES[direction]), np.array(STIFFNESS) * k])


def tip(found: Found, point: Point) -> np.ndarray:
    return found.follower.shape.sample(point.x)["r"][-1]


def lateral_buckling(near: float, stretching: float) -> float:
    """Load at which the linearised problem of shooting is singular on the way that stays in the plane."""
    problem = shooting(stretching)

    def singular(lam: float) -> float:
        p, _ = problem.solve(np.array([lam, 0, 0, 0, 0.8 * lam, 0]))
        return problem.singular(p)

    return float(newton(singular, near, x1=near * 1.001, tol=1e-10))


def test_bending_in_the_plane() -> None:
    plane = default()["plane"]
    for load in AT:
        (p,) = user_points(plane, load)
        _, end = shooting().solve(shot(default(), p))
        assert tip(default(), p) == pytest.approx(end[7:10], abs=1e-11)
        assert (p.energy, p.ordinate) == pytest.approx((end[10], 0), abs=1e-11)


@pytest.mark.long
def test_lateral_buckling() -> None:
    plane = default()["plane"]
    first, second = specials(plane, "branch point")
    assert first.point.load == pytest.approx(4.42594840243, abs=2e-11)
    for i, s in enumerate((first, second)):
        lam = lateral_buckling(s.point.load + 1e-3, 20.0)
        assert abs(s.point.load - lam) <= s.error_estimate + 1e-10  # 1e-10: what shooting leaves open
        assert (s.negative_before, s.negative_after, s.multiplicity) == (i, i + 1, 1)
    for p in plane.points:
        if p not in (first.point, second.point):
            assert (p.negative, p.zero) == ((p.load > first.point.load) + (p.load > second.point.load), 0)


@pytest.mark.few(1)
@pytest.mark.parametrize(("name", "index"), [("branch 1", 0), ("branch 2", 1)])
def test_buckled(name: str, index: int) -> None:
    branch = default()[name]
    assert branch.ended == "end of range"
    end = branch.special[-1]
    assert end.point.load == 12
    _, state = shooting().solve(shot(default(), end.point))
    assert abs(abs(state[8]) - end.point.ordinate) <= end.ordinate_error + 1e-11
    assert tip(default(), end.point) == pytest.approx(state[7:10], abs=1e-10)
    assert {p.negative for p in branch.points[1:]} == {index}


@pytest.mark.long
def test_nothing_happens_the_easy_way() -> None:
    found = explored("ruler", direction="e2", span=(0.0, 20.0))
    (plane,) = found.branches
    assert [s.kind for s in plane.special] == ["end"]
    assert {(p.negative, p.zero) for p in plane.points} == {(0, 0)}
    _, end = shooting().solve(shot(found, plane.points[-1], "e2"))
    assert tip(found, plane.points[-1]) == pytest.approx(end[7:10], abs=1e-9)


@pytest.mark.long
def test_inextensible_limit() -> None:
    stretchings = np.array([1e5, 1e6])
    loads = []
    for stretching in stretchings:
        (s,) = specials(explored("ruler", stretching=stretching, depth=0)["plane"], "branch point")
        loads.append(s.point.load)
    limit = (loads * stretchings @ [-1, 1]) / (stretchings @ [-1, 1])  # the error of each falls as 1/E
    assert limit == pytest.approx(4.62463226448, abs=1e-9)
    assert limit == pytest.approx(lateral_buckling(4.62, inf), abs=1e-9)

"""The ruler against shooting: bending in its plane, lateral buckling, and what it does afterwards."""

import numpy as np
import pytest
from demo_cases import explored
from hemitropic_cases import specials, user_points

from rodfem import Diagram, Point

PLANE = {  # load: place of the tip along e1 and e3, energy
    5.95: (0.21950426791788374, 1.0355171287996603, 0.6850578789534028),
    6.0: (0.22172761018449857, 1.0361150659712588, 0.6983423908615009),
    6.05: (0.22396105330165647, 1.0367178298311446, 0.7117989279512859),
}


def default() -> Diagram:
    return explored("ruler", at=tuple(PLANE))


def tip(found: Diagram, point: Point) -> np.ndarray:
    return found.solvers[0].shape.sample(point.x)["r"][-1]


def test_bending_in_the_plane() -> None:
    plane = default()["plane"]
    for load, (x, z, energy) in PLANE.items():
        (p,) = user_points(plane, load)
        assert tip(default(), p) == pytest.approx([x, 0.0, z], abs=1e-11)
        assert (p.energy, p.ordinate) == pytest.approx((energy, 0), abs=1e-11)


@pytest.mark.long
def test_lateral_buckling() -> None:
    plane = default()["plane"]
    first, second = specials(plane, "branch point")
    assert first.point.load == pytest.approx(4.42594840243, abs=2e-11)
    for i, (s, load) in enumerate(zip((first, second), (4.425948402435, 10.635220697974), strict=True)):
        assert abs(s.point.load - load) <= s.error_estimate + 1e-10  # 1e-10: what shooting leaves open
        assert (s.negative_before, s.negative_after, s.multiplicity) == (i, i + 1, 1)
    for p in plane.points:
        if p not in (first.point, second.point):
            assert (p.negative, p.zero) == ((p.load > first.point.load) + (p.load > second.point.load), 0)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("name", "index", "expected"),
    [
        ("branch 1", 0, (1.1738647736890442, 0.434795935714453, 0.5626951497415474)),
        ("branch 2", 1, (0.7520917413499695, 0.23703335595525393, 1.0471217919667832)),
    ],
)
def test_buckled(name: str, index: int, expected: tuple[float, float, float]) -> None:
    branch = default()[name]
    assert branch.ended == "end of range"
    end = branch.special[-1]
    assert end.point.load == 12
    assert abs(expected[1] - end.point.ordinate) <= end.ordinate_error + 1e-11
    x, y, z = tip(default(), end.point)
    assert (x, abs(y), z) == pytest.approx(expected, abs=1e-10)
    assert {p.negative for p in branch.points[1:]} == {index}


@pytest.mark.long
def test_nothing_happens_the_easy_way() -> None:
    found = explored("ruler", direction="e2", span=(0.0, 20.0))
    (plane,) = found.branches
    assert [s.kind for s in plane.special] == ["end"]
    assert {(p.negative, p.zero) for p in plane.points} == {(0, 0)}
    assert tip(found, plane.points[-1]) == pytest.approx([0.0, 2.3793790722785904, 0.4145206753165119], abs=1e-9)

"""Springs that are weak beside the rod that they hold: a motion that they keep it from is no symmetry."""

from __future__ import annotations

import pytest
import ufl

from rodfem import Discretization, End, Ordinate, Plan, Scene, Solver, hinged, pinned, trace


def hinge(bending: float, spring: float) -> Scene:
    """A thrust on a rod that is hinged at its foot, in a plane, and held by a spring at its tip: it falls at P = k l.

    Whatever its stiffness the mode is a rigid rotation.
    """
    return Scene(
        "hinge", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: bending * ufl.dot(k, k) / 2, {"P": 0.0},
        "P", (hinged((0.0, 1.0, 0.0)), End(force=lambda c: (0.0, 0.0, -c.P), energy=lambda x, c: spring * x.r[0] ** 2)),
        Ordinate("x", s=1.0, of=lambda r, q: r[0]), (0.0, 4.0), planar="e2",
    )  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("bending", [*(pytest.param(b, marks=pytest.mark.alone) for b in (1.0, 1e6, 1e12)), 1e9])
def test_a_rotation_against_a_spring_is_no_symmetry(bending: float) -> None:
    """Beside 1e9 a spring of 1 was round-off in the functional, and the rod stable on its whole range, to P = 4."""
    system = Solver(hinge(bending, 0.5), Discretization(elements=3, degree=4)).equilibria.system
    assert system.symmetries == []


@pytest.mark.long
@pytest.mark.parametrize("bending", [1.0, 1e9])
def test_a_rotation_that_springs_allow_is_one(bending: float) -> None:
    rod = Scene(
        "post", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: bending * ufl.dot(k, k) / 2, {"P": 0.0},
        "P", (pinned(), End(force=lambda c: (0.0, 0.0, -c.P), energy=lambda x, c: x.r[0] ** 2 + x.r[1] ** 2)),
        Ordinate("x", s=1.0, of=lambda r, q: r[0]), (0.0, 4.0),
    )  # fmt: skip
    system = Solver(rod, Discretization(elements=3, degree=4)).equilibria.system
    assert "rotation about e3" in " ".join(map(str, system.symmetries))


@pytest.mark.long
@pytest.mark.alone
def test_it_is_undecided_where_the_spring_is_round_off() -> None:
    (branch,) = trace(hinge(1e10, 0.5), Discretization(elements=3, degree=4), Plan(depth=0))
    assert not any(point.stable for point in branch.points if point.load > 1.0)
    (branch,) = trace(hinge(1e4, 0.5), Discretization(elements=3, degree=4), Plan(depth=0))
    special = branch.special[0]
    assert abs(special.point.load - 1.0) <= special.error_estimate < 1e-6

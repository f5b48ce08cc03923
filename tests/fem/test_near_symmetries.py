"""Rods that are symmetric but for little, or for what is round-off next to a stiff strain; rings along themselves."""

from math import pi
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column
from hard.published import pressed

from rodfem import Discretization, End, Ordinate, Plan, Scene, SceneError, Solver, free, hinged, pinned, trace
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.forms.energy import bending_and_twist


def hinge(bending: float, spring: float) -> Scene:
    """A thrust on a rod that is hinged at its foot, in a plane, and held by a spring at its tip: it falls at P = k l.

    Whatever its stiffness the mode is a rigid rotation.
    """
    return Scene(
        "hinge", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: bending * ufl.dot(k, k) / 2, {"P": 0.0},
        "P", (hinged((0.0, 1.0, 0.0)), End(force=lambda c: (0.0, 0.0, -c.P), energy=lambda x, c: spring * x.r[0] ** 2)),
        Ordinate("x", s=1.0, of=lambda r, q: r[0]), (0.0, 4.0), planar="e2",
    )  # fmt: skip


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize("bending", [*(pytest.param(b, marks=pytest.mark.alone) for b in (1.0, 1e6, 1e12)), 1e9])
def test_a_rotation_against_a_spring_is_no_symmetry(bending: float) -> None:
    """Beside 1e9 a spring of 1 was round-off in the functional, and the rod stable on its whole range, to P = 4."""
    system = Solver(hinge(bending, 0.5), Discretization(elements=3, degree=4)).equilibria.system
    assert system.symmetries == []


@pytest.mark.ranks
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
def test_it_is_undecided_where_the_spring_is_round_off() -> None:
    (branch,) = trace(hinge(1e10, 0.5), Discretization(elements=3, degree=4), Plan(depth=0))
    assert not any(point.stable for point in branch.points if point.load > 1.0)
    (branch,) = trace(hinge(1e4, 0.5), Discretization(elements=3, degree=4), Plan(depth=0))
    special = branch.special[0]
    assert abs(special.point.load - 1.0) <= special.error_estimate < 1e-6


CURVATURE, LEAST = 4e-9, 3e-5
"""Own curvature of the rod; eigenvalues below the other are not compared: those below 1e-5 count as zero."""


@pytest.mark.long
def test_an_eigenvalue_near_zero_is_no_rotation() -> None:
    """A round rod on pins, with a curvature that a stiff twist hides: its lowest eigenvalues are 1 - P/pi^2.

    Its turning about itself is the one that is zero.
    """
    rod = Scene(
        "nearly straight", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (k[0] ** 2 + (k[1] - CURVATURE) ** 2 + 1e4 * k[2] ** 2) / 2, {"P": 0.0}, "P",
        (pinned(), pinned(lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P))),
        Ordinate("x", s=0.5, of=lambda r, q: r[0]), (9.8, 9.87),
    )  # fmt: skip
    (branch,) = trace(rod, Discretization(elements=6, degree=4), Plan(depth=0))
    rows = [point for point in branch.points if 1 - point.load / pi**2 > LEAST]
    assert max(point.load for point in rows) > pi**2 * (1 - 10 * LEAST)
    assert {(point.negative, point.zero) for point in rows} == {(0, 1)}


@pytest.mark.ranks
@pytest.mark.long
def test_a_pendulum_beside_a_stiff_twist_falls() -> None:
    """A rod on a ball joint, pulled and then pushed at its tip by a small force w: both rotations have mu = w.

    Beside a twist 3e7 times as stiff as bending they were zeros of two symmetries, and the rod was stable at w < 0.
    """
    rod = Scene(
        "pendulum", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: (k[0] ** 2 + k[1] ** 2 + 3e7 * k[2] ** 2) / 2, {"w": 0.0}, "w",
        (pinned(), free(lambda c: (0.0, 0.0, c.w))), Ordinate("x", s=1.0, of=lambda r, q: r[0]), (1e-4, -1e-4),
    )  # fmt: skip
    (branch,) = trace(rod, Discretization(elements=4, degree=4), Plan(depth=0, error_bars=False))
    fallen = [point for point in branch.points if point.load < -1e-5]
    assert len(fallen) > 3
    assert {point.negative + point.undecided for point in fallen} == {2}


@pytest.mark.long
def test_a_ring_that_is_bent_a_little_moves_along_itself() -> None:
    """Translations apart, a circle has its rotation in the plane alone, which is its motion along itself, too.

    With two waves of an amplitude from 1e-5 on these are two motions; one of round-off is none.
    """
    diagram = trace(pressed("dead", (0.3, 4.5)), Discretization("pointwise", 16, 6), Plan(depth=0, error_bars=False))
    (special,) = [s for s in diagram[0].special if s.kind == BRANCH_POINT]
    system, drifts = diagram.solvers[0].system, {}
    for amplitude in (0.0, 1e-8, 3e-5, 1e-4, 1e-2):
        x = special.point.x + amplitude * special.null_vectors[0]
        system.set_phase(x)
        drifts[amplitude] = system.active_drifts(x)
    circle = drifts[0.0]
    assert drifts == {0.0: circle, 1e-8: circle, 3e-5: circle + 1, 1e-4: circle + 1, 1e-2: circle + 1}


@pytest.mark.ranks
@pytest.mark.long
def test_the_derivative_of_tanh_of_large_numbers() -> None:
    """UFL has it as 2 cosh(x) / (cosh(2 x) + 1), which overflows, where tanh(x) is one."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return (1.5 - 0.5 * ufl.tanh((c.s - c.k) / c.w)) * bending_and_twist(k, (c.B1, c.B2, c.C))

    scene = column("sharp", SUPPORTS["clamped-free"], (0.0, 6.0), energy=energy, constants={"k": 1e-7, "w": 1e-8})
    with pytest.raises(SceneError, match=r"are no numbers at any of the 3 states .* overflows"):
        Solver(scene, Discretization("auto", 2, 3))

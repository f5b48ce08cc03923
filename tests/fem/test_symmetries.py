"""Continuous symmetries that are found from the equations, exact ones and those that are none; linking numbers."""

from math import hypot, pi, sqrt
from typing import Any

import classics
import numpy as np
import pytest
import ufl
from classics import push
from demo_cases import scene
from hard.published import pressed
from hemitropic_cases import DEFAULT
from hemitropic_cases import scene as hemitropic

from rodfem import Discretization, Inertia, Ordinate, Plan, Scene, SceneError, Solver, trace
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.fem.shape import link
from rodfem.fem.system import FEW, System
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.ends import End, Ring, clamped, free, pinned
from rodfem.problem.functions import Constants
from rodfem.writhe import lies_on_itself

MIDDLE = Ordinate("displacement of the middle", s=0.5, of=lambda r, q: hypot(r[0], r[1]))


def sheared(v: ufl.core.expr.Expr, stiffness: float) -> ufl.core.expr.Expr:
    """Energy of shear, alike in all directions, and of stretch."""
    return stiffness * (v[0] ** 2 + v[1] ** 2 + 2 * (v[2] - 1) ** 2)


def column(left: End, right: End, B: float = 2.0, rod: str = "unshearable and inextensible") -> Scene:
    return classics.column(
        "column", (left, right), (0.0, 30.0), rod=rod, constants={"B": B}, ordinate=MIDDLE,
        energy=lambda v, k, c: bending_and_twist(k, (1.0, c.B, 1.0)) + (sheared(v, 25.0) if rod == "flexible" else 0),
    )  # fmt: skip


def ring(twisting: float = 1.5, B: float = 1.0, shearing: float = 0.0) -> Scene:
    def energy(v, k, c: Constants):
        out = bending_and_twist((k[0], k[1], k[2] - c.t), (1.0, c.B, twisting))
        return out + sheared(v, shearing) if shearing else out

    return classics.column(
        "ring", Ring(), (0.0, 3.0), rod="flexible" if shearing else classics.RIGID, energy=energy, load="t",
        constants={"t": 0.0, "B": B}, start=classics.circle, **classics.ROUND,
    )  # fmt: skip


SLIDING = pinned(lambda c: (0.0, 0.0, None), push)
CASES = [
    (column(clamped(), free(push)), 0, 0),
    (column(pinned(), SLIDING), 1, 1),  # turns about its axis
    (column(pinned(), SLIDING, B=1.0), 2, 2),  # and its cross-sections are round
    (hemitropic(DEFAULT), 1, 1),
    (scene("cord"), 0, 0),
    (ring(), 5, 8),  # three rotations, round cross-sections, along itself; three translations where there are places
    (ring(B=2.0), 4, 7),
    (column(pinned(), SLIDING, B=1.0, rod="flexible"), 2, 2),  # shear is turned with the sections
    (column(clamped(), free(push), B=1.0, rod="flexible"), 1, 1),
    (column(clamped(), free(push), rod="flexible"), 0, 0),
    (ring(shearing=25.0), 5, 8),
    (ring(B=2.0, shearing=25.0), 4, 7),
]


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize(("rod", "reduced", "pointwise"), CASES)
def test_number_of_symmetries(rod: Scene, reduced: int, pointwise: int) -> None:
    for formulation, expected in (("reduced", reduced), ("pointwise", pointwise)):
        assert len(System(rod, Discretization(formulation, 4, 6)).symmetries) == expected


@pytest.mark.few(1)
@pytest.mark.parametrize(("rod", "expected"), [(scene("cord"), 0), (hemitropic(DEFAULT), 1), (scene("ruler"), 0)])
def test_a_fine_mesh_has_the_same_symmetries(rod: Scene, expected: int) -> None:
    """Those of many unknowns are sought with few elements."""
    system = System(rod, Discretization("reduced", 1000, 1))
    assert system.fields.unknowns > FEW
    assert len(system.symmetries) == expected


@pytest.mark.long
def test_round_rods_that_shear() -> None:
    """A ring of round sections, stiff in shear, buckles where Michell's does; the number of its zeros is that one's.

    A column that has buckled sideways, and may do so to all sides, is stable, as Haringx' column is.
    """
    (point,) = trace(ring(shearing=2.5e7), Discretization("auto", 12, 5), Plan((0.0, 1.5), depth=0)).special(
        "branch point"
    )
    assert point.point.load == pytest.approx(2 / sqrt(3), abs=2e-8)
    assert (point.negative_before, point.negative_after) == (0, 2)
    diagram = trace(column(clamped(), free(push), B=1.0, rod="flexible"), plan=Plan((0.0, 4.0), depth=1))
    assert {(p.negative, p.zero, p.undecided) for p in diagram["branch 1"].points[1:]} == {(0, 1, 0)}


@pytest.mark.parametrize("turns", [-1, 0, 3])
def test_link_of_a_twisted_circle(turns: int) -> None:
    s = np.linspace(0, 2 * np.pi, 97)
    half = turns * s / 2
    q = np.stack([np.cos(s / 2) * np.cos(half), np.sin(s / 2) * np.sin(half), np.sin(s / 2) * np.cos(half)], axis=1)
    q = np.column_stack([q, np.cos(s / 2) * np.sin(half)])
    r = np.stack([1 - np.cos(s), 0 * s, np.sin(s)], axis=1)
    number, Tw, Wr = link({"s": s, "q": q, "r": r})
    assert number == turns
    assert (Tw, Wr) == pytest.approx((turns, 0.0), abs=1e-4)


@pytest.mark.parametrize("thick", [0.0, 1e-4])
def test_a_circle_covered_twice_has_no_linking_number(thick: float) -> None:
    """A trefoil on a thin torus has a writhe of three turns; on the circle it lies on itself."""

    def trefoil(t: np.ndarray) -> np.ndarray:
        out = 2 + thick * np.cos(3 * t)
        return np.stack([out * np.cos(2 * t), out * np.sin(2 * t), thick * np.sin(3 * t)], axis=-1)

    assert lies_on_itself(trefoil, (0.0, 2 * pi)) == (thick == 0)
    s = np.linspace(0, 4 * pi, 193)
    q = np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)
    r = np.stack([1 - np.cos(s), 0 * s, np.sin(s)], axis=1)
    assert np.isnan(link({"s": s, "q": q, "r": r})[0])


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize(("second", "number"), [(1.2, 0), (1.01, 0), (1.0, 1)])
@pytest.mark.parametrize("twisting", [pytest.param(1.0, marks=pytest.mark.alone), 1e7])
def test_bending_alike_is_told_beside_a_stiff_twist(second: float, number: int, twisting: float) -> None:
    """Beside 1e7 a difference of 0.2 was round-off: a bending mode, and the flutter load, were lost to a symmetry."""
    rod = classics.column(
        "stiff", (clamped(), free(follower_moment=lambda c: (0.0, 0.0, c.P))), (0.0, 1.0),
        constants={"B2": second, "C": twisting}, inertia=Inertia(lambda c: 1.0),
    )  # fmt: skip
    assert len(System(rod, Discretization("pointwise", 4, 6)).symmetries) == number


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

    scene = classics.column(
        "sharp", classics.SUPPORTS["clamped-free"], (0.0, 6.0), energy=energy, constants={"k": 1e-7, "w": 1e-8}
    )
    with pytest.raises(SceneError, match=r"are no numbers at any of the 3 states .* overflows"):
        Solver(scene, Discretization("auto", 2, 3))

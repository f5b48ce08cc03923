"""Continuous symmetries that are found from the equations, first equilibria far from the start, and linking numbers."""

from math import hypot, sqrt

import classics
import numpy as np
import pytest
import ufl
from demo_cases import scene
from hemitropic_cases import DEFAULT
from hemitropic_cases import scene as hemitropic

from rodfem import Discretization, End, Plan, Ring, Solver, clamped, free, pinned, trace
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.fem.newton import relax
from rodfem.fem.shape import link
from rodfem.fem.system import FEW, System
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.functions import Constants
from rodfem.problem.scene import Inertia, Ordinate, Parameter, Scene

MIDDLE = Ordinate("displacement of the middle", s=0.5, of=lambda r, q: hypot(r[0], r[1]))


def push(c: Constants) -> tuple:
    return (0.0, 0.0, -c.P)


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


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", ["reduced", "pointwise"])
def test_generators_are_null_vectors(formulation: str) -> None:
    """``S g = 0`` at an equilibrium, for the buckled pinned rod and both its symmetries."""
    solver = Solver(column(pinned(), SLIDING, B=1.0), Discretization(formulation, 8, 6)).equilibria
    system = solver.system
    x = solver.start(15.0, bent=0.8)
    system.set_phase(x)
    assert relax(system, x, solver.axis).converged
    assert solver.shape.ordinate(x) > 0.1
    assert len(system.drifts) == 2
    state = system.at(x)
    generators = [state.generator(i) for i in range(2)]
    system.set_phase(None)
    matrix = state.jacobian(solver.axis)
    for g in generators:
        assert system.norm(g) > 0.1
        assert (matrix * g).norm() < 1e-9 * matrix.norm()


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


@pytest.mark.long
def test_first_equilibrium_far_from_the_start() -> None:
    """A coiled rod let go from straight: Newton's method alone does not get there, going downhill does."""
    coiled = classics.column(
        "coiled", (clamped(), free(lambda c: (0.0, 0.0, c.T))), (0.0, 20.0), load="T",
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k0, k[2] - 1.0), (1.0, 1.0, 0.7)),
        constants={"T": 0.0, "k0": 6.0}, ordinate=MIDDLE,
    )  # fmt: skip
    solver = Solver(coiled, Discretization("reduced", 8, 6)).equilibria
    x, outcome = first_equilibrium(solver, 0.0)
    assert outcome.converged
    assert solver.energy(x) == pytest.approx(0.0, abs=1e-12)  # without tension it takes its own shape, a helix
    x, outcome = first_equilibrium(solver, 20.0)
    assert outcome.converged
    assert solver.energy(x) > 5


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


@pytest.mark.ranks
@pytest.mark.few(1)
@pytest.mark.parametrize(("second", "number"), [(1.2, 0), (1.01, 0), (1.0, 1)])
@pytest.mark.parametrize("twisting", [pytest.param(1.0, marks=pytest.mark.alone), 1e7])
def test_bending_alike_is_told_beside_a_stiff_twist(second: float, number: int, twisting: float) -> None:
    """Beside 1e7 a difference of 0.2 was round-off: a bending mode, and the flutter load, were lost to a symmetry."""
    rod = Scene(
        "stiff", (0.0, 1.0), "unshearable and inextensible",
        lambda v, k, c: bending_and_twist(k, (1.0, second, twisting)), {"M": Parameter(0.0)}, "M",
        (clamped(), free(follower_moment=lambda c: (0.0, 0.0, c.M))), MIDDLE, (0.0, 1.0),
        inertia=Inertia(lambda c: 1.0),
    )  # fmt: skip
    assert len(System(rod, Discretization("pointwise", 4, 6)).symmetries) == number

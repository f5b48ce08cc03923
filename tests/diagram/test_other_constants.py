"""Scenes that differ in constants alone share their equations, and have the diagrams of scenes of their own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from classics import SUPPORTS, column
from demo_cases import module

import rodfem
from rodfem import Diagram, Discretization, Inertia, Plan, Scene, Solver, clamped, free

MESH = Discretization("auto", 4, 4)
Statement = Callable[..., Scene]


def hemitropic(A: float = -3.0) -> Scene:
    return replace(module("hemitropic").hemitropic_rod(A), span=(0.0, 0.5))


def moved(e: float = 0.1) -> Scene:
    """A cantilever with a force across it, at a place that depends on a constant, in units far from one."""
    ends = clamped(lambda c: (0.0, c.e, -c.e)), free(lambda c: (0.1 * c.e * c.P, 0.0, -c.P))
    stiff = {"B1": 1e7, "B2": 2e7, "C": 1e7, "e": e}
    return column("moved", ends, (0.0, 1.2e8), constants=stiff)


def alike(B2: float = 2.0) -> Scene:
    """A column, which with B2 = B1 bends alike in all directions: that is a symmetry more."""
    return column("alike", SUPPORTS["clamped-free"], (0.0, 30.0), constants={"B2": B2})


def pushed(rho: float = 1.0) -> Scene:
    """Beck's column of any mass: frequencies."""
    ends = clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))
    return column("pushed", ends, (0.0, 25.0), inertia=Inertia(lambda c: c.rho), constants={"rho": rho})


CASES: dict[str, tuple[Statement, dict[str, float], Plan]] = {
    "hemitropic": (hemitropic, {"A": -1.5}, Plan(at=(0.2,), depth=1)),
    "function at an end": (moved, {"e": 0.3}, Plan(depth=1)),
    "a symmetry more": (alike, {"B2": 1.0}, Plan(depth=1)),
    "frequencies": (pushed, {"rho": 2.0}, Plan()),
}


def same(a: Diagram, b: Diagram) -> None:
    """Two diagrams are the same, to the last bit."""
    assert [branch.name for branch in a] == [branch.name for branch in b]
    for one, other in zip(a, b, strict=True):
        for x, y in zip(one.points, other.points, strict=True):
            np.testing.assert_array_equal(x.x.array_r, y.x.array_r)
            assert (x.load, x.ordinate, x.energy, x.negative) == (y.load, y.ordinate, y.energy, y.negative)
        for s, t in zip(one.special, other.special, strict=True):
            assert repr(s) == repr(t)
            np.testing.assert_array_equal((s.point.load, s.error_estimate), (t.point.load, t.error_estimate))
    assert a.warnings == b.warnings


@pytest.mark.parametrize("case", CASES)
def test_diagram_of_a_scene_of_its_own(case: str) -> None:
    """Also of the first scene, after the second one had its turn with the forms of both."""
    state, constants, plan = CASES[case]
    first = rodfem.trace(state(), MESH, plan)
    second = first.again(**constants)
    assert second.solvers[0].system.equations.jacobian is first.solvers[0].system.equations.jacobian
    same(second, rodfem.trace(state(**constants), MESH, plan))
    same(first, first.again())


def test_a_constant_that_asks_for_other_unknowns() -> None:
    """A rod with a mass has a centreline: nothing of the massless one is taken over."""
    rod = column("light", SUPPORTS["clamped-free"], (0.0, 4.0), inertia=Inertia(lambda c: c.k))
    light = Solver(rod, Discretization(elements=4, degree=4))
    heavy = light.rebind(k=1.0)
    fields = [solver.equilibria.system.fields for solver in (light, heavy, heavy.rebind(k=0.0))]
    assert [f.formulation.name for f in fields] == ["reduced", "pointwise", "reduced"]
    assert ["r" in f.dofs for f in fields] == [False, True, False]

"""Constraints that depend on one another at a state that is not known to all digits."""

from typing import Any

import numpy as np
import pytest
from classics import column

from rodfem import Discretization, Ordinate, Plan, Scene, Solver, StepControl, clamped, pinned, trace
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.errors import SceneError
from rodfem.forms.energy import bending_and_twist
from rodfem.stability.dependence import require_independent_constraints

pytestmark = pytest.mark.ranks

MIDDLE = Ordinate("middle", s=0.5, of=lambda r, q: float(np.hypot(r[0], r[1])))
PLAN = Plan(depth=0, steps=StepControl(most=3), error_bars=False)


def meshes(first: tuple[int, int], *others: tuple[int, int]) -> list[Any]:
    """Numbers of elements and degrees, of which two ranks have the first one alone."""
    return [first, *(pytest.param(mesh, marks=pytest.mark.alone) for mesh in others)]


def shortened(far: Any = clamped, near: Any = clamped, rod: str = "unshearable and inextensible", **more: Any) -> Scene:
    """A straight column whose far end comes nearer by P."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        bent = bending_and_twist(k, (1.0, 1.2, 1.0))
        return bent + 30 * (v[0] ** 2 + v[1] ** 2) if rod == "inextensible" else bent

    ends = near(), far(lambda c: (0.0, 0.0, 1 - c.P))
    return column("shortened", ends, rod=rod, energy=energy, ordinate=MIDDLE, **{"span": (0.0, 0.3)} | more)


def solver_of(scene: Scene, formulation: str, mesh: tuple[int, int], factors: str = "chain") -> BranchSolver:
    """Solver on a mesh of so many elements of that degree."""
    return Solver(scene, Discretization(formulation, *mesh, factors=factors)).equilibria


@pytest.mark.few(1)
@pytest.mark.parametrize("factors", ["chain", "petsc"])
@pytest.mark.parametrize("formulation", ["pointwise", "reduced"])
@pytest.mark.parametrize("mesh", meshes((4, 3), (3, 3), (2, 2), (7, 5), (24, 1), (30, 4)))
def test_a_taut_rod_is_refused_on_any_mesh(formulation: str, mesh: tuple[int, int], factors: str) -> None:
    """Any tension balances it: by round-off Newton's method found one of its buckling thrusts, or nothing."""
    for scene in (shortened(), shortened(pinned, pinned, planar="e2")):
        with pytest.raises(SceneError, match=r"depend on one another .*is taut.*begin where it is slack.*\.$"):
            trace(scene, Discretization(formulation, *mesh, factors=factors), PLAN)


@pytest.mark.long
@pytest.mark.parametrize("planar", [pytest.param("e2", marks=pytest.mark.alone), None])
def test_a_range_that_ends_where_the_rod_is_taut(planar: str | None) -> None:
    """Its ends are as far apart as it is long at P = 0: nothing is missing there, and that is what is said."""
    scene = shortened(planar=planar, span=(0.3, 0.0))
    diagram = trace(scene, Discretization("auto", 8, 6), Plan(depth=0, error_bars=False))
    (warning,) = diagram.warnings
    assert warning.startswith("The range ends at P = 0, where the rod is taut: it cannot stretch")
    assert not diagram.special("fold") and not diagram.special("branch point")


@pytest.mark.few(1)
@pytest.mark.parametrize("formulation", ["pointwise", "reduced"])
@pytest.mark.parametrize("mesh", meshes((4, 3), (7, 5), (40, 2)))
def test_a_slack_rod_is_none_of_them(formulation: str, mesh: tuple[int, int]) -> None:
    """Slack by 1e-8 of its length it is turned by 2e-4."""
    solver = solver_of(shortened(planar="e2"), formulation, mesh)
    x, _ = first_equilibrium(solver, 1e-3)
    for load in 10.0 ** np.arange(-4, -8.5, -1):
        x, outcome = solver.at_load(x, load)
        assert outcome.converged
        require_independent_constraints(solver.shape, x)


def test_a_state_given_is_looked_at_as_well() -> None:
    """At P = 0 each thrust of a buckled rod is that of a state."""
    solver = Solver(shortened(), Discretization("pointwise", 6, 4))
    point = solver.equilibrium(1e-3)
    for load in 10.0 ** np.arange(-4, -11, -1):
        point = solver.equilibrium(float(load), point)
    with pytest.raises(SceneError, match="is taut"):
        solver.equilibrium(0.0, point)

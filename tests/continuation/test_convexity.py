"""Branches, sweeps and loci end where the stored energy is not convex any more: beyond, an index means nothing."""

from collections.abc import Callable
from typing import Any

import pytest
import ufl
from classics import column

from rodfem import Discretization, Inertia, Plan, Scene, SceneError, Solver, StepControl, clamped, free, trace
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.functions import Constants

MESH = Discretization("auto", 4, 4)
Energy = Callable[[Any, Any, Any], Any]


def softening(v: Any, k: Any, c: Any) -> Any:
    """Bending stiffness 1 - P about d1: quadratic in the strains, and the same all along the rod."""
    return bending_and_twist(k, (1.0 - c.P, 2.0, 1.0))


def coupled(v: Any, k: Any, c: Any) -> Any:
    """Convex while P < 1."""
    return bending_and_twist(k, (1.0, 2.0, 1.0)) + c.P * k[0] * k[2]


def rod(energy: Energy, span: tuple[float, float] = (0.0, 2.0), **given: Any) -> Scene:
    """Cantilever without a load, but for the stiffness that depends on it."""
    return column("rod", given.pop("ends", (clamped(), free())), span, energy=energy, **given)


@pytest.mark.ranks
@pytest.mark.long
@pytest.mark.parametrize("energy", [coupled, pytest.param(softening, marks=pytest.mark.alone)])
def test_a_stiffness_that_the_load_takes_away(energy: Energy) -> None:
    """Past it 48 eigenvalues of a mesh of 48 nodes were negative, and that was called a branch point."""
    (branch,) = trace(rod(energy), MESH, Plan(depth=0, error_bars=False))
    assert branch.ended.startswith("the stored energy is not convex any more at P = ")
    assert not [s for s in branch.special if not s.kind.request]
    assert 0.8 < branch.points[-1].load < 1.0
    assert {p.negative for p in branch.points} == {0}
    with pytest.raises(SceneError, match=r"not convex somewhere along the state at P = 1\b"):
        Solver(rod(energy), MESH).equilibrium(1.0)


@pytest.mark.long
def test_a_search_where_it_is_lost() -> None:
    """Equilibria that a search finds there begin no branch."""
    diagram = trace(rod(softening), MESH, Plan(at=(1.5,), depth=0, tries=4, error_bars=False))
    assert [b.name for b in diagram] == ["straight"]
    assert any("near P = 1.5: not followed, the stored energy is not convex there" in note for note in diagram.notes)


@pytest.mark.ranks
def test_a_state_that_comes_to_a_dent_of_the_energy(width: float = 0.1) -> None:
    """A rod under tension, whose stretch jumps: ``W'' = 10 - 11/(1 + x^2)^(3/2)`` with ``x = (v - 1.3)/width``."""

    def dented(v: Any, k: Any, c: Any) -> Any:
        e = v[2] - 1
        return bending_and_twist(k, (1.0, 2.0, 1.0)) + 5 * e**2 - 11 * width * ufl.sqrt((e - 0.3) ** 2 + width**2)

    ends, plan = (clamped(), free(force=lambda c: (0.0, 0.0, c.P))), Plan(depth=0, error_bars=False)
    (branch,) = trace(rod(dented, (0.0, 10.0), ends=ends, rod="unshearable"), MESH, plan)
    assert branch.ended.startswith("the stored energy is not convex any more at P = ")
    v = 1.3 - width * (1.1 ** (2 / 3) - 1) ** 0.5
    e = v - 1
    assert branch.points[-1].load < 10 * e - 11 * width * (e - 0.3) / ((e - 0.3) ** 2 + width**2) ** 0.5 + 1e-6


def test_a_sweep(until: float = 30.0) -> None:
    """Of ten times the follower force there would be sixty critical loads where the stiffness nears zero."""
    scene = rod(
        lambda v, k, c: softening(v, k, Constants(P=c.P / until)),
        (0.0, 60.0),
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -1e-3 * c.P))),
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
    )
    (branch,) = trace(scene, MESH, Plan(error_bars=False))
    assert branch.ended == f"the stored energy is not convex any more at P = {until:g}"
    assert until - 0.61 < branch.points[-1].load < until


@pytest.mark.ranks
@pytest.mark.long
def test_convexity_lost_in_the_step_to_zero_stretch(loss: float = 3.99) -> None:
    """A thrust squeezes a rod of ``EA = 4`` to nothing at 4; before that its twisting stiffness vanishes."""
    scene = rod(
        lambda v, k, c: bending_and_twist(k, (9.0, 9.0, 1.0 - c.P / c.loss)) + 2.0 * (v[2] - 1) ** 2,
        (0.0, 5.0),
        ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
        rod="unshearable",
        constants={"loss": loss},
    )
    steps = StepControl(first=0.25, largest=0.25)
    (branch,) = trace(scene, MESH, Plan(depth=0, error_bars=False, steps=steps))
    reason, _, where = branch.ended.rpartition(" = ")
    assert reason == "the stored energy is not convex any more at P"
    assert branch.points[-1].load < loss < float(where) <= 4.0

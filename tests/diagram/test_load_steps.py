"""Sweeps that stay on one path of equilibria: up to a fold, past an imperfect bifurcation, up to a jump of a load."""

from __future__ import annotations

from dataclasses import replace

import pytest
import ufl
from hard.paths import MESH, bends, floats, imperfect, snapping
from hard.two_freedoms import scene as two_freedoms

from rodfem import Attachment, Discretization, Inertia, Parameter, Plan, Scene, trace

pytestmark = pytest.mark.alone


@pytest.mark.long
@pytest.mark.parametrize("down", [False, True])
@pytest.mark.parametrize(("load", "share"), [(3.0, 0.02), pytest.param(4.0, 0.1, marks=pytest.mark.long), (5.0, 0.2)])
def test_a_path_ends_at_its_fold(load: float, share: float, down: bool) -> None:
    """Beyond it there is one equilibrium, stable, and Newton's method finds it: the rod was said to be stable."""
    assert snapping(load, share, down).right


@pytest.mark.few(1)
@pytest.mark.parametrize("most", [5.0, 8.0])
@pytest.mark.parametrize("lateral", [1e-3, *(pytest.param(x, marks=pytest.mark.long) for x in (1e-4, 1e-5)), 1e-7])
def test_an_imperfect_column_bends_and_does_not_diverge(lateral: float, most: float) -> None:
    found = bends(lateral, most)
    assert found.right and not found.said


@pytest.mark.long
def test_a_path_ends_at_a_jump() -> None:
    """There the lateral load has two values."""
    jumping = imperfect(lambda c: ufl.conditional(ufl.lt(c.P, 1.003), 0.1, 0.3), 2.5)
    diagram = trace(jumping, MESH, Plan(depth=0, error_bars=False))
    assert diagram[0].points[-1].load < 1.003 and "could not be followed" in diagram[0].ended


@pytest.mark.long
@pytest.mark.parametrize("apart", [0.1, pytest.param(1e-2, marks=pytest.mark.long), 1e-3, 1e-5])
def test_a_fold_pair_in_one_step(apart: float) -> None:
    """``u^3 - a u = P`` with folds at P = +-apart/2, beside a force that follows and does no work."""
    a = 3 * (apart / 4) ** (2 / 3)
    scene = following(two_freedoms(lambda u, f2, c: 0.25 * u**4 - 0.5 * c.a * u**2 - c.P * u + 0.5 * f2, (-1, 1), a=a))
    diagram = trace(scene, Discretization("auto", 4, 3), Plan(depth=0, error_bars=False))
    assert diagram.warnings and diagram[0].points[-1].load <= apart / 2


@pytest.mark.long
@pytest.mark.parametrize("given", [pytest.param((1e-1, 6), marks=pytest.mark.long), (1e-3, 8)])
def test_a_ring_under_loads_that_follow(given: tuple[float, int]) -> None:
    """As under a pressure that has a potential: no end holds its rotation, and Newton's method went round at random."""
    found = floats(given)
    assert found.right and not found.said


def following(scene: Scene) -> Scene:
    """The same with a force of 1e-9 that follows the middle, along the rod."""
    return replace(
        scene,
        inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (1.0, 1.0, 1.0)),
        attachments=(Attachment(0.5, follower=lambda c: (0.0, 0.0, c.small)),),
        parameters=scene.parameters | {"small": Parameter(1e-9)},
    )


@pytest.mark.long
def test_no_divergence_load_is_said() -> None:
    """Where eigenvalues touch zero a secant method found none, and its exception left the program."""
    scene = following(two_freedoms(lambda u, f2, c: u**3 / 3 - 0.5 * c.P * u**2 + 0.5 * f2, (-0.3, 0.4)))
    diagram = trace(scene, Discretization("auto", 4, 3), Plan())
    assert any("No divergence load was found" in said for said in diagram.warnings)

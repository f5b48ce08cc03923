"""Sweeps that stay on one path of equilibria, up to a jump of a load or two folds: `tests/hard/paths.py` has more."""

from __future__ import annotations

from dataclasses import replace

import pytest
import ufl
from hard.paths import MESH, imperfect
from hard.two_freedoms import scene as two_freedoms

from rodfem import Attachment, Discretization, Inertia, Parameter, Plan, Scene, trace

pytestmark = pytest.mark.alone


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
    assert any("could not be located" in said for said in diagram.warnings)

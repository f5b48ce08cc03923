"""Equilibria of a sweep on one path, and at a load that one iteration does not reach."""

from dataclasses import replace
from itertools import pairwise

import classics
import numpy as np
import pytest
import ufl
from hard.paths import MESH, imperfect
from hard.two_freedoms import scene as two_freedoms

from rodfem import Attachment, ConvergenceError, Discretization, Inertia, Parameter, Plan, Scene, Solver, trace
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.diagram.equilibria import at_load


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


def test_a_load_that_takes_several_steps() -> None:
    """A cantilever with a lateral force of up to 50 at its tip."""
    solver = Solver(classics.lateral(), Discretization("reduced", 6, 6)).equilibria
    first, _ = first_equilibrium(solver, 0.0)
    x = first
    for _, load in pairwise(np.linspace(0.0, 50.0, 101).tolist()):
        x, outcome = solver.at_load(x, load)
        assert outcome.converged
    assert not solver.at_load(first, 50.0)[1].converged
    assert solver.system.distance(at_load(solver, first, 50.0), x) < 1e-8
    with pytest.raises(ConvergenceError, match=r"No equilibrium at P = 1e\+06: use a smaller range"):
        at_load(solver, first, 1e6)

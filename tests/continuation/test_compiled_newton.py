"""The compiled iteration and factors along the rod beside PETSc's matrices and MUMPS."""

import numpy as np
import pytest
from golden_cases import cases, single_branches

from rodfem import Discretization, Plan, Solver, trace
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.fem.fields import PETSC
from rodfem.fem.newton import OnPlane

SAME = 1e-9
"""Difference of loads and ordinates, relative to numbers greater than one, of two ways to the same state."""
LOOSE = 1e-6
"""The same where a row is nearly singular: what Newton's tolerance leaves there is larger."""


@pytest.mark.parametrize("name", single_branches())
def test_every_row_of_every_scene(name: str) -> None:
    """The first branch: the same steps, loads, ordinates, energies, indices and determinants."""
    scene = cases()[name]()
    mesh = Discretization("auto", 8 if scene.start is None else 16, 6)
    plans = Plan(depth=0, error_bars=False)
    ours, theirs = (
        trace(scene, Discretization(mesh.formulation, mesh.elements, mesh.degree, factors=factors), plans)
        for factors in ("chain", PETSC)
    )
    for branch, other in zip(ours.branches, theirs.branches, strict=True):
        assert [p.negative for p in branch.points] == [p.negative for p in other.points]
        assert [s.kind for s in branch.special] == [s.kind for s in other.special]
        for key in ("load", "ordinate", "energy"):
            a, b = (np.array([getattr(p, key) for p in x.points]) for x in (branch, other))
            off = abs(a - b) / np.maximum(1.0, abs(b))
            assert off.max() < LOOSE, (branch.name, key, int(off.argmax()))
            assert np.median(off) < SAME, (branch.name, key)


@pytest.mark.few(1)
@pytest.mark.parametrize("fresh", [True, False])
@pytest.mark.parametrize("name", ["demo ruler", "demo hemitropic", "classic foundation"])
def test_an_iteration_is_that_of_petsc(name: str, fresh: bool) -> None:
    """The same correction, distance and size from a guess, by new factors and by those of another state."""
    solver = Solver(cases()[name](), Discretization("auto", 4, 6)).equilibria
    system, scene = solver.system, solver.system.scene
    low, high = scene.span
    x = first_equilibrium(solver, low + 0.1 * (high - low))[0]
    guess = solver.start(low + 0.12 * (high - low), 0.1)
    moved, made = [], []
    for compiled in (system.compiled, None):
        other, y = x.copy(), guess.copy()
        system.set_phase(guess)
        OnPlane(system, other, solver.axis)(True)
        iteration = OnPlane(system, y, solver.axis)
        iteration.compiled = compiled
        made.append(iteration(fresh))
        moved.append(y)
    assert made[0] == pytest.approx(made[1], rel=1e-9)
    assert system.distance(*moved) < 1e-9 * made[0].distance

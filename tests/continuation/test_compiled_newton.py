"""The compiled iteration and factors along the rod beside PETSc's matrices, Python's iteration and MUMPS."""

from __future__ import annotations

import numpy as np
import pytest
from golden_cases import cases, single_branches

import rodfem.fem.system
from rodfem import Discretization, Plan, trace
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.solver import Solver
from rodfem.errors import InputError
from rodfem.fem.compiled_newton import CompiledNewton
from rodfem.fem.fields import PETSC
from rodfem.linalg.chain import Chain

pytestmark = pytest.mark.alone
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
@pytest.mark.parametrize(("load", "nearby"), [(3.601, True), (8.0, False)])
def test_factors_of_a_state_nearby_serve_first(load: float, nearby: bool) -> None:
    """The same equilibrium as by new factors; where the state is not nearby after all there are new ones at once."""
    solver = StaticSolver(Solver(cases()["demo ruler"](), Discretization("auto", 4, 6)).equilibria.system)
    compiled = solver.system.compiled
    assert compiled is not None
    x, _ = solver.first(3.6)
    expected, by_new = solver.at_load(x, load)
    made = compiled.newton.factorisations
    solver.at_load(x, 3.6)
    found, outcome = solver.at_load(x, load, nearby=True)
    assert by_new.converged and outcome.converged
    assert solver.system.norm(found - expected) < 1e-9
    assert (compiled.newton.factorisations < made) == nearby


@pytest.mark.long
def test_the_reference_uses_nothing_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """With PETSc's factors neither the chain nor the compiled assembly of matrices is used."""

    def never(*arguments: object) -> None:
        raise AssertionError("compiled code")

    monkeypatch.setattr(Chain, "__call__", never)
    monkeypatch.setattr(rodfem.fem.system, "matrix_places", never)
    monkeypatch.setattr(CompiledNewton, "__init__", never)
    diagram = trace(cases()["demo ruler"](), Discretization("auto", 8, 6, factors=PETSC), Plan(depth=0))
    assert len(diagram.branches[0].points) > 10


def test_unknown_factors_are_refused() -> None:
    with pytest.raises(InputError, match="chain or petsc"):
        Discretization(factors="superglue")


@pytest.mark.long
def test_a_guess_without_equations_drops_no_symmetry() -> None:
    """Where nothing was factored the matrix holds another state, and verifies nothing."""
    solver = Solver(cases()["demo hemitropic"](), Discretization("auto", 8, 6)).equilibria
    system = solver.system
    x, _ = solver.first(0.05)
    assert solver.corrector.correct(x, solver.axis) is not None
    held = solver.inertia.at(solver.start(0.3, 0.4))
    held.below(-5.0)
    guess = x.copy()
    guess.setValue(0, float("nan"))
    guess.assemble()
    outcome = solver.corrector.correct(guess, solver.axis)
    assert outcome is not None
    assert not outcome.converged
    assert not system.verification.dropped
    held.nearest(1)  # the factors are still those of that state

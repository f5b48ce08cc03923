"""None of the first frequencies is missing where round-off is large, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hard.fuzz import wider
from hard.fuzz.comparison import meshes
from hard.fuzz.oracle import Oracle

from rodfem import Discretization, Plan, Solver, trace
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.spectrum import SHIFT

pytestmark = pytest.mark.alone


def check(found: np.ndarray, dense: np.ndarray) -> None:
    """Compare the first real frequencies (k,) that were found with all (n,) by dense matrices."""
    every = np.sort(dense.real)[: len(found)]
    assert abs(found - every).max() < 1e-6 * every[-1]


@pytest.mark.long
@pytest.mark.parametrize("number", [pytest.param(172, marks=pytest.mark.long), 175])
def test_a_sweep_ends_where_the_rod_is_taut(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tension of a taut rod is any, and so are its frequencies: 115.9 and -21.7 were recorded for one state.

    Nearly taut, the forces are the largest part of the vectors of some motions.
    """
    monkeypatch.setattr("rodfem.diagram.sweep.LOADS", 21)
    scene = wider.scene(15, number)[0]
    last = scene.span[0] / 5, scene.span[1]  # with a row every hundredth of the whole range
    diagram = trace(scene, Discretization("auto", 5, 6), Plan(last, error_bars=False))
    (branch,) = diagram
    assert branch.ended.startswith("no frequencies at P = 0: Constraints depend on one another")
    assert branch.ended in diagram.warnings
    oracle = Oracle(diagram.solvers[0].system)
    for point in branch.points[-3:]:
        check(np.array([value for value, _ in point.omega2]), oracle.squares(point.x))


@pytest.mark.long
def test_an_element_of_6e_7() -> None:
    """Its stiffness is so large that finite eigenvalues have the round-off of infinite ones."""
    scene = wider.scene(16, 174)[0]
    solver = Solver(scene, meshes(scene, 174)[0])
    x, system = solver.equilibrium(0.0).x, solver.equilibria.system
    found = NonsymmetricSolver(system).at(x).near(6, SHIFT).values
    check(np.sort(found.real)[:7], Oracle(system).squares(x))


@pytest.mark.long
def test_no_pair_is_cut_in_two() -> None:
    """The last of 14 eigenvalues at this load is one of a pair: 11 unstable ones were counted between 10 and 10."""
    scene = wider.scene(16, 146)[0]
    solver = Solver(scene, meshes(scene, 146)[0])
    pencils, x = NonsymmetricSolver(solver.equilibria.system), solver.equilibrium(1.75).x
    for number in range(4, 13):
        found = pencils.at(x).near(number, SHIFT).values
        assert number <= len(found) and (found.imag > 0).sum() == (found.imag < 0).sum() >= 2

"""Frequencies of a rod that is gathered on no rank: SLEPc on several, with the factors of all pieces."""

from __future__ import annotations

import numpy as np
import pytest
from demo_cases import scene
from mpi4py import MPI

import rodfem.linalg.factorization
from rodfem.diagram.solver import Solver
from rodfem.fem.fields import Discretization
from rodfem.stability.frequencies import Frequencies
from rodfem.stability.nonsymmetric import NonsymmetricSolver

pytestmark = [
    pytest.mark.short,
    pytest.mark.versions,
    pytest.mark.skipif(MPI.COMM_WORLD.size == 1, reason="compares several ranks with one"),
]


def frequencies(comm: MPI.Comm, target: complex) -> Frequencies:
    """Frequencies of the demo under its follower load, nearest to a target."""
    solver = Solver(scene("follower"), Discretization("pointwise", 40, 2), comm).equilibria
    x, outcome = solver.at_load(solver.start(25.0), 25.0)
    assert outcome.converged
    return NonsymmetricSolver(solver.system).at(x).near(4, target)


@pytest.mark.parametrize("target", [-1.0, 120.0 + 90.0j])
def test_frequencies_are_those_on_one_rank(target: complex, monkeypatch: pytest.MonkeyPatch) -> None:
    alone = frequencies(MPI.COMM_SELF, target)
    monkeypatch.setattr(rodfem.linalg.factorization, "LONG", 1)
    together = frequencies(MPI.COMM_WORLD, target)
    nearest = [min(together.values, key=lambda other: abs(other - value)) for value in alone.values[:4]]
    np.testing.assert_allclose(nearest, alone.values[:4], rtol=1e-8)
    assert together.errors.max() < 1e-12

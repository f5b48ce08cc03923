"""Equilibria of a sweep on one path, and at a load that one iteration does not reach."""

from itertools import pairwise

import classics
import numpy as np
import pytest

from rodfem import ConvergenceError, Discretization, Solver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.diagram.equilibria import at_load


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

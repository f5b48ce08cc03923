"""Test functions of pairs of crossings, against the dense eigenvalues of the pencil."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
import ufl
from classics import column
from scipy.linalg import eig

from rodfem import Discretization, Plan, clamped, free, trace
from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.determinants import LowModes, steep
from rodfem.forms.energy import bending_and_twist
from rodfem.linalg.matrices import local_rows

pytestmark = pytest.mark.alone
INFINITE = 1e9


def eigenvalues(solver: BranchSolver, row: Point) -> np.ndarray:
    """All finite eigenvalues of the constrained pencil at a row."""
    found = solver.inertia.at(row.x)
    values = eig(local_rows(found.matrix).toarray(), local_rows(solver.inertia.metric).toarray(), right=False)
    return np.asarray(values[np.isfinite(values) & (abs(values) < INFINITE)])


@pytest.mark.few(1)
@pytest.mark.parametrize("planar", [None, "e1"])
def test_the_determinant_of_low_modes_is_a_product_over_the_pencil(planar: str | None) -> None:
    """``prod mu / (mu + sigma)``: multipliers, phase conditions and the load's unknown leave no trace."""
    rod = column(
        "column",
        (clamped(), free(lambda c: (0.0, 0.0, -c.P * pi**2 / 4))),
        (0.3, 1.7),
        energy=lambda v, k, c: ufl.exp(4 * c.P) * bending_and_twist(k, (1.0, 9.0, 1.0)),
        planar=planar,
    )
    diagram = trace(rod, Discretization("reduced", 2, 3), Plan(depth=0, error_bars=False))
    solver, rows = diagram.solvers[0], diagram[0].points
    assert steep(rows)
    for sigma in (0.1, 30.0):
        logarithm = LowModes(solver, sigma)
        for row in (rows[0], rows[len(rows) // 2], rows[-1]):
            mu = eigenvalues(solver, row)
            assert logarithm(row) == pytest.approx(np.log(abs(mu / (mu + sigma))).sum(), abs=1e-5)

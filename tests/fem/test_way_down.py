"""The way down from a saddle: what a damped step does along itself."""

import numpy as np
import pytest
from classics import column
from petsc4py import PETSc

from rodfem import Discretization, Solver, clamped, free
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import displaced_saddle
from rodfem.fem.newton import linear_step, quadratic_form
from rodfem.stability.pencil import Blocks

pytestmark = pytest.mark.ranks


@pytest.fixture(scope="module")
def beside_a_saddle() -> tuple[BranchSolver, PETSc.Vec, float]:
    """A solver, a state beside a saddle, and the longest time step of the way down from there."""
    strut = column("strut", (clamped(), free(force=lambda c: (0.0, 0.0, -c.P))), (6.0, 9.0))
    solver = Solver(strut, Discretization("pointwise", 5, 6))
    e, load = solver.equilibria, solver.scene.span[0]
    saddle, _ = e.at_load(e.start(load), load)
    return e, *displaced_saddle(e, saddle, e.start(load))


@pytest.mark.parametrize("times", [1, 4, 8, 100])
def test_a_step_is_uphill_where_it_is_too_long(
    times: float, beside_a_saddle: tuple[BranchSolver, PETSc.Vec, float]
) -> None:
    """``dx.(K + M/tau) dx`` by the blocks of the state; past the growth of the unstable mode it is negative."""
    e, x, half = beside_a_saddle
    weighed = e.system.new_vector()
    step = linear_step(e.system, x, e.axis, 1.0 / (times * half))
    blocks = Blocks(e.system)
    K = blocks.assemble(x).K
    moved, own = e.system.whole(step.array_r)[blocks.rows], blocks.own(blocks.rows)[1]
    dual = np.ones(step.local_size, dtype=bool)
    dual[own] = False
    motion = step.copy()
    motion.array[dual] = 0.0
    e.system.metric.mult(motion, weighed)
    found = quadratic_form(e.system, x, step)
    assert found == pytest.approx(moved @ (K @ moved) + weighed.dot(motion) / (times * half), rel=1e-9)
    assert (found > 0) is (times < 2)  # of the unstable mode alone it is mu (1 - 2/times), mu < 0

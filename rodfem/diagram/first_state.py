"""The equilibrium that a computation begins with, whose constraints are independent."""

from __future__ import annotations

from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import NewtonResult
from rodfem.stability.dependence import may_depend, require_independent_constraints


def first_state(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """Equilibrium at ``load`` from the scene's start, and the iteration that led to it; see :func:`first_equilibrium`.

    Raises :class:`~rodfem.errors.SceneError` where constraints depend on one another: of those a matrix tells nothing,
    its factors are round-off.  Where nothing was found they are looked at in the start.
    """
    start = solver.start(load)
    try:
        x, outcome = first_equilibrium(solver, load)
    except ConvergenceError:
        require_independent_constraints(solver.shape, start)
        raise
    if not outcome.converged:
        require_independent_constraints(solver.shape, start)
    elif may_depend(solver.shape, x):
        require_independent_constraints(solver.shape, x, start)
    return x, outcome

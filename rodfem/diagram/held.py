"""Equilibria of a sweep: at a load, from one nearby, if nothing moves that nothing holds."""

from __future__ import annotations

from petsc4py import PETSc

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError, SceneError

PARTS = (1, 2, 4, 8)
"""Numbers of steps to a load that are tried, one after the other."""
DRIVEN = 1e-7
"""Drift, over the rod's lowest bending eigenvalue, above which loads drive a motion that nothing holds."""


def at_load(solver: BranchSolver, guess: PETSc.Vec, load: float) -> PETSc.Vec:
    """Equilibrium at a load from a ``guess`` nearby, in more and more steps; there may be none.

    That raises :class:`ConvergenceError`.  ``solver`` has the mesh.

    Raises :class:`SceneError` where a load drives a motion that nothing holds.
    """
    begin = solver.system.scalar(guess)
    for parts in PARTS:
        x, converged = guess, True
        for part in range(1, parts + 1):
            x, outcome = solver.at_load(x, load if part == parts else begin + (load - begin) * part / parts)
            if not (converged := outcome.converged):
                break
        if converged:
            require_held(solver, x)
            return x
    raise ConvergenceError(f"No equilibrium at {solver.system.scene.load} = {load:g}: use a smaller range.")


def require_held(solver: BranchSolver, x: PETSc.Vec) -> None:
    """Raise :class:`SceneError` where the loads of a state ``x`` drive a motion that nothing holds."""
    system = solver.system
    if system.drift(x) > DRIVEN * system.stiffness_scale:
        raise SceneError(
            f"There is no equilibrium at {system.scene.load} = {system.scalar(x):g}: nothing holds the rod against the "
            f"{' or the '.join(system.free_motions(x))}, and the loads drive it; hold that motion at one end, or "
            "balance the loads."
        )

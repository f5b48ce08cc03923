"""The equilibrium that a computation begins with: from the scene's start by Newton's method, or by going downhill."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import NewtonResult, linear_step, relax
from rodfem.stability.near_zero import decide
from rodfem.stability.symmetric import SymmetricSolver

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver
    from rodfem.fem.system import System

STILL = 1e-6
"""Damping of Newton's method at a singular first state, over the lowest bending eigenvalue."""
STRAYED = 0.3
"""Distance from the start, in the metric, up to which an equilibrium is the one that is meant."""


def first_equilibrium(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """First equilibrium at ``load``: the rod at rest if that is near one, else from the scene's start.

    From there by Newton's method without forces at first, else with those that balance the start best: an equilibrium
    next to the start is the first one, stable or not, and of a family of equilibria, too.  The way down is taken where
    Newton's method fails, or ends at an unstable equilibrium that is nowhere near the start.
    """
    system = solver.system
    if (rest := _at_rest(solver, load)) is not None:
        return rest
    guess = solver.start(load)
    x, outcome = solver.at_load(guess, load)
    if not _resembles(system, guess, x, outcome):
        other = solver.at_load(_balanced(solver, guess), load)
        if _resembles(system, guess, *other):
            x, outcome = other
    outcome, good = (outcome, True) if _resembles(system, guess, x, outcome) else examined(solver, x, outcome)
    if good and not _may_move(solver, x):
        return x, outcome
    with system.damped(STILL * system.stiffness_scale):
        other = solver.at_load(guess, load)  # the start may be one of a family, along which it need not move
    if _resembles(system, guess, *other):
        return other
    if not good and (down := downhill(solver, load))[1].converged:
        return down
    return x, outcome


def _at_rest(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult] | None:
    """The rod at rest, if its shape fits between the ends and is a stable equilibrium there."""
    natural = solver.natural(load)
    if natural is None:
        return None
    x, outcome = solver.at_load(natural, load, reach=1.0)
    return (x, outcome) if _resembles(solver.system, natural, x, outcome) and examined(solver, x, outcome)[1] else None


def _resembles(system: System, guess: PETSc.Vec, x: PETSc.Vec, outcome: NewtonResult) -> bool:
    """Whether an equilibrium is the one that a guess means: but for strains, as a straight rod may stretch far."""
    difference, f = x - guess, system.fields
    if "v" in f.dofs:
        begin, end = difference.getOwnershipRange()
        strains = f.number[f.dofs["v"]].ravel()
        difference.array[strains[(begin <= strains) & (strains < end)] - begin] = 0.0
    return outcome.converged and system.norm(difference) < STRAYED


def _balanced(solver: BranchSolver, x: PETSc.Vec) -> PETSc.Vec:
    """The state ``x`` with the multipliers of its constraints that balance it best, a least-squares estimate.

    One step of Newton's method with so much damping that nothing else moves.  Without the forces in it, rotations
    of a free rod under dead loads cost nothing: Newton's method leaves even an equilibrium, in any direction.
    """
    system = solver.system
    system.set_phase(x)
    step = linear_step(system, x, solver.axis, 1e6 * system.stiffness_scale)
    return x.copy() if step is None else x - step


def downhill(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """Equilibrium at ``load`` by going downhill from the scene's start, and from there bent a little.

    A stable state is preferred.  From a symmetrical start the way down may end on a saddle, and where it passes one
    slowly it depends on the mesh whether it stays there: from a saddle it goes on, along its most unstable mode.
    """
    saddle: tuple[PETSc.Vec, NewtonResult] | None = None
    for bent in (0.0, 0.4, 0.8):
        x, outcome = _relaxed(solver, solver.start(load, bent))
        outcome, stable = examined(solver, x, outcome)
        if stable:
            return x, outcome
        if saddle is None or (outcome.converged and not saddle[1].converged):
            saddle = x, outcome
    assert saddle is not None
    if not saddle[1].converged:
        return saddle
    displaced, longest = displaced_saddle(solver, saddle[0], solver.start(load))
    found = _relaxed(solver, displaced, longest, lambda x: examined(solver, x, saddle[1])[1])
    return found if found[1].converged else saddle


def examined(solver: BranchSolver, x: PETSc.Vec, outcome: NewtonResult) -> tuple[NewtonResult, bool]:
    """The iteration that led to ``x``, and whether that is stable, as far as there is an index.

    It has not converged where eigenvalues cannot be counted: a state so far away that it is round-off is none.
    """
    if not (outcome.converged and solver.conservative):
        return outcome, outcome.converged
    try:
        return outcome, decide(solver.inertia.at(x)).index.negative == 0
    except ConvergenceError:
        return replace(outcome, converged=False), False
    finally:
        solver.inertia.forget_band()  # it may be far from all others: its round-off is that of no other


def _relaxed(
    solver: BranchSolver, x: PETSc.Vec, longest: float = inf, accepts: Callable[[PETSc.Vec], bool] = lambda x: True
) -> tuple[PETSc.Vec, NewtonResult]:
    """Equilibrium downhill from the state ``x``, which moves there, at its load; see :func:`relax`."""
    load = solver.system.scalar(x)
    outcome = relax(solver.system, x, solver.axis, longest=longest, accepts=accepts)
    for _ in range(3):  # phase conditions taken far away may hold a state off the equilibrium
        if outcome.converged and solver.system.drift(x) > 1e-8 * solver.system.stiffness_scale:  # clearly not zero
            x, outcome = solver.at_load(x, load)
    return x, outcome


def _may_move(solver: BranchSolver, x: PETSc.Vec) -> bool:
    """Whether an equilibrium is one of a family: it has more zero eigenvalues than symmetries that it breaks."""
    if not solver.conservative:
        return False
    found = solver.inertia.at(x)
    return found.count().zero > found.drifts


def displaced_saddle(solver: BranchSolver, x: PETSc.Vec, start: PETSc.Vec) -> tuple[PETSc.Vec, float]:
    """State next to the saddle ``x``, along its most unstable mode on the side of ``start``, and half of its time."""
    modes = SymmetricSolver(solver.inertia).at(x).leftmost(1)
    displaced, mode = x.copy(), modes.vectors[0]
    size = 0.1 / solver.system.norm(mode)
    displaced.axpy(size if solver.row(mode).dot(start - x) >= 0 else -size, mode)
    solver.system.set_load(displaced, solver.system.scalar(x))
    return displaced, 0.5 / abs(float(modes.values[0]))

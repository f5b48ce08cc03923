r"""Directions in which branches leave a branch point with several null vectors, by the reduced equations.

With null vectors ``a_1 ... a_n`` the reduced equations of Lyapunov and Schmidt select a few lines, and a null vector of
the eigensolver is on one by chance only.  At a distance ``A`` in the direction ``d(t) = cos t a_1 + sin t a_2`` of two
of them the state ``x`` and the load of ::

    F(x) + g M d'(t) = 0,        <d(t), x - x_0> = A,        <d'(t), x - x_0> = 0

are those of the rod held in that direction by a force ``g(t)`` across it: branches leave where it is zero, stable or
not.  Its zeros are bracketed around the circle, and each is a state on a branch, seen from the branch point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.switching import CLOSE, FIRST
from rodfem.fem.newton import Correction, Limits, correct, linear_step, newton
from rodfem.linalg.orthogonal import combine
from rodfem.roots import zero_between

AROUND = 12
"""Directions that are tried at random for each of more than two null vectors but one."""
ALIGNED = 0.999
"""Cosine of the angle between directions above which they are those of one branch."""
CIRCLE = 48
"""Directions of half a circle in which the force is computed: on no axis of a symmetry."""
ANGLE = 1e-4
"""Uncertainty of the angle of a zero."""
FELT = 1e-6
"""Force on one side of a zero over the largest one, below which it is round-off: a symmetry turns the direction."""


def lines(solver: BranchSolver, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Unit directions in which branches do leave a branch point with several null vectors of different motions.

    Of two null vectors they are the zeros of the force that holds the rod in a direction.  Of more, Newton's method is
    started in random directions.  Each is taken once more as that in which what Newton's method finds is seen from the
    branch point.  Nearer to that any direction is an equilibrium to round-off.  ``solver`` has the mesh; ``ways`` are
    the null vectors, orthonormal, which are returned where nothing is found.  Of motions that a continuous symmetry
    turns, each in its own circle, only the relative phase that the ways have is tried.
    """
    n, found = len(ways), list[np.ndarray]()
    if n == 2:
        zeros = np.array(_zeros(lambda angle: _force(solver, special.point.x, ways, angle)))
        tried = np.stack([np.cos(zeros), np.sin(zeros)], axis=1)
    else:
        tried = np.concatenate([np.eye(n), np.random.default_rng(n).normal(size=(AROUND * (n - 1), n))])
    for weights in tried:
        seen = _seen(solver, special.point.x, ways, weights / np.linalg.norm(weights))
        seen = seen if seen is None else _seen(solver, special.point.x, ways, seen)
        if seen is not None and all(abs(seen @ known) < ALIGNED for known in found):
            found.append(seen)
    return [combine(list(ways), weights) for weights in found] or list(ways)


def _seen(solver: BranchSolver, origin: PETSc.Vec, ways: Sequence[PETSc.Vec], weights: np.ndarray) -> np.ndarray | None:
    """Weights (n,) of the direction in which an equilibrium is, that is found in that of others; None without one."""
    direction = combine(list(ways), weights)
    x = origin + direction * FIRST
    if not correct(solver.system, x, solver.row(direction), reach=CLOSE * FIRST).converged:
        return None
    away = solver.system.metric * (x - origin)
    seen = np.array([away.dot(way) for way in ways])
    return np.asarray(seen / np.linalg.norm(seen))


def _force(solver: BranchSolver, origin: PETSc.Vec, ways: Sequence[PETSc.Vec], angle: float) -> float:
    """Force that holds the rod at an ``angle`` from the first of two ``ways``; nan where there is no such state."""
    system = solver.system
    along, across = (combine(list(ways), np.array([np.cos(t), np.sin(t)])) for t in (angle, angle + np.pi / 2))
    row, held, answer = solver.row(along), system.metric * across, system.new_vector()
    begin, force = origin + along * FIRST, 0.0
    x = begin.copy()

    def iteration(fresh: bool) -> Correction | None:
        nonlocal force
        system.set_phase(x)
        step = linear_step(system, x, row)
        if step is None or not system.solve(held, answer):
            return None
        # (J  M d'; d'^t M  0) by its Schur complement, of one row
        force = held.dot(x - origin - step) / held.dot(answer)
        step.axpy(force, answer)
        x.axpy(-1.0, step)
        return Correction(system.distance(x, begin), system.norm(step))

    return force if newton(iteration, Limits(reach=CLOSE * FIRST)).converged else float("nan")


def _zeros(force: Callable[[float], float]) -> list[float]:
    """Angles in half a circle at which a force is zero."""
    angles = np.pi * (np.arange(CIRCLE + 1) + (np.sqrt(5) - 1) / 2) / CIRCLE
    values = np.array([force(angle) for angle in angles])
    felt = FELT * np.nanmax(abs(values), initial=0.0)
    return [
        zero_between(force, float(angles[i]), float(angles[i + 1]), ANGLE)
        for i in np.flatnonzero(values[1:] * values[:-1] < 0)
        if max(abs(values[i : i + 2])) > felt
    ]

r"""Directions in which branches leave a branch point with several null vectors, by the reduced equations.

With null vectors ``a_1 ... a_n`` the reduced equations of Lyapunov and Schmidt select a few lines, and a null vector of
the eigensolver is on one by chance only.  At a distance ``A`` in the direction ``d(t) = cos t a_1 + sin t a_2`` of two
of them the state ``x`` and the load of ::

    F(x) + g M d'(t) = 0,        <d(t), x - x_0> = A,        <d'(t), x - x_0> = 0

are those of the rod held in that direction by a force ``g(t)`` across it: branches leave where it is zero, stable or
not.  Its zeros are bracketed around the circle, and each is a state on a branch, seen from the branch point.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.fem.newton import Correction, Limits, correct, linear_step, newton
from rodfem.linalg.orthogonal import combine
from rodfem.roots import zero_between

AWAY, REACH = 0.05, 2.0
"""Distance at which branches are looked for, and how far from its prediction one may lie, in units of it."""
AROUND = 12
"""Directions that are tried in the plane of two null vectors; in a space of more of them as many for each but one."""
ALIGNED = 0.999
"""Cosine of the angle between directions above which they are those of one branch."""
CIRCLE = 48
"""Directions of half a circle in which the force is computed."""
ANGLE = 1e-4
"""Uncertainty of the angle of a zero."""
FELT = 1e-6
"""Force on one side of a zero over the largest one, below which it is round-off: a symmetry turns the direction."""


def lines(solver: BranchSolver, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Unit directions in which branches do leave a branch point with several null vectors of different motions.

    Of two null vectors they are the zeros of the force that holds the rod in a direction.  Of more, Newton's method is
    started in directions all around, and once more in that in which what it finds is seen from the branch point.
    Nearer to that any direction is an equilibrium to round-off.  ``solver`` has the mesh; ``ways`` are the null
    vectors, orthonormal, which are returned where nothing is found.  Of motions that a continuous symmetry turns, each
    in its own circle, only the relative phase that the ways have is tried.
    """
    system, n = solver.system, len(ways)
    if n == 2:
        angles = np.pi * np.arange(AROUND) / AROUND
        zeros = np.array(_zeros(Held(solver, special, ways)))
        tried = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        tried = np.concatenate([np.stack([np.cos(zeros), np.sin(zeros)], axis=1), tried])
    else:
        rng = np.random.default_rng(n)
        tried = np.concatenate([np.eye(n), rng.normal(size=(AROUND * (n - 1), n))])
    weighed = [system.metric * way for way in ways]
    found: list[np.ndarray] = []
    for weights in tried:
        seen = weights / np.linalg.norm(weights)
        for _ in range(2):
            direction = combine(list(ways), seen)
            x = special.point.x + direction * AWAY
            if not correct(system, x, solver.row(direction), reach=REACH * AWAY).converged:
                break
            away = x - special.point.x
            seen = np.array([away.dot(image) for image in weighed])
            seen /= np.linalg.norm(seen)
        else:
            if all(abs(seen @ known) < ALIGNED for known in found):
                found.append(seen)
    return [combine(list(ways), weights) for weights in found] or list(ways)


class Held:
    """The force that holds a rod in a direction in the plane of two null vectors ``ways`` of a ``special`` point."""

    def __init__(self, solver: BranchSolver, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> None:
        """Begin at the branch point; ``solver`` has the mesh."""
        self.solver, self.origin, self.ways = solver, special.point.x, list(ways)

    def __call__(self, angle: float) -> float:
        """Return the force at an ``angle`` from the first null vector; nan where Newton's method finds no state."""
        system, force = self.solver.system, 0.0
        along = combine(self.ways, np.array([np.cos(angle), np.sin(angle)]))
        across = combine(self.ways, np.array([-np.sin(angle), np.cos(angle)]))
        row, held, answer = self.solver.row(along), system.metric * across, system.new_vector()
        begin = self.origin + along * AWAY
        x = begin.copy()

        def iteration(fresh: bool) -> Correction | None:
            nonlocal force
            system.set_phase(x)
            step = linear_step(system, x, row)
            if step is None or not system.solve(held, answer):
                return None
            # (J  M d'; d'^t M  0) by its Schur complement, of one row
            force = held.dot(x - self.origin - step) / held.dot(answer)
            step.axpy(force, answer)
            x.axpy(-1.0, step)
            return Correction(system.distance(x, begin), system.norm(step))

        outcome = newton(iteration, Limits(reach=REACH * AWAY))
        return force if outcome.converged else float("nan")


def _zeros(force: Held) -> list[float]:
    """Angles in half a circle at which a force is zero."""
    angles = np.pi * (np.arange(CIRCLE + 1) + (np.sqrt(5) - 1) / 2) / CIRCLE  # on no axis of a symmetry
    values = np.array([force(angle) for angle in angles])
    felt = FELT * np.nanmax(abs(values), initial=0.0)
    zeros = []
    for i in np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0):
        if max(abs(values[i : i + 2])) > felt:
            zeros.append(zero_between(force, float(angles[i]), float(angles[i + 1]), ANGLE))
    return zeros

"""Newton's method: the one loop, and when it has converged or failed.

Whatever is solved for hands the loop an *iteration*: what moves the unknowns by one correction.  That of a state on a
plane is here, by LU factors of the bordered matrix; states held by forces, singular states and states away from known
ones have theirs (:mod:`rodfem.continuation.singular`, :mod:`rodfem.deflation.search`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.compiled_newton import BROKEN, MOVED
from rodfem.fem.system import System

TOLERANCE = 1e-10
"""Size of the last correction of a converged state: rotations in radian, load over its span, all else relative, in
natural sizes: reactions that vanish relative to the stiffness of the rod are round-off of that."""
STALLED = 1e-6
"""Below this a correction that no longer shrinks is round-off, not divergence; it is reported as the error."""
KEPT, SHRUNK = 0.02, 0.1
"""The Jacobian serves once more where a correction is below the former, and below the latter part of the one before."""
ITERATIONS, STEPS = 12, 8
"""Iterations, at most, and in a step along a branch: a shorter step is cheaper than more of them."""
FAR = 1e3
"""Distance, in the metric, beyond which no equilibrium is meant."""
LARGEST = 0.4
"""Bound of a damped step, in the metric."""
CLOSE = 1e-3
"""Step of a damped motion, in the metric, below which Newton's method takes over."""


class Correction(NamedTuple):
    """What an iteration has changed, by a ``size`` that is to vanish, and the ``distance`` from where it all began.

    It is by ``fresh`` factors, those of the state itself, or by older ones: a chord step.
    """

    distance: float
    size: float
    fresh: bool = True


Iteration = Callable[[bool], Correction | None]
"""Moves the unknowns by a correction, with fresh factors if that is asked for; None where there is no correction."""


@dataclass(frozen=True)
class Limits:
    """At most ``most`` iterations, over a distance of ``reach`` in the metric.

    A correction below ``small`` is small enough; one that no longer shrinks is round-off below ``still``, and where the
    unknowns are ``lost`` in the round-off of the equations.
    """

    most: int = ITERATIONS
    reach: float = FAR
    small: float = TOLERANCE
    still: float = STALLED
    lost: Callable[[], bool] = lambda: False


@dataclass(frozen=True)
class NewtonResult:
    """How a Newton iteration ended: whether ``converged``, after how many ``iterations``.

    ``error`` is what the observed rate of convergence leaves after the last correction (that one's size, if the factors
    were new), ``moved`` the distance of the solution from the guess.
    """

    converged: bool
    iterations: int
    error: float
    moved: float


def newton(iteration: Iteration, limits: Limits) -> NewtonResult:
    """Newton's method with chord steps.

    A Jacobian is factored first, and again only while corrections do not shrink tenfold from one to the next: near a
    solution the old factors cost one solve where new ones cost five.  It has converged if a correction is small enough.
    It has failed, and leaves the unknowns where they got to, after too many iterations, where there is no correction,
    or no number, and too far away.
    """
    previous, size, fresh, number = inf, inf, True, 0
    for number in range(1, limits.most + 1):
        made = iteration(fresh)
        if made is None:
            break
        distance, size, fresh = made
        if not (isfinite(size) and distance <= limits.reach):
            break
        # chord steps converge linearly: their rate, doubled for safety, says what the next correction would be
        left = size if fresh else min(2.0 * size / previous, 1.0) * size
        stalled = fresh and size > 0.5 * previous and (size < limits.still or limits.lost())
        if size < limits.small or stalled:
            return NewtonResult(True, number, left, distance)
        # far from a solution, or where the old factors gain less than a digit, new ones are worth their cost
        fresh = size > KEPT or size > SHRUNK * previous
        previous = size
    return NewtonResult(False, number, size, inf)


def correct(system: System, x: PETSc.Vec, row: PETSc.Vec, reach: float = FAR, most: int = ITERATIONS) -> NewtonResult:
    """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place, with LU factors.

    The phase conditions are those of the guess ``x``.  A singular matrix is a failure.

    With damping ``d`` a correction of size c along a family of equilibria is that by a force ``d c``, which no mesh
    makes exactly zero: one that no longer shrinks is accepted where that force is within the tolerance.

    Parameters
    ----------
    system
        The equations.
    row
        Last row of the bordered matrix, (n,).
    reach
        Largest distance, in the metric.
    most
        Iterations, at most.
    """
    system.set_phase(x)
    still = max(STALLED, TOLERANCE * system.stiffness_scale / system.damping) if system.damping else STALLED
    return newton(OnPlane(system, x, row), Limits(most, reach, still=still))


class OnPlane:
    """Iterations for the equations on the plane through ``x`` orthogonal to ``row``.

    On one rank each is one call of compiled code, without damping and where its factors serve.
    """

    def __init__(self, system: System, x: PETSc.Vec, row: PETSc.Vec) -> None:
        """Use the parameters and phase conditions that the ``system`` has now; ``x`` is moved."""
        self.system, self.x, self.row, self.origin = system, x, row, x.copy()
        self.compiled = None if system.damping else system.compiled
        if self.compiled is not None:
            self.compiled.take()
            self.compiled.origin[:] = x.array_r.real

    def __call__(self, fresh: bool) -> Correction | None:
        """Move the state by one correction."""
        system, x = self.system, self.x
        if self.compiled is not None and (fresh or not self.compiled.factors.resorted):
            status, distance, size = self.compiled.iterate(x, self.row, fresh)
            if status != BROKEN:
                return Correction(distance, size, fresh) if status == MOVED else None
        step = linear_step(system, x, self.row, fresh=fresh)
        if step is None:
            return None
        x.axpy(-1.0, step)
        size = max(system.norm(step), relative_size(system, x, step))
        return Correction(system.distance(x, self.origin), size, fresh)


def linear_step(
    system: System, x: PETSc.Vec, row: PETSc.Vec, damping: float = 0.0, *, fresh: bool = True
) -> PETSc.Vec | None:
    """What one step of Newton's method subtracts from ``x`` on the plane across ``row``, with the phase as it is.

    ``damping`` times the metric is added to the second variation; without ``fresh`` factors the last ones serve.  None
    where the equations have no value, or the matrix is singular.  ``system`` has the equations.
    """
    equations, step, state = system.new_vector(), system.new_vector(), system.at(x)
    state.residual(equations)
    if not isfinite(equations.norm()):  # outside of where the stored energy is defined
        return None
    if fresh:
        state.factor(row, damping)
    return step if system.solve(equations, step) else None


def relative_size(system: System, x: PETSc.Vec, step: PETSc.Vec) -> float:
    """Size of a ``step`` to or from the state ``x`` relative to that, in natural sizes of the ``system``."""
    return float(system.in_units(step, -1).norm() / (1.0 + system.in_units(x, -1).norm()))


def relax(
    system: System,
    x: PETSc.Vec,
    row: PETSc.Vec,
    most: int = 300,
    longest: float = inf,
    accepts: Callable[[PETSc.Vec], bool] = lambda x: True,
) -> NewtonResult:
    """Solve from a guess that is too far for Newton's method, in place, by pseudo-transient continuation.

    The overdamped motion ``M x' = -F(x)`` on the constraints is integrated by implicit Euler steps, ``(S + M/tau) dx =
    -F``, with ``M`` the metric: it goes downhill, to a state that is stable if one can be reached.  The time step grows
    while the steps are small, and Newton's method takes over near the end (Kelley & Keyes, SIAM J. Numer. Anal. 35
    (1998) 508-523).

    Implicit steps longer than ``1/|mu|`` go uphill along a mode of a negative eigenvalue ``mu``, to a saddle.  Steps at
    most as long as ``longest`` lead away from one, and the way goes on while ``accepts`` denies what Newton's method
    finds.  As ``mu`` grows on the way a step that is uphill, ``dx.(K + M/tau) dx < 0``, is made again, half as long.

    ``system`` has the equations, ``row`` (n,) is the last row of the bordered matrix, and at most ``most`` steps are
    taken.
    """
    system.set_phase(x)
    tau, trial = 1e-2 / system.stiffness_scale, x.copy()
    for iteration in range(most):
        step = linear_step(system, x, row, 1.0 / tau)
        size = inf if step is None else system.norm(step)
        if step is None or not isfinite(size):
            break
        if isfinite(longest) and along(system, x, step) < 0:
            tau *= 0.5
            continue
        x.axpy(-(1.0 if size < LARGEST else LARGEST / size), step)  # constraints are mended in one step, however long
        # switched evolution: longer time steps while the motion is slow, shorter where it is fast
        tau = min(tau * (2.0 if size < 0.2 else 0.5 if size > LARGEST else 1.0), longest)
        if (iteration % 5 == 4 and size < 0.1) or size < CLOSE:  # not earlier: it might jump to a state uphill
            x.copy(trial)
            outcome = correct(system, trial, row, reach=0.3)
            if outcome.converged and accepts(trial):
                trial.copy(x)
                return outcome
    return NewtonResult(False, most, inf, inf)


def along(system: System, x: PETSc.Vec, step: PETSc.Vec) -> float:
    """``dx.(K + M/tau) dx`` of a damped step (dx, dy) that solves ``(K + M/tau, C; C^t, 0) (dx, dy) = (F, c)``.

    It is ``dx.F - dy.c``, of the equations (F, c) of the ``system`` at ``x``.
    """
    equations = system.new_vector()
    system.at(x).residual(equations)
    fields, sign = system.fields, np.ones(step.local_size)
    dual = [fields.number[fields.dofs[b.name]].ravel() for b in fields.blocks if b.multiplier]
    moving = {x.name for x in fields.unknown_scalars if not x.multiplier}
    dual.append(np.array([n for name, n in system.scalars.items() if name not in moving], dtype=int))
    numbers, (first, last) = np.concatenate(dual), step.getOwnershipRange()
    sign[numbers[(first <= numbers) & (numbers < last)] - first] = -1.0
    return float(system.comm.allreduce(float(equations.array_r @ (sign * step.array_r))))

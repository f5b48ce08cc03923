"""Newton's method for the residual of the bordered system, with chord steps where they converge fast enough."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import inf, isfinite

import numpy as np
from petsc4py import PETSc

from rodfem.fem.compiled_newton import BROKEN, CONVERGED, Ended, Limits
from rodfem.fem.state import State
from rodfem.fem.system import System

TOLERANCE = 1e-10
"""Size of the last correction of a converged state: rotations in radian, load over its span, all else relative, in
natural sizes: reactions that vanish beside the stiffness of the rod are round-off of that."""
STALLED = 1e-6
"""Below this a correction that no longer shrinks is round-off, not divergence; it is reported as the error."""
KEPT, SHRUNK = 0.02, 0.1
"""The Jacobian serves once more where a correction is below the former, and below the latter part of the one before."""
LARGEST = 0.4
"""Bound of a damped step, in the metric."""
CLOSE = 1e-3
"""Step of a damped motion, in the metric, below which Newton's method takes over."""


@dataclass(frozen=True)
class NewtonResult:
    """How a Newton iteration ended: whether ``converged``, after how many ``iterations``.

    ``error`` is what the observed rate of convergence leaves after the last correction (that one's size, if the factors
    were new), ``moved`` the size of all corrections together.
    """

    converged: bool
    iterations: int
    error: float
    moved: float


def correct(
    system: System,
    x: PETSc.Vec,
    row: PETSc.Vec,
    most: int = 12,
    reach: float = 1e3,
    *,
    nearby: bool = False,
) -> NewtonResult:
    """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place, with LU factors.

    As :func:`iterate`, with the phase conditions of the guess ``x``; fails at a singular matrix, too.  ``system`` has
    the equations, ``row`` (n,) is the last row of the bordered matrix; ``most`` and ``reach`` are those of
    :func:`iterate`.  Where the last call ended ``nearby``, with the same ``row``, its factors serve first.
    """
    system.set_phase(x)
    if system.compiled is not None and not system.damping:
        with system.clock("solve"):
            held = nearby and system.lu.regular and not system.compiled.factors.resorted
            ended = system.compiled.correct(x, row, replace(limits(system, most, reach), held=held))
        if ended.status != BROKEN:
            return result(ended)
    step = system.new_vector()

    def solve(state: State, equations: PETSc.Vec, fresh: bool) -> PETSc.Vec | None:
        if fresh:
            state.factor(row)
        return step if system.solve(equations, step) else None

    return iterate(system, x, solve, most, reach)


def limits(system: System, most: int, reach: float, tolerance: float = 0.0) -> Limits:
    """Constants of the iteration for compiled code.

    ``most``, ``reach`` and ``tolerance`` are those of :func:`iterate`; with damping the ``system`` may stand still
    earlier.
    """
    still = max(STALLED, TOLERANCE * system.stiffness_scale / system.damping) if system.damping else STALLED
    return Limits(most, False, reach, tolerance, still, TOLERANCE, KEPT, SHRUNK)


def result(ended: Ended) -> NewtonResult:
    """The same of an iteration in compiled code."""
    return NewtonResult(ended.status == CONVERGED, ended.iterations, ended.error, ended.moved)


def iterate(
    system: System,
    x: PETSc.Vec,
    solve: Callable[[State, PETSc.Vec, bool], PETSc.Vec | None],
    most: int,
    reach: float,
    tolerance: float = 0.0,
) -> NewtonResult:
    """Newton's method with chord steps, in place; ``solve(state, equations, fresh)`` returns what x is reduced by.

    A Jacobian is factored first (``fresh``), and again only while corrections do not shrink tenfold from one to the
    next: near a solution the old factors cost one solve where new ones cost five.  Done when a correction, or what the
    observed rate of convergence leaves after it, is small enough.  Fails, leaving ``x`` where it got to, after ``most``
    iterations, where there is nothing to subtract (None), or when ``x`` moves further than ``reach`` in the metric.

    With damping ``d`` a correction of size c along a family of equilibria is that by a force ``d c``, which no mesh
    makes exactly zero: one that no longer shrinks is accepted where that force is within the tolerance.

    ``system`` has the equations; an error below ``tolerance``, of the size of a correction, is small enough.
    """
    equations, origin = system.new_vector(), x.copy()
    still = limits(system, most, reach).still
    previous, size, refactor = float("inf"), float("inf"), True
    iteration = 0
    for iteration in range(1, most + 1):
        state = system.at(x)
        state.residual(equations)
        if not isfinite(equations.norm()):  # outside of where the stored energy is defined
            break
        fresh = refactor
        step = solve(state, equations, fresh)
        if step is None:
            break
        x.axpy(-1.0, step)
        distance = system.norm(step)
        size = max(distance, system.in_units(step, -1).norm() / (1.0 + system.in_units(x, -1).norm()))
        if not isfinite(size) or distance > reach:
            break
        # chord steps converge linearly: their rate, doubled for safety, says what the next correction would be
        left = size if fresh else min(2.0 * size / previous, 1.0) * size
        if size < TOLERANCE or left < tolerance or (fresh and still > size > 0.5 * previous):
            origin.aypx(-1.0, x)
            return NewtonResult(True, iteration, left, system.norm(origin))
        # far from a solution, or where the old factors gain less than a digit, new ones are worth their cost
        refactor = size > KEPT or size > SHRUNK * previous
        previous = size
    origin.aypx(-1.0, x)
    return NewtonResult(False, iteration, size, float("inf"))


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
    equations, step = system.new_vector(), system.new_vector()
    tau, trial = 1e-2 / system.stiffness_scale, x.copy()
    for iteration in range(most):
        state = system.at(x)
        state.residual(equations)
        state.factor(row, damping=1.0 / tau)
        if not isfinite(equations.norm()) or not system.solve(equations, step):
            break
        size = system.norm(step)
        if not isfinite(size):
            break
        if isfinite(longest) and along(system, equations, step) < 0:
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
    return NewtonResult(False, most, float("inf"), float("inf"))


def along(system: System, equations: PETSc.Vec, step: PETSc.Vec) -> float:
    """``dx.(K + M/tau) dx`` of a damped step (dx, dy) that solves ``(K + M/tau, C; C^t, 0) (dx, dy) = (F, c)``.

    It is ``dx.F - dy.c``, of the ``equations`` (F, c) and the ``step`` of the ``system``.
    """
    fields, sign = system.fields, np.ones(step.local_size)
    dual = [fields.number[fields.dofs[b.name]].ravel() for b in fields.blocks if b.multiplier]
    moving = {x.name for x in fields.unknown_scalars if not x.multiplier}
    dual.append(np.array([n for name, n in system.scalars.items() if name not in moving], dtype=int))
    numbers, (first, last) = np.concatenate(dual), step.getOwnershipRange()
    sign[numbers[(first <= numbers) & (numbers < last)] - first] = -1.0
    return float(system.comm.allreduce(float(equations.array_r @ (sign * step.array_r))))

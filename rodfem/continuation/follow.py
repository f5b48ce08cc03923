"""Pseudo-arclength continuation: following a curve of equilibria with control of the step.

The predictor extrapolates the last points of the branch by a polynomial in arclength (up to cubic); the corrector
is Newton's method on the plane through the prediction orthogonal to the predicted direction (Keller 1977).  The
step is chosen such that the corrector moves a prediction by a set distance: small where the curve bends, large
where it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import copysign

from petsc4py import PETSc

from rodfem import compat
from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.prediction import ALIGNED, predict
from rodfem.continuation.step_control import StepControl
from rodfem.tolerances import SAME_LOAD

FAILURES = 2
"""Failures after each other from which a step follows the tangent of the last point alone."""
PILE = 64
"""Points of a branch after which the vectors that are not used any more are destroyed."""
ON_BOUND = 1e-8
"""Distance from a bound, in spans, below which a load counts as on it: branches of constant load may lie there."""
END_OF_RANGE = "end of range"
"""Why a branch ends at a bound of the range."""


def follow(
    solver: BranchSolver,
    points: list[Point],
    steps: StepControl,
    bounds: tuple[float, float],
    reach: Callable[[Point], float] = lambda point: float("inf"),
) -> Iterator[Point | str]:
    """Continue a branch from its last point, yielding accepted points; a string at the end says why it ended.

    ``bounds`` are the least and the greatest load; the branch ends exactly on them, and has a point exactly at each
    stop of the scene, where the tangent of the point becomes that of the other side.  The caller appends (and may
    insert) points in ``points``.  The direction is that of the last point's tangent.  ``reach`` bounds the step from a
    point.  ``solver`` has the mesh, ``steps`` chooses the lengths of steps.
    """
    system, step = solver.system, steps.begin()
    span = abs(system.scene.span[1] - system.scene.span[0])
    ends, stops = bounds, system.scene.stops
    solver.regular.restart()
    missed, failures = "", 0
    while len(points) < steps.most:
        last = points[-1]
        if len(points) % PILE == 0:
            compat.destroy_garbage(system.comm)
        below, above = ([s for s in stops if sign * (s - last.load) > SAME_LOAD * span] for sign in (-1, 1))
        bounds = max([ends[0], *below]), min([ends[1], *above])
        low, high = (bound + sign * ON_BOUND * span for bound, sign in zip(bounds, (-1, 1), strict=True))
        most = min(reach(last), steps.largest)
        step = min(step, most)
        # beyond a sharp bend the polynomial through the last points has another tangent than the branch
        known = since_stop(points, stops) if failures < FAILURES or last.tangent is None else [last]
        if system.damping and last.tangent is not None:  # across a family, along which the path is not determined
            known = [replace(last, tangent=solver.tangent(solver.row(last.tangent), at=last.x))]
        made = solver.step(known, last.arclength + step, (low, high), 0.5 * step)
        if not low <= made.load <= high or _on_bound(made.load, last, bounds, span):
            bound = min(bounds, key=lambda bound: abs(bound - made.load))
            if abs(last.load - bound) < SAME_LOAD * span and (made.load - last.load) * last.slope > 0:
                yield END_OF_RANGE  # the row is there, and the branch goes on out of the range
                return
            beside = 0.0 if bound in ends else copysign(ON_BOUND * span, made.load - last.load)
            point = _to_load(solver, known, made.load, bound, step, steps.smallest, beside)
            if point is not None:
                yield point
                if beside:
                    _turn(solver, point, beside)
                    step, missed, failures = steps.begin(), "", 0
                    continue
                yield END_OF_RANGE
                return
            missed = f"; no state is found at {bound:.6g}: let the range end elsewhere if that is a bifurcation"
        elif made.outcome is not None and made.tangent is not None and made.aligned > ALIGNED:
            place = last.arclength + made.length
            point = solver.point(made.x, place, made.tangent, made.outcome, made.index)
            if steps.accepts(last, point):
                yield point
                order = 2 if len(known) == 1 else min(len(known), 3) + 1
                step, missed, failures = steps.after(step, made.outcome.moved, order), "", 0
                continue
        step, failures = step / 2, failures + 1
        if step < min(steps.smallest, 0.01 * most):
            why = f"steps below {steps.smallest:g}"
            if last.zero > (drifts := system.active_drifts(last.x)):
                why += f"; {last.zero - drifts} eigenvalues vanish there to working accuracy"
            yield f"no convergence at {system.scene.load} = {last.load:.6g} ({why}{missed})"
            return
    yield f"{steps.most} points reached"


def since_stop(points: list[Point], stops: Sequence[float]) -> list[Point]:
    """The points of a branch since it was at one of the loads ``stops``, that one included."""
    if not stops:
        return points
    return points[max((i for i, point in enumerate(points) if point.load in stops), default=0) :]


def _moved(solver: BranchSolver, x: PETSc.Vec, by: float) -> PETSc.Vec:
    """The state ``x`` at a load that differs ``by`` so much."""
    out = x.copy()
    solver.system.set_load(out, solver.system.scalar(x) + by)
    return out


def _turn(solver: BranchSolver, point: Point, ahead: float) -> None:
    """Give a point at a stop the tangent, and the work of the load, of the side ``ahead``."""
    x = _moved(solver, point.x, ahead)
    point.tangent = solver.load_tangent(x, ahead > 0)
    point.slope, point.conjugate = solver.system.scalar(point.tangent), solver.energies(x).conjugate


def _on_bound(load: float, last: Point, bounds: tuple[float, float], span: float) -> bool:
    """Whether a step from ``last`` that changes the load ends on a bound of the range, but for round-off."""
    near = min(abs(bound - load) for bound in bounds)
    return near < ON_BOUND * span and abs(last.load - load) > 2 * ON_BOUND * span


def _to_load(
    solver: BranchSolver,
    points: list[Point],
    beyond: float,
    load: float,
    step: float,
    least: float,
    beside: float = 0.0,
) -> Point | None:
    """Last point of a branch, exactly at ``load``; None where it is not accepted as any other point of the branch is.

    ``beyond`` is the load that a whole step leads to.  The step to ``load`` is a part of it, of length ``least`` or
    more, and Newton's method may go half as far from the prediction.  Tangent and work of the load are those at a load
    ``beside`` it, on the side from which the branch comes.
    """
    last, system = points[-1], solver.system
    fraction = (load - last.load) / (beyond - last.load)
    length = max(fraction * step, least)
    x, direction = predict(points, last.arclength + fraction * step)
    row = solver.row(direction)
    x, outcome = solver.at_load(x, load, reach=0.5 * length)
    if not outcome.converged:
        return None
    before = _moved(solver, x, -beside) if beside else x
    tangent = solver.load_tangent(before, beyond > last.load)
    energies = solver.energies(x)._replace(conjugate=solver.energies(before).conjugate)
    if not row.dot(tangent) > ALIGNED:
        return None
    return solver.point(x, last.arclength + system.distance(last.x, x), tangent, outcome, energies=energies)

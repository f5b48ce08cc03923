"""Pseudo-arclength continuation: following a curve of equilibria with control of the step.

The predictor extrapolates the last points of the branch by a polynomial in arclength (up to cubic); the corrector
is Newton's method on the plane through the prediction orthogonal to the predicted direction (Keller 1977).  The
step is chosen such that the corrector moves a prediction by a set distance: small where the curve bends, large
where it does not.  A step that has ended on another branch is halved (:mod:`rodfem.continuation.row_checks`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import copysign

from petsc4py import PETSc

from rodfem import compat
from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import ALIGNED, ROWS, BranchSolver, Step, predict
from rodfem.continuation.row_checks import defect
from rodfem.continuation.step_control import StepControl
from rodfem.tolerances import SAME_LOAD

FAILURES = 2
"""Failures after each other from which a step follows the tangent of the last point alone."""
PILE = 64
"""Points of a branch after which the vectors that are not used any more are destroyed."""
ON_BOUND = 1e-8
"""Distance from a bound, in spans, below which a load counts as on it: branches of constant load may lie there."""
UNEXPLAINED = 0.25
"""Defect of a step, relative to the correction that is aimed at, from which on it has ended on another branch."""
END_OF_RANGE, MOST_REACHED = "end of range", "points reached"
"""Why a branch ends at a bound of the range, and with as many points as its steps may have."""


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
    solver.regular.restart()
    walk = _Walk(solver, points, steps, bounds)
    while len(points) < steps.most and not walk.ended:
        if len(points) % PILE == 0:
            compat.destroy_garbage(solver.system.comm)
        point = walk.attempt(reach(points[-1]))
        if point is not None:
            yield point
            walk.go_on(point)
    yield walk.ended or f"{steps.most} {MOST_REACHED}"


class _Walk:
    """The steps along one branch; ``ended`` says why it has ended, once it has."""

    def __init__(
        self, solver: BranchSolver, points: list[Point], steps: StepControl, bounds: tuple[float, float]
    ) -> None:
        """Begin with the first step."""
        scene = solver.system.scene
        self.solver, self.points, self.steps, self.ends = solver, points, steps, bounds
        self.stops, self.span = scene.stops, abs(scene.span[1] - scene.span[0])
        self.ended, self._missed, self._failures = "", "", 0
        self._step, self._next, self._offset = steps.begin(), 0.0, 0.0

    def attempt(self, reach: float) -> Point | None:
        """A point at most ``reach`` away from the last one; None where that was too far, or the branch has ended."""
        last, most = self.points[-1], min(reach, self.steps.largest)
        self._step = min(self._step, most)
        known, bounds = self._predicting(last), self._around(last.load)
        low, high = (bound + sign * ON_BOUND * self.span for bound, sign in zip(bounds, (-1, 1), strict=True))
        made = self.solver.step(known, last.arclength + self._step, (low, high), 0.5 * self._step)
        if not low <= made.load <= high or _on_bound(made.load, last, bounds, self.span):
            point = self._at_bound(known, made.load, min(bounds, key=lambda bound: abs(bound - made.load)))
        else:
            point = self._along(known, made)
        if point is None and not self.ended:
            self._halve(last, most)
        return point

    def go_on(self, point: Point) -> None:
        """Go on from an accepted point: from one at a stop with the tangent, and the work of the load, ahead."""
        if self._offset:
            x = _moved(self.solver, point.x, self._offset)
            point.tangent = self.solver.load_tangent(x, self._offset > 0)
            point.slope, point.conjugate = self.solver.system.scalar(point.tangent), self.solver.energies(x).conjugate
        self._step, self._missed, self._failures = self._next, "", 0

    def _around(self, load: float) -> tuple[float, float]:
        """The nearest stops or ends on either side of a load, but for one that it is at."""
        below, above = ([s for s in self.stops if sign * (s - load) > SAME_LOAD * self.span] for sign in (-1, 1))
        return max([self.ends[0], *below]), min([self.ends[1], *above])

    def _predicting(self, last: Point) -> list[Point]:
        """Rows that the next one is predicted from."""
        # beyond a sharp bend the polynomial through the last points has another tangent than the branch
        if self._failures >= FAILURES and last.tangent is not None:
            known = [last]
        else:
            known = since_stop(self.points, self.stops)
        if self.solver.system.damping and last.tangent is not None:
            # across a family, along which the path is not determined
            known = [replace(last, tangent=self.solver.tangent(self.solver.row(last.tangent), at=last.x))]
        return known

    def _along(self, known: list[Point], made: Step) -> Point | None:
        """The point of a step that was made, if it is one of the branch."""
        if made.outcome is None or made.tangent is None or made.aligned <= ALIGNED:
            return None
        place = known[-1].arclength + made.length
        point = self.solver.point(made.x, place, made.tangent, made.outcome, made.index)
        if not self._stays(known, point) or not self.steps.accepts(known[-1], point):
            return None
        order = 2 if len(known) == 1 else min(len(known), 3) + 1
        self._next, self._offset = self.steps.after(self._step, made.outcome.moved, order), 0.0
        return point

    def _stays(self, known: list[Point], point: Point) -> bool:
        """Whether a point is on the branch of the last rows; along a family its path is not determined."""
        system, rows = self.solver.system, [*known[1 - ROWS :], point]
        return bool(system.damping) or defect(system, rows) <= UNEXPLAINED * self.steps.aim

    def _at_bound(self, known: list[Point], beyond: float, bound: float) -> Point | None:
        """The point at a ``bound`` before a load ``beyond``; an end, or a stop, from which the branch goes on."""
        last = known[-1]
        if abs(last.load - bound) < SAME_LOAD * self.span and (beyond - last.load) * last.slope > 0:
            self.ended = END_OF_RANGE  # the row is there, and the branch goes on out of the range
            return None
        end = bound in self.ends
        self._next, self._offset = (
            self.steps.begin(),
            0.0 if end else copysign(ON_BOUND * self.span, beyond - last.load),
        )
        point = self._to_load(known, beyond, bound)
        if point is None or not self._stays(known, point):
            self._missed = f"; no state is found at {bound:.6g}: let the range end elsewhere if that is a bifurcation"
            return None
        self.ended = END_OF_RANGE if end else ""
        return point

    def _to_load(self, known: list[Point], beyond: float, load: float) -> Point | None:
        """Point exactly at ``load``; None where it is not accepted as any other point of the branch is.

        ``beyond`` is the load that a whole step leads to.  The step to ``load`` is a part of it, not the smallest
        one, and Newton's method may go half as far from the prediction.  Tangent and work of the load at a stop are
        those on the side from which the branch comes.
        """
        last, solver, system = known[-1], self.solver, self.solver.system
        fraction = (load - last.load) / (beyond - last.load)
        x, direction = predict(known, last.arclength + fraction * self._step)
        x, outcome = solver.at_load(x, load, reach=0.5 * max(fraction * self._step, self.steps.smallest))
        if not outcome.converged:
            return None
        before = _moved(solver, x, -self._offset) if self._offset else x
        tangent = solver.load_tangent(before, beyond > last.load)
        if not solver.row(direction).dot(tangent) > ALIGNED:
            return None
        energies = solver.energies(x)._replace(conjugate=solver.energies(before).conjugate)
        place = last.arclength + system.distance(last.x, x)
        return solver.point(x, place, tangent, outcome, energies=energies)

    def _halve(self, last: Point, most: float) -> None:
        """Halve the step, or end the branch, where the last point was ``most`` far from the next one at most."""
        self._step, self._failures = self._step / 2, self._failures + 1
        if self._step < min(self.steps.smallest, 0.01 * most):
            system, why = self.solver.system, f"steps below {self.steps.smallest:g}"
            if last.zero > (drifts := system.active_drifts(last.x)):
                why += f"; {last.zero - drifts} eigenvalues vanish there to working accuracy"
            self.ended = f"no convergence at {system.scene.load} = {last.load:.6g} ({why}{self._missed})"


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


def _on_bound(load: float, last: Point, bounds: tuple[float, float], span: float) -> bool:
    """Whether a step from ``last`` that changes the load ends on a bound of the range, but for round-off."""
    near = min(abs(bound - load) for bound in bounds)
    return near < ON_BOUND * span and abs(last.load - load) > 2 * ON_BOUND * span

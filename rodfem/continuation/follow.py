"""Pseudo-arclength continuation: following a curve of equilibria with control of the step, and checks of its rows.

The predictor extrapolates the cubic of the last two points of the branch and their tangents; the corrector is
Newton's method on the plane through the prediction orthogonal to the predicted direction (Keller 1977).  The step is
chosen such that the corrector moves a prediction by a set distance.

A branch is the integral of its unit tangent in arclength, ``x_b - x_a = int_a^b t ds``.  With the tangents at the last
rows interpolated (Adams-Moulton weights) what is left of that equation, the *defect*, is of a higher order in the step
than the correction of a prediction.  Between rows of two branches it is at least their distance (Allgower & Georg,
Introduction to Numerical Continuation Methods, 2003, 6.1, on path jumping): a step that has ended on another branch is
halved.  At the state of a row the equations themselves are evaluated, tested with every shape function.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import copysign, inf

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver, Step
from rodfem.continuation.curves import ALIGNED, ROWS, lagrange, predict
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.newton import violation
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine
from rodfem.problem.arguments import convert, finite, real, whole
from rodfem.tolerances import NEGLIGIBLE, SAME_LOAD

FAILURES = 2
"""Failures after each other from which a step follows the tangent of the last point alone."""
ON_BOUND = 1e-8
"""Distance from a bound, in spans, below which a load counts as on it: branches of constant load may lie there."""
UNEXPLAINED = 0.25
"""Defect of a step, relative to the correction that is aimed at, from which on it has ended on another branch."""
END_OF_RANGE, MOST_REACHED = "end of range", "points reached"
"""Why a branch ends at a bound of the range, and with as many points as its steps may have."""


@dataclass(frozen=True)
class StepControl:
    """Steps by the size of the correction, in the metric (root mean square rotation in radian, load over its span)."""

    first: float = 0.05  #: length of the first step
    largest: float = 0.15  #: bound of the step, which is also how coarse a branch is drawn
    smallest: float = 1e-5  #: length of a step at which a branch is given up
    aim: float = 1e-2  #: distance from prediction to correction that is aimed at
    most: int = 2000  #: number of points at which a branch is given up

    def __post_init__(self) -> None:
        """Check kinds and the largest step; raises :class:`InputError`."""
        convert(self, **{name: real(getattr(StepControl, name)) for name in ("first", "largest", "smallest", "aim")})
        if whole(StepControl.most)("most", self.most) < 1:
            raise InputError(f"most is {self.most}: a branch has at least one point; give most=1 or more.")
        if not self.smallest < self.largest <= 1:
            raise InputError(f"A step of {self.largest:g} is out of bounds: give {self.smallest:g} to 1.")
        if 0 < self.first < self.smallest:
            raise InputError(f"A first step of {self.first:g} is out of bounds: choose {self.smallest:g} or more.")
        for name in ("first", "smallest", "aim"):
            if not 0 < getattr(self, name) < inf:
                raise InputError(f"StepControl with {name} = {getattr(self, name):g} lead nowhere: give more than 0.")

    def begin(self) -> float:
        """Length of the first step."""
        return min(self.first, self.largest)

    def after(self, step: float, moved: float, order: int) -> float:
        """Length of the next step; the correction ``moved`` the prediction, that of a predictor of an ``order``."""
        factor = (self.aim / max(moved, NEGLIGIBLE)) ** (1 / order)
        return min(step * min(max(factor, 0.4), 1.6), self.largest)

    def accepts(self, before: Point, after: Point) -> bool:
        """Whether a step that has converged is kept; else half of it is tried."""
        return True


@dataclass(frozen=True)
class IndexStepControl(StepControl):
    """Steps over which the index changes by no more than a bound: there is a row between nearly equal points."""

    change: int = 1  #: greatest change of the index from row to row
    resolved: float = 1e-4  #: length of a step that is kept nevertheless: eigenvalues may be multiple

    def __post_init__(self) -> None:
        """Check the bound, too; raises :class:`InputError`."""
        super().__post_init__()
        if whole(IndexStepControl.change)("change", self.change) < 1:
            raise InputError(f"A change of the index of {self.change} leads nowhere: give change=1 or more.")
        if finite(IndexStepControl.resolved)("resolved", self.resolved) < 0:
            raise InputError(f"resolved is {self.resolved:g}: give zero or more, as in resolved=1e-4.")

    def accepts(self, before: Point, after: Point) -> bool:
        """Whether the index has changed by no more than the bound, or the step is as short as it needs be."""
        small = after.arclength - before.arclength <= self.resolved
        return small or abs(after.negative - before.negative) <= self.change


def follow(
    solver: BranchSolver,
    points: list[Point],
    steps: StepControl,
    bounds: tuple[float, float],
    reach: Callable[[Point], float] = lambda point: float("inf"),
) -> Iterator[Point | str]:
    """Continue a branch from its last point, yielding accepted points; a string at the end says why it ended.

    It ends exactly on the ``bounds`` of the load, and has a point exactly at each stop of the scene, where the tangent
    of the point becomes that of the other side.  The caller appends (and may insert) points in ``points``.  ``reach``
    bounds the step from a point.
    """
    walk = _Walk(solver, points, steps, bounds)
    while len(points) < steps.most and not walk.ended:
        if len(points) % 64 == 0:
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
        scene = solver.system.scene
        self.solver, self.points, self.steps, self.ends = solver, points, steps, bounds
        self.stops, self.span = scene.stops, abs(scene.span[1] - scene.span[0])
        self.ended, self._missed, self._failures = "", "", 0
        self._step, self._next, self._offset = steps.begin(), 0.0, 0.0

    def attempt(self, reach: float) -> Point | None:
        """A point at most ``reach`` away from the last one; None where that was too far, or the branch has ended."""
        last, most = self.points[-1], min(reach, self.steps.largest)
        self._step = min(self._step, most)
        known, bounds = self._predicting(last), self._stops(last.load)
        low, high = (bound + sign * ON_BOUND * self.span for bound, sign in zip(bounds, (-1, 1), strict=True))
        made = self.solver.step(known, last.arclength + self._step, (low, high), 0.5 * self._step)
        bound = min(bounds, key=lambda bound: abs(bound - made.load))
        moved = abs(last.load - made.load) > 2 * ON_BOUND * self.span
        if not low <= made.load <= high or (moved and abs(bound - made.load) < ON_BOUND * self.span):
            point = self._at_bound(known, made.load, bound)
        else:
            point = self._point(known, made)
        if point is None and not self.ended:
            self._halve(last, most)
        return point

    def go_on(self, point: Point) -> None:
        """Go on from an accepted point: from one at a stop with the tangent, and the work of the load, ahead."""
        if self._offset:
            x, system = _moved(self.solver, point.x, self._offset), self.solver.system
            point.tangent = self.solver.load_tangent(x, self._offset > 0)
            point.slope, point.conjugate = system.scalar(point.tangent), system.at(x).energies().conjugate
        self._step, self._missed, self._failures = self._next, "", 0

    def _stops(self, load: float) -> tuple[float, float]:
        """The nearest stops or ends on either side of a load, but for one that it is at."""
        below, above = ([s for s in self.stops if sign * (s - load) > SAME_LOAD * self.span] for sign in (-1, 1))
        return max([self.ends[0], *below]), min([self.ends[1], *above])

    def _predicting(self, last: Point) -> list[Point]:
        """Rows that the next one is predicted from."""
        stop = max((i for i, point in enumerate(self.points) if point.load in self.stops), default=0)
        # beyond a sharp bend the polynomial through the last points has another tangent than the branch
        known = [last] if self._failures >= FAILURES and last.tangent is not None else self.points[stop:]
        if self.solver.system.damping and last.tangent is not None:
            # across a family, along which the path is not determined
            known = [replace(last, tangent=self.solver.tangent(self.solver.row(last.tangent), at=last.x))]
        return known

    def _point(self, known: list[Point], made: Step) -> Point | None:
        """The point of a step that was made, if it is one of the branch."""
        if made.outcome is None or made.tangent is None or made.aligned <= ALIGNED:
            return None
        place = known[-1].arclength + made.length
        point = self.solver.point(made.x, place, made.tangent, made.outcome, made.index)
        if not self._stays(known, point) or not self.steps.accepts(known[-1], point):
            return None
        order = 2 if len(known) == 1 else 4
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
        self._next = self.steps.begin()
        self._offset = 0.0 if end else copysign(ON_BOUND * self.span, beyond - last.load)
        point = self._to_load(known, beyond, bound)
        if point is None or not self._stays(known, point):
            self._missed = f"; no state is found at {bound:.6g}: let the range end elsewhere if that is a bifurcation"
            return None
        self.ended = END_OF_RANGE if end else ""
        return point

    def _to_load(self, known: list[Point], beyond: float, load: float) -> Point | None:
        """Point exactly at ``load``, a part of the step to the load ``beyond``; None where it is not accepted.

        Tangent and work of the load at a stop are those on the side from which the branch comes.
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
        point = solver.point(x, last.arclength + system.distance(last.x, x), tangent, outcome)
        point.conjugate = system.at(before).energies().conjugate
        return point

    def _halve(self, last: Point, most: float) -> None:
        """Halve the step, or end the branch, where the last point was ``most`` far from the next one at most."""
        self._step, self._failures = self._step / 2, self._failures + 1
        if self._step < min(self.steps.smallest, 0.01 * most):
            where = f"{self.solver.system.scene.load} = {last.load:.6g}"
            self.ended = f"no convergence at {where} (steps below {self.steps.smallest:g}{self._missed})"


def _moved(solver: BranchSolver, x: PETSc.Vec, by: float) -> PETSc.Vec:
    """The state ``x`` at a load that differs ``by`` so much."""
    out = x.copy()
    solver.system.set_load(out, solver.system.scalar(x) + by)
    return out


def defect(system: System, rows: Sequence[Point]) -> float:
    """Size, in the metric, of ``x_b - x_a - int_a^b t ds`` across the chord of the last two of the ``rows``.

    Lengths are those of chords, so that the component along the chord is left out.
    """
    a, b = rows[-2:]
    known = [p for p in rows[-ROWS:] if p.tangent is not None]
    nodes, length = np.array([p.arclength for p in known]), b.arclength - a.arclength
    gauss = 0.5 / np.sqrt(3.0)  # distance of the two points of the rule from the middle: exact for cubics
    first, second = (lagrange(nodes, a.arclength + (0.5 + sign * gauss) * length)[0] for sign in (-1, 1))
    rest, chord = combine([p.tangent for p in known], first + second), b.x - a.x
    rest.aypx(-length / 2, chord)
    image = system.metric * chord
    rest.axpy(-image.dot(rest) / image.dot(chord), chord)
    return float(system.norm(rest))


def require_equilibrium(solver: BranchSolver, point: Point) -> None:
    """Raise :class:`ConvergenceError` for a row that is no equilibrium; collective."""
    system = solver.system
    system.set_phase(point.x)
    if worst := violation(system, point.x):
        raise ConvergenceError(
            f"At {system.scene.load} = {point.load:.8g} the state is no equilibrium: its equations are violated by "
            f"{worst:.1e}; use smaller steps."
        )

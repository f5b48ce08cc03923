"""Following a curve of special points in a plane of parameters: steps, bounds, crossings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.codim2_points import Codim2Points
from rodfem.codim2.criterion import Criterion, Destroyed
from rodfem.codim2.parameter_plane import LocusPoint, Plane, between, predict
from rodfem.continuation.convexity_between import lost_between
from rodfem.continuation.kinds import CROSSES, GAP
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError
from rodfem.fem.convexity import Convexity

AHEAD = 1e-9
"""Arclength after which a curve that begins on a bound shows whether it leaves the plane."""
REACH = 1e-6
"""Distance, in the metric, that a point on a bound may move by, however short the step."""
CLOSED = 0.1
"""Distance of the beginning of a closed curve from the cubic between two nodes that it is between, over theirs."""
RESOLVED = 0.1 * GAP
"""Arclength of the steps by which a crossing of two curves is told from a turn before the other one."""
FAILURES = 2
"""Failures after each other from which a step follows the tangent of the last node alone."""
TURNED = 0.7
"""Cosine of the angle by which a curve has turned that does not lead across another one."""


@dataclass
class Half:
    """One direction of a curve: nodes, marked ones by number, why it ended."""

    nodes: list[LocusPoint]
    marks: dict[int, str] = field(default_factory=dict)
    ended: str = ""


class Tracer:
    """Follows a curve from a node in the direction of its tangent."""

    def __init__(self, criterion: Criterion, plane: Plane, steps: StepControl) -> None:
        """Follow a ``criterion`` in a ``plane``, with ``steps`` relative to its bounds."""
        self.criterion, self.plane, self.steps = criterion, plane, steps
        self.points = Codim2Points(criterion, plane)
        self.convexity = Convexity(plane.system, *plane.names)

    def run(self, start: LocusPoint) -> Half:
        """Follow to an end."""
        half, history, step, failures = Half([start], ended=start.ended), [start], self.steps.first, 0
        if half.ended:
            return half
        ahead = start.p + AHEAD * start.dp
        over = self.plane.outside(ahead)
        if over is not None:
            half.ended = self._bound(*over)
            return half
        while len(history) < self.steps.most:
            last = history[-1]
            try:
                # beyond a sharp bend the polynomial through the last nodes has another tangent than the curve
                node, moved, bound = self._next(history if failures < FAILURES else history[-1:], step)
                half.ended = node.ended or self._lost_convexity(last, node) or self._between(half, history, node)
            except Destroyed as trouble:
                half.ended = str(trouble)
                return half
            except ConvergenceError as trouble:
                step, failures = step / 2, failures + 1
                if step < self.steps.smallest:
                    half.ended = f"no convergence with steps of {self.steps.smallest:g}: {trouble}"
                    return half
                continue
            if half.ended:
                return half
            half.nodes.append(node)
            if bound:
                half.ended = bound
                return half
            if len(history) > 2 and self._closes(start, last, node):
                half.nodes.append(start)
                half.ended = "closed curve"
                return half
            history.append(node)
            order = min(len(history) - 1, 3) + 1 if failures < FAILURES else 2
            step, failures = self.steps.after(step, moved, order), 0
        half.ended = f"{self.steps.most} points reached"
        return half

    def _lost_convexity(self, last: LocusPoint, node: LocusPoint) -> str:
        """Why a curve ends between two nodes, where the stored energy is not convex any more; empty where it is.

        The cubic between them is looked at, and where the energy is not convex on it the curve decides, to which a
        point is corrected.  Raises :class:`ConvergenceError` where none can be.
        """
        if not self.convexity.alters:
            return ""
        convexity, system = self.convexity, self.plane.system

        def guess(t: float) -> tuple[np.ndarray, PETSc.Vec, np.ndarray, PETSc.Vec]:
            return between(last, node, last.s + t * (node.s - last.s))

        def here(p: np.ndarray, x: PETSc.Vec) -> PETSc.Vec:
            system.line = self.plane.along(p, 0)
            system.set_load(x, float(p[0]))
            return x

        def corrected(t: float) -> LocusPoint:
            p, x, dp, dx = guess(t)
            try:
                return node if t == 1.0 else self.criterion.correct(p, x, (dp, dx), last, node.s - last.s)
            except ConvergenceError as trouble:
                raise ConvergenceError(
                    f"whether the stored energy stays convex near {self._words(p)} is open"
                ) from trouble

        def holds(t: float) -> bool:
            point = corrected(t)
            return convexity.holds(here(point.p, point.x))

        with self.plane.kept():
            lost = lost_between(convexity, lambda t: here(*guess(t)[:2]), holds)
            if lost is None:
                return ""
            return f"the stored energy is not convex any more near {self._words(corrected(lost).p)}"

    def _words(self, p: np.ndarray) -> str:
        """Both parameters by name."""
        return ", ".join(f"{name} = {v:.8g}" for name, v in zip(self.plane.names, p, strict=True))

    def _next(self, history: list[LocusPoint], step: float) -> tuple[LocusPoint, float, str]:
        """Next node, how far it is from its prediction, and the bound that it is on; ConvergenceError to retry."""
        last = history[-1]
        p, x, dp, dx = predict(history, last.s + step)
        over = self.plane.outside(p)
        if over is None:
            node = self._after(last, self.criterion.correct(p, x, (dp, dx), last, 0.5 * step))
            turn = self._cosine(node, dp, dx)
            over = self.plane.outside(node.p)
            if over is None:
                if turn < 0.9 or node.s - last.s > 2 * step:
                    raise ConvergenceError("the curve bends too sharply")
                if node.orientation != last.orientation and not self._leads_across(last, node):
                    raise ConvergenceError("the curve turns before another one")
                return node, self.criterion.length(p - node.p, x - node.x), ""
            p = node.p
        which, bound = over
        share = (bound - last.p[which]) / (p[which] - last.p[which])
        p, x, dp, dx = predict(history, last.s + share * step)
        p[which] = bound
        axis = (np.arange(2) == which) * self.plane.width
        node = self.criterion.correct(p, x, (axis, None), last, max(0.5 * step, REACH))
        node.p[which] = bound
        node = self._after(last, node if self._cosine(node, dp, dx) >= 0 else node.reversed())
        other = self.plane.outside(node.p)
        if other is not None or node.s - last.s > 2 * step:
            raise ConvergenceError("it leaves near a corner of the bounds")
        return node, 0.0, self._bound(which, bound)

    def _leads_across(self, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether the curve through ``a`` leads to ``b``, on another side of its tangent, across a second curve.

        Two curves that nearly cross are the two sides of a gap: each turns, and a step may lead from one to the other.
        In smaller and smaller steps towards the crossing it is seen which; down to :data:`RESOLVED` they are one point.
        """
        here, step = a, (b.s - a.s) / 2
        while step > RESOLVED:
            try:
                p, x, dp, dx = predict([here], here.s + step)
                node = self._after(here, self.criterion.correct(p, x, (dp, dx), here, 0.5 * step))
            except ConvergenceError:
                step /= 2
                continue
            if node.orientation != here.orientation or self._cosine(node, here.dp, here.dx) < 0.9:
                step /= 2
                continue
            here = node
            if here.s > b.s or self._cosine(here, a.dp, a.dx) < TURNED:
                return False
        return True

    def _bound(self, which: int, bound: float) -> str:
        return f"{self.plane.names[which]} = {bound:g}, its bound"

    def _after(self, last: LocusPoint, node: LocusPoint) -> LocusPoint:
        node.s = last.s + self.criterion.length(node.p - last.p, node.x - last.x)
        return node

    def _cosine(self, node: LocusPoint, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Cosine between a node's tangent and a direction."""
        size = self.criterion.length(dp, dx)
        dp, dx = dp / size, dx / size
        a, b = self.criterion.length(node.dp + dp, node.dx + dx), self.criterion.length(node.dp - dp, node.dx - dx)
        return (a * a - b * b) / 4

    def _between(self, half: Half, history: list[LocusPoint], node: LocusPoint) -> str:
        """Insert what lies between the last node of a history and the next one; a reason if the curve ends there."""
        last, before = history[-1], history[-2] if len(history) > 1 else None
        rows, ended = self.points.between(last, node, before)  # a step that fails there is tried again
        for row, kind in rows:
            if kind:
                half.marks[len(half.nodes)] = kind
            half.nodes.append(row)
        if not ended and last.rest != node.rest:
            half.marks[len(half.nodes)] = self.criterion.others
        elif not ended and last.orientation != node.orientation:
            half.marks[len(half.nodes)] = CROSSES
        return ended

    def _closes(self, start: LocusPoint, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether the curve passes its beginning again between two nodes."""
        whole, part = (b.p - a.p) / self.plane.width, (start.p - a.p) / self.plane.width
        size = float(np.linalg.norm(whole))
        if not size or not 0 < part @ whole <= size**2:
            return False
        p, x, dp, dx = between(a, b, a.s + (part @ whole) / size**2 * (b.s - a.s))
        near = self.criterion.length(p - start.p, x - start.x) < CLOSED * (b.s - a.s)
        return near and self._cosine(start, dp, dx) > 0.5

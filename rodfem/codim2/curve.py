"""Following a curve of special points in a plane of parameters: steps, bounds, crossings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.plane import REACH, Criterion, Destroyed, LocusPoint, Plane, between, predict
from rodfem.codim2.points import Codim2Points
from rodfem.continuation.kinds import CROSSES, GAP
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError
from rodfem.fem.convexity import Convexity

AHEAD = 1e-9
"""Arclength after which a curve that begins on a bound shows whether it leaves the plane."""
STRAIGHT = 0.9
"""Cosine of the angle by which a curve turns in a step at most, and where it does not lead across another one."""
CLOSED = 0.1
"""Distance of the beginning of a closed curve from the cubic between two nodes that it is between, over theirs."""
FAILURES = 2
"""Failures after each other from which a step follows the tangent of the last node alone."""


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
        over = self.plane.outside(start.p + AHEAD * start.dp)
        if over is not None:
            half.ended = half.ended or self._bound(*over)
        while not half.ended and len(history) < self.steps.most:
            # beyond a sharp bend the polynomial through the last nodes has another tangent than the curve
            recent = history if failures < FAILURES else history[-1:]
            try:
                node, moved = self._advance(half, history, recent, step)
            except Destroyed as trouble:
                half.ended = str(trouble)
            except ConvergenceError as trouble:
                step, failures = step / 2, failures + 1
                if step < self.steps.smallest:
                    half.ended = f"no convergence with steps of {self.steps.smallest:g}: {trouble}"
            else:
                step, failures = self.steps.after(step, moved, min(len(recent), 3) + 1), 0
                history.append(node)
        half.ended = half.ended or f"{self.steps.most} points reached"
        return half

    def _advance(
        self, half: Half, history: list[LocusPoint], recent: list[LocusPoint], step: float
    ) -> tuple[LocusPoint, float]:
        """Next node by the ``recent`` ones of a history, and how far it is from its prediction; the half has both."""
        node, moved, bound = self._next(recent, step)
        half.ended = node.ended or self._lost_convexity(history[-1], node) or self._between(half, history, node)
        if not half.ended:
            half.nodes.append(node)
            half.ended = bound or self._closed(half, history, node)
        return node, moved

    # --- a step ----------------------------------------------------------------------------------------------------

    def _next(self, history: list[LocusPoint], step: float) -> tuple[LocusPoint, float, str]:
        """Next node, how far it is from its prediction, and the bound that it is on; ConvergenceError to retry."""
        last = history[-1]
        guess = predict(history, last.s + step)
        p, x, dp, dx = guess
        over = self.plane.outside(p)
        if over is None:
            node = self._after(last, self.criterion.correct(guess, last, 0.5 * step))
            over = self.plane.outside(node.p)
            if over is None:
                if self._cosine(node, dp, dx) < STRAIGHT or node.s - last.s > 2 * step:
                    raise ConvergenceError("the curve bends too sharply")
                if node.orientation != last.orientation and not self._leads_across(last, node):
                    raise ConvergenceError("the curve turns before another one")
                return node, self.criterion.length(p - node.p, x - node.x), ""
            p = node.p
        return self._to_bound(history, step, p, over)

    def _to_bound(
        self, history: list[LocusPoint], step: float, beyond: np.ndarray, over: tuple[int, float]
    ) -> tuple[LocusPoint, float, str]:
        """The same where parameters ``beyond`` are ``over`` a bound: the node is on it."""
        last, (which, bound) = history[-1], over
        share = (bound - last.p[which]) / (beyond[which] - last.p[which])
        p, x, dp, dx = predict(history, last.s + share * step)
        p[which] = bound
        node = self.criterion.correct((p, x, self.plane.axis(which), None), last, max(0.5 * step, REACH))
        node.p[which] = bound
        node = self._after(last, node if self._cosine(node, dp, dx) >= 0 else node.reversed())
        if self.plane.outside(node.p) is not None or node.s - last.s > 2 * step:
            raise ConvergenceError("it leaves near a corner of the bounds")
        return node, 0.0, self._bound(which, bound)

    def _leads_across(self, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether the curve through ``a`` leads to ``b``, on another side of its tangent, across a second curve.

        Two curves that nearly cross are the two sides of a gap: each turns, and a step may lead from one to the other.
        In smaller and smaller steps towards the crossing it is seen which; next to a gap that may be taken for a
        crossing they are one point.
        """
        here, step = a, (b.s - a.s) / 2
        while step > 0.1 * GAP:
            try:
                guess = predict([here], here.s + step)
                node = self._after(here, self.criterion.correct(guess, here, 0.5 * step))
                if node.orientation != here.orientation or self._cosine(node, here.dp, here.dx) < STRAIGHT:
                    raise ConvergenceError("the curve turns, or another one crosses it")
            except ConvergenceError:
                step /= 2
                continue
            here = node
            if here.s > b.s or self._cosine(here, a.dp, a.dx) < STRAIGHT:
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

    # --- what is in a step -----------------------------------------------------------------------------------------

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

    def _closed(self, half: Half, history: list[LocusPoint], b: LocusPoint) -> str:
        """Why the curve ends if it passes its beginning again between the last node of a history and ``b``."""
        start, a = history[0], history[-1]
        whole, part = (b.p - a.p) / self.plane.width, (start.p - a.p) / self.plane.width
        size = float(np.linalg.norm(whole))
        if len(history) < 3 or not size or not 0 < part @ whole <= size**2:
            return ""
        p, x, dp, dx = between(a, b, a.s + (part @ whole) / size**2 * (b.s - a.s))
        near = self.criterion.length(p - start.p, x - start.x) < CLOSED * (b.s - a.s)
        if not near or self._cosine(start, dp, dx) < STRAIGHT:
            return ""
        half.nodes.append(start)
        return "closed curve"

    def _lost_convexity(self, last: LocusPoint, node: LocusPoint) -> str:
        """Why a curve ends between two nodes, if the stored energy is not convex at the second one; empty if it is."""
        if not self.convexity.alters or self.convexity.holds(self.plane.at(node.p, node.x)):
            return ""
        scales = self.convexity.scales(self.plane.at(last.p, last.x))
        lost = self.points.located(last, node, lambda n: self.convexity.margin(self.plane.at(n.p, n.x), scales))
        return f"the stored energy is not convex any more near {self.plane.words((lost or node).p)}"

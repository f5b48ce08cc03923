"""Following a curve of special points in a plane of parameters: steps, bounds, turning points, cusps, ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.along import COARSE, WIDE, place, shifted
from rodfem.codim2.criterion import Criterion, Destroyed
from rodfem.codim2.parameter_plane import LocusPoint, Plane, Sought, between, predict
from rodfem.continuation.convexity_between import lost_between
from rodfem.continuation.kinds import CROSSES, GAP
from rodfem.continuation.step_control import StepControl
from rodfem.errors import ConvergenceError
from rodfem.fem.convexity import Convexity
from rodfem.roots import zero_between

LOCATED = 1e-8
"""Arclength to which turning points, cusps and ends are located by their tests, before they are placed."""
AHEAD = 1e-9
"""Arclength after which a curve that begins on a bound shows whether it leaves the plane."""
REACH = 1e-6
"""Distance, in the metric, that a point on a bound may move by, however short the step."""
BESIDE = 1e-3
"""Share of the plane's width by which the last point may miss the two nodes that it is between."""
CERTAIN = 10.0
"""Uncertainties of a parameter by which it changes towards a turning point: less is the round-off of a constant."""
DOUBLE_ZERO = Sought(lambda n: n.omega2, stationary=False)
"""The end of a curve of flutter: its double eigenvalue vanishes."""
CLOSED = 0.1
"""Distance of the beginning of a closed curve from the cubic between two nodes that it is between, over theirs."""
RESOLVED = 0.1 * GAP
"""Arclength of the steps by which a crossing of two curves is told from a turn before the other one."""
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
        """Steps are relative to the bounds of the plane."""
        self.criterion, self.plane, self.steps = criterion, plane, steps
        scene = plane.system.scene
        varies = not scene.is_quadratic() or scene.energy_depends_on("s", *plane.names)
        self.convexity = Convexity(plane.system) if varies else None

    def run(self, start: LocusPoint) -> Half:
        """Follow to an end."""
        half, history, step = Half([start], ended=start.ended), [start], self.steps.first
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
                node, moved, bound = self._next(history, step)
            except Destroyed as trouble:
                half.ended = str(trouble)
                return half
            except ConvergenceError as trouble:
                step /= 2
                if step < self.steps.smallest:
                    half.ended = f"no convergence with steps of {self.steps.smallest:g}: {trouble}"
                    return half
                continue
            half.ended = node.ended or self._lost_convexity(last, node) or self._between(half, last, node)
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
            order = min(len(history) - 1, 3) + 1
            step = self.steps.after(step, moved, order)
        half.ended = f"{self.steps.most} points reached"
        return half

    def _lost_convexity(self, last: LocusPoint, node: LocusPoint) -> str:
        """Why a curve ends between two nodes, where the stored energy is not convex any more; empty where it is."""
        if self.convexity is None:
            return ""

        def state(t: float) -> PETSc.Vec:
            p, x, *_ = between(last, node, last.s + t * (node.s - last.s))
            system.line = self.plane.along(p, 0)
            system.set_load(x, float(p[0]))
            return x

        system = self.plane.system
        with self.plane.kept():
            found = lost_between(self.convexity, state, lambda t: False)
        if found.resolved and found.lost is None:
            return ""
        p, *_ = between(last, node, last.s + (found.lost or 0.0) * (node.s - last.s))
        where = ", ".join(f"{name} = {v:.8g}" for name, v in zip(self.plane.names, p, strict=True))
        if found.lost is None:
            return f"the stored energy varies so fast that it may lose convexity unseen near {where}"
        return f"the stored energy is not convex any more near {where}"

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

    def _between(self, half: Half, a: LocusPoint, b: LocusPoint) -> str:
        """Insert what lies between two nodes; a reason if the curve ends there."""
        names = self.plane.names
        if a.coupling @ b.coupling < 0:
            sentence = "the fold ends on a branch point"
            coupling, end = lambda n: float(n.coupling @ a.coupling), lambda n: self._end_of_fold(n, a, b)
            ended = self._last(half, a, b, coupling, sentence, end)
            return f"{ended}, or turns back within {GAP:g} of the bounds from one"
        if a.omega2 * b.omega2 < 0:
            sentence = "the double eigenvalue vanishes: divergence"
            return self._last(
                half, a, b, lambda n: n.omega2, sentence, lambda n: as_beside(self._placed(n, DOUBLE_ZERO), a)
            )
        found: list[tuple[LocusPoint, str]] = []
        if a.curvature * b.curvature < 0:
            cusps = self._located(a, b, lambda n: n.curvature, "cusp")
            found = [(self._placed(n, self._reversal(a, b)), kind) for n, kind in cusps]
        else:
            for i in np.flatnonzero(a.dp * b.dp < 0):
                turn = self._located(a, b, lambda n, i=i: float(n.dp[i]), f"turns in {names[i]}")  # type: ignore[misc]
                sought = Sought(lambda n, i=i: float(n.p[i]), stationary=True)  # type: ignore[misc]
                found += [(self._placed(n, sought), kind) for n, kind in turn if _moves(n, a, b, i)]
        for node, kind in sorted(found, key=lambda item: item[0].s):
            half.marks[len(half.nodes)] = kind
            half.nodes.append(node)
        if a.rest != b.rest:
            half.marks[len(half.nodes)] = self.criterion.others
        elif a.orientation != b.orientation:
            half.marks[len(half.nodes)] = CROSSES
        return ""

    def _located(
        self, a: LocusPoint, b: LocusPoint, f: Callable[[LocusPoint], float], kind: str
    ) -> list[tuple[LocusPoint, str]]:
        """Point between two others at which ``f`` vanishes; none where it cannot be located."""

        def at(s: float) -> LocusPoint:
            p, x, dp, dx = between(a, b, s)
            return self.criterion.correct(p, x, (dp, dx), a)

        try:
            s = zero_between(lambda s: f(at(s)), a.s, b.s, LOCATED)
            node = at(s)
        except (ConvergenceError, ValueError):
            return []
        node.s = s
        return [(node, kind)]

    def _placed(self, node: LocusPoint, sought: Sought) -> LocusPoint:
        """The point near ``node`` that is ``sought``, with uncertainties of its place along the curve, too."""
        try:
            found = place(self.criterion, self.plane, node, sought)
            better = shifted(self.criterion, self.plane, node, found.s)
        except ConvergenceError:
            return replace(
                node, located_to=node.located_to + COARSE * np.maximum(abs(node.dp), COARSE * self.plane.width)
            )
        located = better.located_to + found.dp
        return replace(better, s=node.s + found.s, located_to=located, sought=sought, windows=found.windows)

    def _end_of_fold(self, node: LocusPoint, a: LocusPoint, b: LocusPoint) -> LocusPoint:
        """The end near ``node`` of a fold on a branch point, by interpolation between its two sides.

        No point can be corrected to it: there the curve of branch points passes, on which corrections may slide along.
        Nor has the fold a tangent of its own there, but for the cubic between ``a`` and ``b``.
        """
        *_, dp, dx = between(a, b, node.s)
        size = self.criterion.length(dp, dx)
        node, sought = replace(node, dp=dp / size, dx=dx / size, rest=a.rest), self._reversal(a, b)
        try:
            found = place(self.criterion, self.plane, node, sought, WIDE)
        except ConvergenceError:
            return replace(node, located_to=np.maximum(abs(node.p - a.p), abs(node.p - b.p)))
        end = found.interpolated(node)
        end.ordinate = self.criterion.solver.shape.ordinate(end.x)
        return replace(end, s=node.s + found.s, sought=sought, windows=found.windows)

    def _reversal(self, a: LocusPoint, b: LocusPoint) -> Sought:
        """Where both parameters turn back at once between two nodes, as at a cusp: what turns most is stationary."""
        turned = (b.dp - a.dp) / self.plane.width**2
        return Sought(lambda n: float(turned @ n.p), stationary=True)

    def crossed(self, a: LocusPoint, b: LocusPoint, which: int, value: float) -> list[LocusPoint]:
        """Point between two neighbours at which a parameter has a value; none where it cannot be located.

        The neighbours are ``a`` and ``b``; parameter number ``which`` (0 or 1) has the given ``value`` there.
        """
        return [node for node, _ in self._located(a, b, lambda n: float(n.p[which]) - value, "")]

    def _last(
        self,
        half: Half,
        a: LocusPoint,
        b: LocusPoint,
        f: Callable[[LocusPoint], float],
        sentence: str,
        end: Callable[[LocusPoint], LocusPoint],
    ) -> str:
        """End at the point that ``end`` makes of one at which ``f`` vanishes."""
        found = self._located(a, b, f, sentence)
        where = (a.p + b.p) / 2
        if found and not np.any(abs(found[0][0].p - where) > abs(b.p - a.p) + BESIDE * self.plane.width):
            node = end(found[0][0])
            half.marks[len(half.nodes)] = sentence
            half.nodes.append(node)
            where = node.p
        return f"{sentence} near {', '.join(f'{n} = {v:.8g}' for n, v in zip(self.plane.names, where, strict=True))}"

    def _closes(self, start: LocusPoint, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether the curve passes its beginning again between two nodes."""
        whole, part = (b.p - a.p) / self.plane.width, (start.p - a.p) / self.plane.width
        size = float(np.linalg.norm(whole))
        if not size or not 0 < part @ whole <= size**2:
            return False
        p, x, dp, dx = between(a, b, a.s + (part @ whole) / size**2 * (b.s - a.s))
        near = self.criterion.length(p - start.p, x - start.x) < CLOSED * (b.s - a.s)
        return near and self._cosine(start, dp, dx) > 0.5


def _moves(turn: LocusPoint, a: LocusPoint, b: LocusPoint, which: int) -> bool:
    """Whether a parameter at its extremum differs from that at the neighbours by more than its uncertainty."""
    moved = max(abs(turn.p[which] - a.p[which]), abs(turn.p[which] - b.p[which]))
    return bool(moved > CERTAIN * turn.located_to[which])


def as_beside(end: LocusPoint, a: LocusPoint) -> LocusPoint:
    """The end of a curve with the count of the node ``a`` before it: a double eigenvalue that is zero has no sign."""
    return replace(end, rest=end.rest + len(end.modes) * (int(a.omega2 < 0) - int(end.omega2 < 0)))

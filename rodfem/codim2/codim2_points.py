"""Points of codimension two between two nodes of a locus: cusps, and ends of folds and of flutter; and turning points.

At a *cusp* of a fold its curvature vanishes and both parameters turn back, while the coupling of its null vector with
the parameters does not vanish.  Where it does, in both of them at one place, the fold *ends on a branch point*: beyond
it the curve is its own mirror image.  It may also *pass a branch point*, to other parameters.  A double eigenvalue that
vanishes ends a curve of flutter.

What changes sign between two nodes is located.  What changes it twice is looked for where a parabola or cubic through
the nodes has its extremum: such a step is parted there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rodfem.codim2.along import COARSE, WIDE, place, shifted
from rodfem.codim2.criterion import Criterion
from rodfem.codim2.parameter_plane import LocusPoint, Plane, Sought, between
from rodfem.continuation.kinds import GAP
from rodfem.errors import ConvergenceError
from rodfem.output.digits import number
from rodfem.roots import zero_between

LOCATED = 1e-8
"""Arclength to which turning points, cusps and ends are located by their tests, before they are placed."""
BESIDE = 1e-3
"""Share of the plane's width by which the last point may miss the two nodes that it is between."""
CERTAIN = 10.0
"""Uncertainties of a parameter by which it changes towards a turning point: less is the round-off of a constant."""
DOUBLE_ZERO = Sought(lambda n: n.omega2, stationary=False)
"""The end of a curve of flutter: its double eigenvalue vanishes."""
NO_COUPLING = 1e-9
"""Coupling with one parameter that is none, over that with the other one, both in units of the bounds."""
CLOSE = 1e-6
"""Distance, in the metric, that a point may move by from where a parameter was found to have a value, to having it."""
VANISHED, PASSED = 0.05, 1e-3
"""Share that is left of a coupling where it vanishes, at an end and beside a cusp: its place is known to no more."""
ASIDE = 1e-2
"""Distance from a cusp, over that of the nodes, at which the tangent has the direction that it has beside it."""
FLAT = 1e-12
"""Part of the unit tangent along a parameter, over its bounds, that is round-off: next to a cusp it has no sign."""
PASSES = "the fold passes a branch point"
"""Mark of a row at which the coupling vanishes as well, but the fold goes on."""
DEPTH = 4
"""Times that a step is parted for more cusps than one."""
PARABOLAS = 8
"""Parabolas by which the least value of what may vanish twice in a step is sought."""

Row = tuple[LocusPoint, str]
"""A point of a locus and the kind of its mark; empty for none."""
Test = Callable[[LocusPoint], float]
"""What vanishes at a point of codimension two."""


class Codim2Points:
    """Finds what lies between two nodes of a locus of a ``criterion`` in a ``plane``."""

    def __init__(self, criterion: Criterion, plane: Plane) -> None:
        """Keep what solves for points, and the plane."""
        self.criterion, self.plane = criterion, plane

    def between(self, a: LocusPoint, b: LocusPoint, before: LocusPoint | None) -> tuple[list[Row], str]:
        """Rows between two nodes, in their order, and why the curve ends there; empty where it does not.

        Parameters
        ----------
        a, b
            Two nodes of the curve, one after the other.
        before
            The node before ``a``; None where that is the first one.
        """
        if self._reverses(a, b):
            kind = "the fold ends on a branch point"

            def coupling(n: LocusPoint) -> float:
                return float(n.coupling @ a.coupling)

            located = self._located(a, b, coupling, kind)
            if not located or self._coupling_vanishes(located[0][0], a, b):
                rows, ended = self._end(a, b, coupling, kind, lambda n: self._end_of_fold(n, a, b), located)
                return rows, f"{ended}, or turns back within {GAP:g} of the bounds from one"
        if a.omega2 * b.omega2 < 0:
            kind = "the double eigenvalue vanishes: divergence"
            return self._end(a, b, lambda n: n.omega2, kind, lambda n: as_beside(self._placed(n, DOUBLE_ZERO), a))
        return self._rows(a, b, before, DEPTH), ""

    def crossed(self, a: LocusPoint, b: LocusPoint, which: int, value: float) -> list[LocusPoint]:
        """Point between two neighbours at which a parameter has a value; none where it cannot be located.

        The neighbours are ``a`` and ``b``; parameter number ``which`` (0 or 1) has the given ``value`` there.
        """
        return [self._exactly(node, which, value) for node in self.at_value(a, b, which, value)]

    def at_value(self, a: LocusPoint, b: LocusPoint, which: int, value: float) -> list[LocusPoint]:
        """The same point to the arclength to which points are located, with its arclength.

        ``a``, ``b``, ``which`` and ``value`` are those of :meth:`crossed`.
        """
        return [node for node, _ in self._located(a, b, lambda n: float(n.p[which]) - value, "")]

    def _exactly(self, node: LocusPoint, which: int, value: float) -> LocusPoint:
        """The point with this value of a parameter, close to ``node``; that itself where the curve turns back."""
        axis = (np.arange(2) == which) * self.plane.width
        try:
            return self.criterion.correct(np.where(axis, value, node.p), node.x, (axis, None), node, CLOSE)
        except ConvergenceError:
            return node

    def _rows(self, a: LocusPoint, b: LocusPoint, other: LocusPoint | None, depth: int) -> list[Row]:
        """What is between two nodes, beside an ``other`` one, in a step that may be parted ``depth`` times."""
        rows = list[Row]()
        for p, q in pairwise([a, *self._hidden(a, b, other), b]):
            rows += self._piece(p, q, depth) + [(q, "")] * (q is not b)
        return rows

    def _piece(self, a: LocusPoint, b: LocusPoint, depth: int) -> list[Row]:
        """What is between two nodes where the curvature has another sign at most once, or by pieces beside that."""
        if a.curvature * b.curvature >= 0:
            turns = self._turns(a, b)
            for turn, _ in turns if depth else []:
                beside = self._beside(turn, a, b)
                if len(beside) == 2 and beside[0].curvature * beside[1].curvature < 0:  # a cusp, of an even number
                    return self._rows(a, beside[0], None, 0) + self._piece(beside[0], b, depth - 1)
            return turns
        cusps = self._located(a, b, lambda n: n.curvature, "cusp")
        if not cusps:
            return []
        (cusp, kind), sides = cusps[0], list[list[Row]]([[], []])
        beside = self._beside(cusp, a, b)
        if len(beside) == 2 and depth:
            sides = [self._rows(a, beside[0], beside[1], depth - 1), self._rows(beside[1], b, beside[0], depth - 1)]
        if self._coupling_vanishes(cusp, a, b, PASSED):
            # no solution locates it: corrections slide along the curve of branch points
            passed = replace(cusp, located_to=cusp.located_to + np.maximum(abs(cusp.p - a.p), abs(cusp.p - b.p)))
            return [*sides[0], (passed, PASSES), *sides[1]]
        return [*sides[0], (self._placed(cusp, self._reversal(a, b)), kind), *sides[1]]

    def _beside(self, node: LocusPoint, a: LocusPoint, b: LocusPoint) -> list[LocusPoint]:
        """Points on both sides of a ``node`` between two others, as far as they are between these."""
        aside = ASIDE * (b.s - a.s)
        return [self._at(a, b, s) for s in (node.s - aside, node.s + aside) if a.s < s < b.s]

    def _turns(self, a: LocusPoint, b: LocusPoint) -> list[Row]:
        """Points between two nodes at which a parameter has an extremum."""
        names, found = self.plane.names, list[Row]()
        flat = np.minimum(abs(a.dp), abs(b.dp)) <= FLAT * self.plane.width
        for i in np.flatnonzero((a.dp * b.dp < 0) & ~flat & _changes(a, b)):
            turn = self._located(a, b, lambda n, i=i: float(n.dp[i]), f"turns in {names[i]}")  # type: ignore[misc]
            sought = Sought(lambda n, i=i: float(n.p[i]), stationary=True)  # type: ignore[misc]
            found += [(self._placed(n, sought), kind) for n, kind in turn if _moves(n, a, b, i)]
        return sorted(found, key=lambda item: item[0].s)

    def _hidden(self, a: LocusPoint, b: LocusPoint, before: LocusPoint | None) -> list[LocusPoint]:
        """A point between two nodes where something has another sign than at both, if there is one."""
        for s, of in _extrema(a, b, before):
            node = self._beyond_zero(a, b, s, of)
            if node is not None:
                return [node]
        return []

    def _beyond_zero(self, a: LocusPoint, b: LocusPoint, s: float, of: Test) -> LocusPoint | None:
        """Point near arclength ``s`` where ``of`` has the other sign than at both nodes, by successive parabolas."""
        sign, last = np.sign(of(a)), np.inf
        for _ in range(PARABOLAS):
            try:
                node = self._at(a, b, s)
            except ConvergenceError:
                return None
            value = sign * of(node)
            if value < 0:
                return node
            if value >= last:
                return None
            last, vertex = value, _vertex((a.s, s, b.s), (sign * of(a), value, sign * of(b)))
            if vertex is None or not a.s < vertex < b.s:
                return None
            s = vertex
        return None

    def _at(self, a: LocusPoint, b: LocusPoint, s: float) -> LocusPoint:
        """Point of the curve between two nodes at an arclength; raises :class:`ConvergenceError`."""
        p, x, dp, dx = between(a, b, s)
        return replace(self.criterion.correct(p, x, (dp, dx), a), s=s)

    def _located(self, a: LocusPoint, b: LocusPoint, f: Test, kind: str) -> list[Row]:
        """Point between two others at which ``f`` vanishes; none where it cannot be located."""
        try:
            s = zero_between(lambda s: f(self._at(a, b, s)), a.s, b.s, LOCATED)
            return [(self._at(a, b, s), kind)]
        except (ConvergenceError, ValueError):
            return []

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

    def _reverses(self, a: LocusPoint, b: LocusPoint) -> bool:
        """Whether coupling and tangent change their signs between two nodes, in each parameter that has some.

        Beyond its end on a branch point a fold is its own mirror image, with the same parameters once more.  Where it
        goes on to others it passes the branch point.
        """
        coupled = self._coupled(a, b)
        moves = np.minimum(abs(a.dp), abs(b.dp)) > FLAT * self.plane.width
        turned = (a.coupling * b.coupling < 0)[coupled].all() and (a.dp * b.dp < 0)[moves].all()
        return bool(coupled.any() and moves.any() and turned)

    def _coupled(self, a: LocusPoint, b: LocusPoint) -> np.ndarray:
        """Whether the null vector is coupled with each of the parameters (2,), round-off apart."""
        size = np.minimum(abs(a.coupling), abs(b.coupling))
        return np.asarray(size > NO_COUPLING * size.max())

    def _coupling_vanishes(self, node: LocusPoint, a: LocusPoint, b: LocusPoint, share: float = VANISHED) -> bool:
        """Whether at most a ``share`` of the coupling at two nodes is left at ``node``, in all parameters."""
        size = np.minimum(abs(a.coupling), abs(b.coupling))
        return bool((abs(node.coupling) <= share * size)[self._coupled(a, b)].all())

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

    def _end(
        self,
        a: LocusPoint,
        b: LocusPoint,
        f: Test,
        kind: str,
        end: Callable[[LocusPoint], LocusPoint],
        located: list[Row] | None = None,
    ) -> tuple[list[Row], str]:
        """The last row, that ``end`` makes of the point where ``f`` vanishes, and a sentence with its kind and place.

        Where nothing was, both are those of the cubic between the nodes, where the line through both values of ``f`` is
        zero: it is off by no more than it is from either of them.
        """
        located = self._located(a, b, f, kind) if located is None else located
        where = (a.p + b.p) / 2
        if located and not np.any(abs(located[0][0].p - where) > abs(b.p - a.p) + BESIDE * self.plane.width):
            node = end(located[0][0])
        else:
            p, x, dp, dx = between(a, b, a.s + f(a) / (f(a) - f(b)) * (b.s - a.s))
            size = self.criterion.length(dp, dx)
            node = replace(a, p=p, x=x, dp=dp / size, dx=dx / size, s=(a.s + b.s) / 2)
            node.located_to = np.maximum(abs(p - a.p), abs(p - b.p)) + a.located_to
            node.ordinate = self.criterion.solver.shape.ordinate(x)
        each = zip(self.plane.names, node.p, node.located_to, strict=True)
        return [(node, kind)], f"{kind} near {', '.join(f'{name} = {number(v, error)}' for name, v, error in each)}"


def _extrema(a: LocusPoint, b: LocusPoint, before: LocusPoint | None) -> list[tuple[float, Test]]:
    """Arclengths between two nodes at which something that has one sign at both comes near zero, or passes it."""
    found = list[tuple[float, Test]]()
    if before is not None and a.curvature * b.curvature > 0:
        nodes = (before, a, b)
        s = _vertex(tuple(n.s for n in nodes), tuple(n.curvature for n in nodes))
        if s is not None and a.s < s < b.s:
            found.append((s, lambda n: n.curvature))
    for i in np.flatnonzero((a.dp * b.dp > 0) & _changes(a, b)):
        chord = (b.p[i] - a.p[i]) / (b.s - a.s)
        if np.sign(a.dp[i]) * (3 * chord - (a.dp[i] + b.dp[i]) / 2) < min(abs(a.dp[i]), abs(b.dp[i])):
            found.append(((a.s + b.s) / 2, lambda n, i=i: float(n.dp[i])))  # type: ignore[misc]
    return found


def _vertex(s: Sequence[float], values: Sequence[float]) -> float | None:
    """Argument at which the parabola through three values comes nearest to zero or passes it; None without one."""
    second, first, _ = np.polyfit(np.array(s) - s[1], values, 2)
    if second * values[1] <= 0:
        return None
    return float(s[1] - first / (2 * second))


def _changes(a: LocusPoint, b: LocusPoint) -> np.ndarray:
    """Whether each parameter (2,) may change between two nodes by more than its uncertainty: else nothing is sought."""
    most = np.maximum(abs(a.dp), abs(b.dp)) * (b.s - a.s)
    return np.asarray(most > CERTAIN * np.minimum(a.located_to, b.located_to))


def _moves(turn: LocusPoint, a: LocusPoint, b: LocusPoint, which: int) -> bool:
    """Whether a parameter at its extremum differs from that at the neighbours by more than its uncertainty."""
    moved = max(abs(turn.p[which] - a.p[which]), abs(turn.p[which] - b.p[which]))
    return bool(moved > CERTAIN * turn.located_to[which])


def as_beside(end: LocusPoint, a: LocusPoint) -> LocusPoint:
    """The end of a curve with the count of the node ``a`` before it: a double eigenvalue that is zero has no sign."""
    return replace(end, rest=end.rest + len(end.modes) * (int(a.omega2 < 0) - int(end.omega2 < 0)))

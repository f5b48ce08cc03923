"""Points of codimension two between two nodes of a locus: cusps, and ends of folds and of flutter; and turning points.

Where the fourth derivative of the energy along a pitchfork's branch vanishes that is super- on one side, and
subcritical on the other: the coefficient of its law has another sign.

At a *cusp* of a fold its curvature vanishes and both parameters turn back, while the coupling of its null vector with
the parameters does not vanish.  If it does, in both of them at one place, the fold *ends on a branch point*: beyond it
the curve is its own mirror image; or it *passes a branch point*, to other parameters.  A double eigenvalue that
vanishes ends a curve of flutter.

What changes sign between two nodes is located.  A step that shows a turning point or a cusp, or in which the cubic
through the nodes may turn twice, is parted, and looked at part by part.

Points of a locus are known to the last digits *across* it, tangents by differences displace places along it.  Points
on both sides are corrected to the curve at Chebyshev's points of a window of the tangent, and what is sought is read
from the polynomials through them, with its uncertainty: the last two coefficients, which hold the round-off of the
points and what the polynomial leaves out (L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM
2013, chapters 3 and 8), and the difference between the best two of several windows.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial import Chebyshev

from rodfem.codim2.criteria import Criterion, LocusPoint, Plane, Sought, interpolant
from rodfem.continuation.curves import lagrange, zero_between
from rodfem.continuation.kinds import GAP
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine
from rodfem.output.words import number
from rodfem.tolerances import TINY

WINDOWS = tuple(0.064 / 2**i for i in range(11))  # half widths of windows, as arclengths, from wide to narrow
POINTS = 8  # points of a window: an even number, none of them in the middle, where the end of a fold is singular
PLACES = np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS)
"""Chebyshev's points of a window of half width one; what is sought must be in the inner half of it."""
UNPLACED = 1e-5
"""Uncertainty along the curve, an arclength, of what cannot be placed: what differences for a tangent displace."""
CERTAIN = 10.0
"""Uncertainties of a parameter by which it changes towards a turning point: less is the round-off of a constant."""
NONE = 1e-10
"""Part of a unit tangent along one parameter, or of a coupling over that with the other one, that is round-off: it has
no sign."""
PARTS = 13  # of a step that shows a turning point or a cusp: an odd number, as its middle is likely to be one
DOUBLE_ZERO = Sought(lambda n: n.omega2, stationary=False)
"""The end of a curve of flutter: its double eigenvalue vanishes."""
QUARTIC = Sought(lambda n: n.curvature, stationary=False)
"""Where a pitchfork is neither super- nor subcritical."""
KIND = "pitchfork changes its kind"
ENDS = "the fold ends on a branch point"
DIVERGES = "the double eigenvalue vanishes: divergence"
PASSES = "the fold passes a branch point"
"""Marks of rows; at the last one the coupling vanishes as well, but the fold goes on."""
Row = tuple[LocusPoint, str]  # a point of a locus and the kind of its mark
Test = Callable[[LocusPoint], float]  # what vanishes at a point of codimension two


@dataclass(frozen=True)
class Place:
    """Arclength ``s`` from the middle of a window of this ``half`` width, and its uncertainty ``ds``."""

    s: float
    ds: float
    through: list[Chebyshev]  # both parameters in the arclength
    nodes: list[LocusPoint]
    half: float
    apart: np.ndarray  # difference (2,) of the parameters by another window
    windows: tuple[float, ...] = ()

    @property
    def p(self) -> np.ndarray:
        """Both parameters there, (2,)."""
        return self._parameters(self.s)

    @property
    def dp(self) -> np.ndarray:
        """Uncertainties of both parameters that those along the curve bring, (2,)."""
        return np.maximum(*(abs(self._parameters(self.s + side) - self.p) for side in (-self.ds, self.ds)))

    def _parameters(self, s: float) -> np.ndarray:
        return np.array([float(q(s)) for q in self.through])

    def interpolated(self, node: LocusPoint) -> LocusPoint:
        """The point there by the polynomials alone, with what ``node``, close by, has else: nothing is solved for."""
        across = np.max([n.located_to for n in self.nodes], axis=0)
        x = combine([n.x for n in self.nodes], lagrange(self.half * PLACES, self.s)[0])
        return replace(node, p=self.p, x=x, located_to=across + self.dp + self.apart)


def place(criterion: Criterion, node: LocusPoint, sought: Sought, windows: tuple[float, ...] = WINDOWS) -> Place:
    """Where ``sought`` is on the curve of a ``criterion`` through ``node``, close to it: the best of ``windows``."""
    best: Place | None = None
    other: Place | None = None
    for half in windows:
        try:
            here = _in_window(criterion, node, sought, half)
        except ConvergenceError:
            continue
        best, other = (here, best) if best is None or here.ds < best.ds else (best, here)
        if other is here:
            break
    if best is None or other is None:
        raise ConvergenceError("no two windows about the point hold the curve")
    both = (max(best.half, other.half), min(best.half, other.half))
    return replace(best, ds=3 * best.ds + abs(best.s - other.s), apart=abs(best.p - other.p), windows=both)


def _in_window(criterion: Criterion, node: LocusPoint, sought: Sought, half: float) -> Place:
    """Where ``sought`` is, by points of a window of this ``half`` width; raises :class:`ConvergenceError`."""
    t = half * PLACES
    nodes = [_tangent_point(criterion, node, float(s)) for s in t]
    tables = [[sought.of(n) for n in nodes], *np.array([n.p for n in nodes]).T]
    f, *through = (Chebyshev.fit(t, values, POINTS - 1, domain=[-half, half]) for values in tables)
    # each coefficient may be wrong by as much as the last two: by |T_k(0)| times that the value, |T_k'(0)| the slope
    order = np.arange(POINTS)
    odd = order % 2 == 1
    g, moves = (f.deriv(), np.where(odd, order / half, 0.0)) if sought.stationary else (f, np.where(odd, 0.0, 1.0))
    wrong = float(abs(f.coef[-2:]).max() * moves.sum())
    slope, s = g.deriv(), 0.0
    for _ in range(POINTS):  # Newton's method
        if not slope(s) or abs(s) > half / 2:
            break
        s -= float(g(s) / slope(s))
    ds = wrong / max(abs(float(slope(s))), TINY)
    if not abs(s) + ds < half / 2:
        raise ConvergenceError("what is sought is not in the window")
    return Place(s, ds, through, nodes, half, np.zeros(2))


def _tangent_point(criterion: Criterion, node: LocusPoint, s: float) -> LocusPoint:
    """Point that is at ``s`` on the tangent of ``node``, corrected; ConvergenceError out of the bounds."""
    p = node.p + s * node.dp
    if criterion.plane.outside(p) is not None:
        raise ConvergenceError("the window leaves the bounds")
    return criterion.correct((p, node.x + node.dx * s, node.dp, node.dx), node)


class Codim2Points:
    """Finds what lies between two nodes of a locus of a ``criterion``."""

    def __init__(self, criterion: Criterion) -> None:
        self.criterion, self.plane = criterion, criterion.plane

    def rows(self, a: LocusPoint, b: LocusPoint) -> tuple[list[Row], str]:
        """Rows between two nodes, and why the curve ends there, or nothing."""
        if _reverses(a, b, NONE * self.plane.width):
            coupling = self.located(a, b, lambda n: float(n.coupling @ a.coupling))
            if coupling is None or _coupling_vanishes(coupling, a, b, 0.05):
                share = float(a.coupling @ a.coupling) / float((a.coupling - b.coupling) @ a.coupling)
                row, where = self._end(a, b, share, coupling and self._end_of_fold(coupling, a, b))
                return [(row, ENDS)], f"{ENDS} {where}, or turns back within {GAP:g} of the bounds from one"
        if a.omega2 * b.omega2 < 0:
            zero = self.located(a, b, DOUBLE_ZERO.of)
            row, where = self._end(a, b, a.omega2 / (a.omega2 - b.omega2), zero and self._double_zero(zero, a))
            return [(row, DIVERGES)], f"{DIVERGES} {where}"
        return self._rows(a, b), ""

    def located(self, a: LocusPoint, b: LocusPoint, f: Test) -> LocusPoint | None:
        """Point between two others at which ``f`` vanishes; None where it cannot be located."""
        try:
            s = zero_between(lambda s: f(self._point(a, b, s)), a.s, b.s, 1e-8)  # an arclength: before it is placed
            return self._point(a, b, s)
        except (ConvergenceError, ValueError):
            return None

    # --- rows ------------------------------------------------------------------------------------------------------

    def _rows(self, a: LocusPoint, b: LocusPoint) -> list[Row]:
        """Turning points and cusps between two nodes: signs in parts of the step, if it shows one or may hide two."""
        turning, found = _changes(a, b), list[Row]()
        if a.curvature * b.curvature >= 0 and not (turning & _bends(a, b)).any():
            return found
        for p, q in pairwise([a, *self._parts(a, b), b]):
            if p.curvature * q.curvature < 0:
                found += self._cusp(p, q, a, b)
            else:
                found += self._turns(p, q, turning)
        return found

    def _parts(self, a: LocusPoint, b: LocusPoint) -> list[LocusPoint]:
        found = list[LocusPoint]()
        for share in np.arange(1, PARTS) / PARTS:
            with suppress(ConvergenceError):
                found.append(self._point(a, b, a.s + float(share) * (b.s - a.s)))
        return found

    def _cusp(self, p: LocusPoint, q: LocusPoint, a: LocusPoint, b: LocusPoint) -> list[Row]:
        """What is between two points of a step from ``a`` to ``b`` where the curvature has different signs."""
        cusp = self.located(p, q, lambda n: n.curvature)
        if cusp is None:
            return []
        if not (p.coupling.any() or q.coupling.any()):  # of branch points: at a double one the derivative has a pole
            vanishes = abs(cusp.curvature) < min(abs(p.curvature), abs(q.curvature))
            return [(self._placed(cusp, QUARTIC), KIND)] if vanishes else []
        if _coupling_vanishes(cusp, a, b, 1e-3):  # the place of a cusp is known to no more
            # no solution locates it: corrections slide along the curve of branch points
            return [(_enclosure(cusp, p, q), PASSES)]
        return [(self._placed(cusp, _reversal(self.plane, p, q)), "cusp")]

    def _turns(self, a: LocusPoint, b: LocusPoint, turning: np.ndarray) -> list[Row]:
        """Points at which one of the parameters ``turning`` turns, and differs from both ends by more than noise."""
        found = list[Row]()
        flat = np.minimum(abs(a.dp), abs(b.dp)) <= NONE * self.plane.width
        for i in np.flatnonzero((a.dp * b.dp < 0) & ~flat & turning):
            turn = self.located(a, b, lambda n, i=i: float(n.dp[i]))  # type: ignore[misc]
            sought = Sought(lambda n, i=i: float(n.p[i]), stationary=True)  # type: ignore[misc]
            if turn is not None and max(abs(turn.p - a.p)[i], abs(turn.p - b.p)[i]) > CERTAIN * turn.located_to[i]:
                found.append((self._placed(turn, sought), f"turns in {self.plane.names[i]}"))
        return sorted(found, key=lambda item: item[0].s)

    # --- where it is -----------------------------------------------------------------------------------------------

    def _point(self, a: LocusPoint, b: LocusPoint, s: float) -> LocusPoint:
        """Point of the curve between two nodes at an arclength; raises :class:`ConvergenceError`."""
        return replace(self.criterion.correct(interpolant(a, b, s), a), s=s)

    def _placed(self, node: LocusPoint, sought: Sought) -> LocusPoint:
        """The point near ``node`` that is ``sought``, with uncertainties of its place along the curve, too."""
        try:
            found = place(self.criterion, node, sought)
            better = _tangent_point(self.criterion, node, found.s)
        except ConvergenceError:
            along = np.maximum(abs(node.dp), UNPLACED * self.plane.width)
            return replace(node, located_to=node.located_to + UNPLACED * along)
        located = better.located_to + found.dp
        return replace(better, s=node.s + found.s, located_to=located, sought=sought, windows=found.windows)

    def _end_of_fold(self, node: LocusPoint, a: LocusPoint, b: LocusPoint) -> LocusPoint:
        """The end near ``node`` of a fold on a branch point, by interpolation between its two sides.

        No point can be corrected to it: the curve of branch points passes there, on which corrections may slide along.
        """
        node, sought = replace(self._on_cubic(a, b, node.s), p=node.p, x=node.x), _reversal(self.plane, a, b)
        try:
            found = place(self.criterion, node, sought)
        except ConvergenceError:
            return _enclosure(node, a, b)
        end = found.interpolated(node)
        end.ordinate = self.criterion.solver.shape.ordinate(end.x)
        return replace(end, s=node.s + found.s, sought=sought, windows=found.windows)

    def _double_zero(self, node: LocusPoint, a: LocusPoint) -> LocusPoint:
        """The end near ``node`` of flutter, with the count of the node ``a`` before: a double zero has no sign."""
        end = self._placed(node, DOUBLE_ZERO)
        return replace(end, rest=end.rest + len(end.modes) * (int(a.omega2 < 0) - int(end.omega2 < 0)))

    def _end(self, a: LocusPoint, b: LocusPoint, share: float, end: LocusPoint | None) -> tuple[LocusPoint, str]:
        """The last row and words for its place: ``end``, or if that is not in the step, at a ``share`` of it."""
        if end is None or self.criterion.length(end.p - a.p, end.x - a.x) > b.s - a.s:
            end = _enclosure(self._on_cubic(a, b, a.s + share * (b.s - a.s)), a, b)
        each = zip(self.plane.names, end.p, end.located_to, strict=True)
        return end, f"near {', '.join(f'{name} = {number(v, error)}' for name, v, error in each)}"

    def _on_cubic(self, a: LocusPoint, b: LocusPoint, s: float) -> LocusPoint:
        """Point of the cubic between two nodes, with what the first one has else."""
        p, x, dp, dx = interpolant(a, b, s)
        size = self.criterion.length(dp, dx)
        return replace(a, p=p, x=x, dp=dp / size, dx=dx / size, s=s, ordinate=self.criterion.solver.shape.ordinate(x))


def _reverses(a: LocusPoint, b: LocusPoint, least: np.ndarray) -> bool:
    """Whether coupling and tangent, above the ``least``, change their signs between two nodes, in each parameter.

    Beyond its end on a branch point a fold is its own mirror image, with the same parameters once more.
    """
    coupled, moves = _coupled(a, b), np.minimum(abs(a.dp), abs(b.dp)) > least
    turned = (a.coupling * b.coupling < 0)[coupled].all() and (a.dp * b.dp < 0)[moves].all()
    return bool(coupled.any() and moves.any() and turned)


def _coupling_vanishes(node: LocusPoint, a: LocusPoint, b: LocusPoint, share: float) -> bool:
    """Whether at most a ``share`` of the coupling at two nodes is left at ``node``, in all parameters."""
    size = np.minimum(abs(a.coupling), abs(b.coupling))
    return bool((abs(node.coupling) <= share * size)[_coupled(a, b)].all())


def _coupled(a: LocusPoint, b: LocusPoint) -> np.ndarray:
    """Whether the null vector is coupled with each of the parameters (2,) at two nodes, round-off apart."""
    size = np.minimum(abs(a.coupling), abs(b.coupling))
    return np.asarray(size > NONE * size.max())


def _enclosure(node: LocusPoint, a: LocusPoint, b: LocusPoint) -> LocusPoint:
    """A point of which no more is known than that it is as close as the farther one of two nodes."""
    return replace(node, located_to=np.maximum(abs(node.p - a.p), abs(node.p - b.p)) + a.located_to)


def _reversal(plane: Plane, a: LocusPoint, b: LocusPoint) -> Sought:
    """Where both parameters turn back at once between two nodes, as at a cusp: what turns most is stationary."""
    turned = (b.dp - a.dp) / plane.width**2
    return Sought(lambda n: float(turned @ n.p), stationary=True)


def _bends(a: LocusPoint, b: LocusPoint) -> np.ndarray:
    """Whether each parameter (2,) turns between two nodes, or twice: its cubic is slower there than at both."""
    chord = (b.p - a.p) / (b.s - a.s)
    middle = np.sign(a.dp) * (3 * chord - (a.dp + b.dp) / 2)
    return np.asarray((a.dp * b.dp < 0) | (middle < np.minimum(abs(a.dp), abs(b.dp))))


def _changes(a: LocusPoint, b: LocusPoint) -> np.ndarray:
    """Whether each parameter (2,) may change between two nodes by more than its uncertainty: else nothing is sought."""
    most = np.maximum(abs(a.dp), abs(b.dp)) * (b.s - a.s)
    return np.asarray(most > CERTAIN * np.minimum(a.located_to, b.located_to))

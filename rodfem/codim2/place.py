r"""Where along a locus a turning point or an end is: by a polynomial through points of the curve near by.

Points of a locus are known to the last digits *across* it.  Where along it a parameter has its extremum, or a double
eigenvalue vanishes, is known less well; tangents by differences would displace it.  Points on both sides are therefore
corrected to the curve at Chebyshev's points of a window of the tangent, and what is sought is read from the polynomials
through them, with its uncertainty: the last two coefficients, which hold both the round-off of the points and what the
polynomial leaves out (L. N. Trefethen, *Approximation Theory and Approximation Practice*, SIAM 2013, chapters 3 and 8),
and the difference between two windows.  Too narrow windows amplify round-off, too wide ones leave out more: the best of
several is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Chebyshev

from rodfem.codim2.plane import Criterion, LocusPoint, Plane, Prediction, Sought
from rodfem.continuation.prediction import lagrange
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine
from rodfem.tolerances import TINY

WINDOWS = tuple(0.064 / 2**i for i in range(11))
"""Half widths of windows, as arclengths, from wide to narrow."""
POINTS = 8
"""Points of a window: an even number, none of them in the middle, where the end of a fold is singular."""
LAST, TIMES = 2, 3.0
"""Coefficients of a polynomial by which it is known how wrong the others are, and to which factor: they are few."""
INSIDE = 0.5
"""Part of the window, about its middle, in which what is sought must be."""


@dataclass(frozen=True)
class Place:
    """Arclength ``s`` from the middle of a window, and its uncertainty ``ds``.

    ``through`` are the polynomials of both parameters in the arclength, and ``nodes`` the points of a window of this
    ``half`` width.  By ``apart`` (2,) the parameters of another window differ; ``windows`` are the half widths of both.
    """

    s: float
    ds: float
    through: list[Chebyshev]
    nodes: list[LocusPoint]
    half: float
    apart: np.ndarray
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
        value, _ = lagrange(_arclengths(self.half), self.s)
        across = np.max([n.located_to for n in self.nodes], axis=0)
        x = combine([n.x for n in self.nodes], value)
        return replace(node, p=self.p, x=x, located_to=across + self.dp + self.apart)


def place(
    criterion: Criterion, plane: Plane, node: LocusPoint, sought: Sought, windows: tuple[float, ...] = WINDOWS
) -> Place:
    """Where ``sought`` is on the curve of a ``criterion`` through ``node``, close to it: the best of ``windows``.

    These are half widths, as arclengths, from wide to narrow.  Windows that cannot be filled, or that leave the bounds
    of the ``plane``, are passed over.  Raises :class:`ConvergenceError` where fewer than two can.
    """
    best: Place | None = None
    other: Place | None = None
    for half in windows:
        try:
            here = _in_window(criterion, plane, node, sought, half)
        except ConvergenceError:
            continue
        best, other = (here, best) if best is None or here.ds < best.ds else (best, here)
        if other is here:
            break
    if best is None or other is None:
        raise ConvergenceError("no two windows about the point hold the curve")
    both = (max(best.half, other.half), min(best.half, other.half))
    return replace(best, ds=TIMES * best.ds + abs(best.s - other.s), apart=abs(best.p - other.p), windows=both)


def _in_window(criterion: Criterion, plane: Plane, node: LocusPoint, sought: Sought, half: float) -> Place:
    """Where ``sought`` is, by points of a window of this ``half`` width; raises :class:`ConvergenceError`."""
    t = _arclengths(half)
    nodes = [criterion.onto(ahead(plane, node, float(s)), node) for s in t]
    tables = [[sought.of(n) for n in nodes], *np.array([n.p for n in nodes]).T]
    f, *through = (Chebyshev.fit(t, values, POINTS - 1, domain=[-half, half]) for values in tables)
    # each coefficient may be wrong by as much as the last two: by |T_k(0)| times that the value, |T_k'(0)| the slope
    order = np.arange(POINTS)
    odd = order % 2 == 1
    moves = np.where(odd, order / half, 0.0) if sought.stationary else np.where(odd, 0.0, 1.0)
    wrong = float(abs(f.coef[-LAST:]).max() * moves.sum())
    g = f.deriv() if sought.stationary else f
    slope, s = g.deriv(), 0.0
    for _ in range(POINTS):  # Newton's method
        if not slope(s) or abs(s) > INSIDE * half:
            break
        s -= float(g(s) / slope(s))
    ds = wrong / max(abs(float(slope(s))), TINY)
    if not abs(s) + ds < INSIDE * half:
        raise ConvergenceError("what is sought is not in the window")
    return Place(s, ds, through, nodes, half, np.zeros(2))


def ahead(plane: Plane, node: LocusPoint, s: float) -> Prediction:
    """Point on the tangent of ``node``; raises :class:`ConvergenceError` out of the bounds."""
    p = node.p + s * node.dp
    if plane.outside(p) is not None:
        raise ConvergenceError("the window leaves the bounds")
    return p, node.x + node.dx * s, node.dp, node.dx


def _arclengths(half: float) -> np.ndarray:
    """Chebyshev's points of a window of this ``half`` width, (POINTS,)."""
    return np.asarray(half * np.cos(np.pi * (np.arange(POINTS) + 0.5) / POINTS))

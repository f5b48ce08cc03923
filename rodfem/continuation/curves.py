"""Curves through states of a branch: polynomials, predictions by them, and zeros of what changes along them.

*Predictions* are polynomials through the last rows of a branch, or between two rows with their tangents.  Of a scene
with symmetries the rows are states of some orbits.  Where they are on these is arbitrary: a prediction stays where the
last row is.

A *zero* between two places at which signs differ is bracketed, by inverse quadratic interpolation: T. R. Chandrupatla,
Adv. Engrg. Software 28 (1997) 145-149.  ``scipy.optimize`` has the like, and takes a tenth of a second to load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import copysign
from sys import float_info

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine

VERTICAL = 1e-8
"""Slope of the load (in spans per unit of arclength) below which it counts as constant along a branch."""
ALIGNED = 0.9
"""Least cosine between the direction of a prediction and the tangent at the corrected point."""
ROWS = 4
"""Rows of a branch that a prediction extrapolates, at most."""
NEIGHBOURS = 4 * float_info.epsilon  # relative distance of neighbours


def lagrange(nodes: np.ndarray, s: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the values at ``nodes`` in their interpolating polynomial at ``s``, and in its derivative there."""
    known = [float(x) for x in nodes]
    value, slope = np.empty(len(known)), np.empty(len(known))
    for j, node in enumerate(known):
        p, dp, scale = 1.0, 0.0, 1.0
        for i, other in enumerate(known):
            if i != j:
                dp = dp * (s - other) + p
                p *= s - other
                scale *= node - other
        value[j], slope[j] = p / scale, dp / scale
    return value, slope


def predict(points: Sequence[Point], s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """State and direction at arclength ``s``: of the cubic of the last two points, or the last one and its tangent."""
    if len(points) > 1:
        return interpolant(points[-2], points[-1], s)
    last = points[-1]
    assert last.tangent is not None
    return combine([last.x, last.tangent], np.array([1.0, s - last.arclength])), last.tangent.copy()


def predict_at_load(system: System, points: Sequence[Point], load: float) -> PETSc.Vec:
    """Extrapolate equilibria at loads, the last of some ``points``, to another ``load``.

    Of a scene with symmetries it is the line through two: a polynomial of higher degree would magnify, from load to
    load, where these are on their orbits.
    """
    recent = points[-2 if system.drifts else -ROWS :]
    return combine([p.x for p in recent], lagrange(np.array([p.load for p in recent]), load)[0])


def cubic(ends: list[PETSc.Vec], h: float, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """Cubic of length ``h`` at ``s``, and its derivative, by the ``ends``: value and derivative of each."""
    value, slope = cubic_weights(h, s)
    return combine(ends, value), combine(ends, slope)


def cubic_weights(h: float, s: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights (4,) of values and slopes at both ends in their cubic of length ``h`` at ``s``, and in its derivative."""
    t = s / h
    value = np.array([(1 + 2 * t) * (1 - t) ** 2, h * t * (1 - t) ** 2, t * t * (3 - 2 * t), h * t * t * (t - 1)])
    return value, np.array([-6 * t * (1 - t) / h, (1 - t) * (1 - 3 * t), 6 * t * (1 - t) / h, t * (3 * t - 2)])


def interpolant(a: Point, b: Point, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """State and direction at ``s`` on the polynomial of least degree through two states and what tangents they have."""
    h = b.arclength - a.arclength
    if a.tangent is not None and b.tangent is not None:
        return cubic([a.x, a.tangent, b.x, b.tangent], h, s - a.arclength)
    way = (b.x - a.x) * (1.0 / h)
    for end, sign in ((a, 1.0), (b, -1.0)):
        if end.tangent is not None:
            d, bend = s - end.arclength, (way - end.tangent) * (sign / h)
            return combine([end.x, end.tangent, bend], np.array([1.0, d, d * d])), end.tangent + bend * (2 * d)
    return a.x + way * (s - a.arclength), way


def across_orbit(system: System, last: PETSc.Vec, x: PETSc.Vec, direction: PETSc.Vec) -> None:
    """Take from a prediction ``x`` and its ``direction``, in place, what moves the ``last`` state along its symmetries.

    The phase conditions of a row are those of its prediction, and leave such a part as it is; extrapolations would hand
    it on until it is most of a step.  The motions of the ``system`` are orthonormal in the metric.
    """
    system.set_phase(last)
    phase, generators = system.phase, system.at(last).generators
    for i, weights in phase.broken.items():
        motion, condition = system.new_vector(weights @ generators), phase.conditions[i]
        x.axpy(phase.offsets[i] - condition.dot(x), motion)
        direction.axpy(-condition.dot(direction), motion)


def zero_between(f: Callable[[float], float], a: float, b: float, within: float) -> float:
    """Zero of ``f`` between ``a`` and ``b``, ``within`` that of the exact one; raises ValueError for equal signs."""
    fa, fb = f(a), f(b)
    if fa * fb > 0:
        raise ValueError(f"The function has one sign, {copysign(1.0, fa):+g}, at both {a:g} and {b:g}.")
    part = 0.5
    while True:
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        # the smallest step, in parts of the bracket: across the zero, to the other side of the best point
        smallest = 0.5 * (within + NEIGHBOURS * abs(best)) / abs(b - a) if b != a else 1.0
        if least == 0.0 or smallest >= 0.5:
            return best
        x = a + min(max(part, smallest), 1 - smallest) * (b - a)
        fx = f(x)
        if (fx > 0) == (fa > 0):
            (c, fc), (a, fa) = (a, fa), (x, fx)
        else:
            (c, fc), (b, fb), (a, fa) = (b, fb), (a, fa), (x, fx)
        part, xi, phi = 0.5, (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:  # the quadratic has one value there
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)

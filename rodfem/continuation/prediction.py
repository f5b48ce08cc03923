"""Predictions of a branch: polynomials in arclength through its last rows, or between two rows with their tangents.

Of a scene with symmetries the rows are states of some orbits.  Where they are on these is arbitrary: a prediction stays
where the last row is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine

ALIGNED = 0.9
"""Least cosine between the direction of a prediction and the tangent at the corrected point."""
ROWS = 4
"""Rows of a branch that a prediction extrapolates, at most."""


class Knot(Protocol):
    """A state ``x`` of a curve, its place there, and the derivative of the curve; None where it is not known."""

    @property
    def arclength(self) -> float:
        """Its parameter."""

    @property
    def x(self) -> PETSc.Vec:
        """The state."""

    @property
    def tangent(self) -> PETSc.Vec | None:
        """The derivative."""


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


def weights(points: Sequence[Point], s: float) -> tuple[list[PETSc.Vec], np.ndarray, np.ndarray]:
    """Vectors whose combinations extrapolate a branch to arclength ``s``: weights of the state, and of its direction.

    From up to four points, or one and its tangent.  Raises :class:`ValueError` for one point without a tangent.
    """
    last = points[-1]
    if len(points) < 3:
        if last.tangent is None:
            raise ValueError("A branch of one point needs a tangent to be continued.")
        return [last.x, last.tangent], np.array([1.0, s - last.arclength]), np.array([0.0, 1.0])
    recent = points[-ROWS:]
    return [p.x for p in recent], *lagrange(np.array([p.arclength for p in recent]), s)


def predict(points: Sequence[Point], s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """Extrapolate a branch to arclength ``s``: state and direction, as :func:`weights`."""
    vectors, value, slope = weights(points, s)
    return combine(vectors, value), combine(vectors, slope)


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


def between(a: Knot, b: Knot, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """State and direction at ``s`` on the polynomial of least degree through two states and what tangents they have."""
    h = b.arclength - a.arclength
    if a.tangent is not None and b.tangent is not None:
        return cubic([a.x, a.tangent, b.x, b.tangent], h, s - a.arclength)
    way = (b.x - a.x) * (1.0 / h)
    if a.tangent is not None:
        d, bend = s - a.arclength, (way - a.tangent) * (1.0 / h)
        return combine([a.x, a.tangent, bend], np.array([1.0, d, d * d])), a.tangent + bend * (2 * d)
    if b.tangent is not None:
        d, bend = s - b.arclength, (b.tangent - way) * (1.0 / h)
        return combine([b.x, b.tangent, bend], np.array([1.0, d, d * d])), b.tangent + bend * (2 * d)
    return a.x + way * (s - a.arclength), way


def across_orbit(system: System, last: PETSc.Vec, x: PETSc.Vec, direction: PETSc.Vec) -> None:
    """Take from a prediction ``x`` and its ``direction``, in place, what moves the ``last`` state along its symmetries.

    The phase conditions of a row are those of its prediction, and leave such a part as it is; an extrapolation of rows
    that have one hands it on, from row to row a little more, until it is most of a step.  The motions ``g`` of the
    ``system`` are orthonormal in the metric: ``direction - g (Mg . direction)`` is what remains of the direction.
    """
    system.set_phase(last)
    phase, generators = system.phase, system.at(last).generators
    for i, weights in phase.broken.items():
        motion, condition = system.generators.vector(weights @ generators), phase.conditions[i]
        assert condition is not None
        x.axpy(phase.offsets[i] - condition.dot(x), motion)
        direction.axpy(-condition.dot(direction), motion)

r"""Quadrature of the resultants in a state: what an energy makes of it within an element.

An error bar compares two meshes.  What changes within an element, in the state, more sharply than the points of both
rules see, neither of them has: a material that stiffens within 1e-2 of a curvature, where the curvature passes that
value inside of the rod.  In a given state the resultants, the first derivatives of the energies with respect to the
strains and to what a potential depends on, are functions of the arclength, and their moments on an element

    I_j = int f(s) P_j(t) ds,    P_j the Legendre polynomials on the element, j = 0, 1, 2,

are known by a composite rule to any accuracy.  The error of the bar's two rules, that of the element and that of its
halves with one degree more, is compared as the bar assumes it: the second one's is at most the part ``left`` of the
first one's.  The largest ones of all elements are compared, as single ones agree by accident.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.fem.state_along import StateAlong
from rodfem.problem.gradients import Gradient, gradients

MOMENTS = 3
"""Number of moments that are compared."""
SEEN = 1e-8
"""Error of a moment, relative to the largest value times the length of the element, that no bar needs to hold: states
are solved for to 1e-10, and what varies along them by that is no change."""
NOISE = 100 * float(np.finfo(float).eps)
"""The same for the round-off of curvatures on so many elements, for each of them."""
LEAST = 1e-4
"""Values below this, over the natural energy of bending per length, are small: their round-off is no change."""
POINTS = 8
"""Points of the Gauss quadrature of a piece of an element."""
PIECES, MOST = 4, 256
"""Numbers of pieces of the composite rule to begin with, doubled until it is as good as it needs to be, and at most."""
GOOD = 0.1
"""Error of the composite rule over the one that it measures."""
AT_ONCE = 20_000
"""About so many places are evaluated at once."""

Moments = Callable[["Rule"], np.ndarray]


class Rule(NamedTuple):
    """``places`` in [0, 1] of an element, and the ``weights`` of the moments, (places, moments)."""

    places: np.ndarray
    weights: np.ndarray


class Errors(NamedTuple):
    """Largest error of the ``richer`` rule, and its largest ``change`` from the first, over the largest value."""

    richer: float
    change: float


class QuadratureAt:
    """Tells which resultants the rules of an error bar do not resolve in a state; collective over its ranks."""

    def __init__(self, shape: Shape, left: float) -> None:
        """Derive the resultants of the scene of a ``shape``; the part ``left`` of an error is left in the second rule.

        Parameters
        ----------
        shape
            Shape of the system of the first mesh.
        left
            Part of the error of the first mesh that a bar assumes in the result of the second one, nondimensional.
        """
        self.shape, self.left = shape, left
        equations, k = shape.system.equations, shape.system.fields.discretization.degree
        own, richer = (equations.quadrature_degree(degree) // 2 + 1 for degree in (k, k + 1))
        self._own, self._richer = composite(1, own), composite(2, richer)
        self._symbols, self._gradients = gradients(shape.system.scene)

    def __call__(self, x: PETSc.Vec) -> list[str]:
        """Return words for the functions whose resultants are not resolved in a state ``x``, each once."""
        if not self._gradients:
            return []
        along = StateAlong(self.shape, x, self._symbols)
        return list(dict.fromkeys(each.what for each in self._gradients if not self._resolved(each, along)))

    def _resolved(self, gradient: Gradient, along: StateAlong) -> bool:
        errors = self.errors(gradient, along)
        return errors.richer <= max(self.left / (1 - self.left) * errors.change, SEEN + NOISE * along.elements)

    def errors(self, gradient: Gradient, along: StateAlong) -> Errors:
        """Errors of the two rules in a state ``along`` the rod.

        Parameters
        ----------
        gradient
            Derivatives of a function of the scene.
        along
            The state.
        """
        block = max(1, AT_ONCE // (POINTS * PIECES))
        parts = []
        for first in range(0, along.elements, block):
            last = min(first + block, along.elements)
            largest = 0.0

            def moments(rule: Rule, first: int = first, last: int = last) -> np.ndarray:
                nonlocal largest
                values = gradient(along(rule.places, first, last))
                largest = max(largest, float(abs(values).max()))
                return np.asarray(values.reshape(len(values), last - first, -1) @ rule.weights)

            own, richer = moments(self._own), moments(self._richer)
            true = _true(moments, richer)
            parts.append((abs(richer - true).max(), abs(richer - own).max(), largest))
        error, change, size = np.max(parts, axis=0)
        scene = self.shape.system.scene
        size = max(size, LEAST * scene.units.moment / scene.length)  # of a straight rod all is round-off
        return Errors(error / size, change / size)


def _true(moments: Moments, richer: np.ndarray) -> np.ndarray:
    """Moments by a composite rule that is as good as the error of the ``richer`` ones is to be known."""
    pieces, last = PIECES, moments(composite(PIECES, POINTS))
    while pieces < MOST:
        pieces *= 2
        true = moments(composite(pieces, POINTS))
        if abs(true - last).max() <= GOOD * max(abs(richer - true).max(), SEEN * abs(true).max()):
            return true
        last = true
    return last


@cache
def composite(pieces: int, points: int) -> Rule:
    """Gauss rule of ``points`` on each of so many equal ``pieces`` of [0, 1]."""
    x, w = legendre.leggauss(points)
    places = ((np.arange(pieces)[:, None] + (x + 1) / 2) / pieces).ravel()
    return Rule(places, np.tile(w / (2 * pieces), pieces)[:, None] * legendre.legvander(2 * places - 1, MOMENTS - 1))

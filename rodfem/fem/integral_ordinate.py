r"""Integrals of a state over the rod: how much the quadrature of an ordinate leaves out.

An ordinate ``int f ds`` of a kink, a jump or a peak in the state has an error of its own: the rule's, on the first
mesh ``d = I - T``, with ``T`` the integral by a composite rule.  Two meshes may have such errors alike.  They are
known, as the integrand is, and what changes from one state to the other is the change of ``T``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.quadrature_at import AT_ONCE, POINTS, composite
from rodfem.fem.shape import Shape
from rodfem.fem.state_along import StateAlong
from rodfem.problem.gradients import is_polynomial
from rodfem.problem.pointwise import LocalState, along_rod
from rodfem.problem.values import Values, scalar

PIECES, MOST = 16, 256
"""Numbers of pieces of an element, of 8 points each, to begin with and at most."""
ENOUGH = 1e-14
"""Change of the integral with twice the pieces, relative to that of the absolute value, below which it is known."""


class Integral(NamedTuple):
    """Integral of a state by a composite rule, and how far it is uncertain."""

    value: float
    left: float


class IntegralOrdinate:
    """Ordinate of the scene of a ``shape`` by a composite rule, where it is an integral; collective over its ranks.

    Attributes
    ----------
    exists
        Whether the ordinate is an integral of what is no polynomial in the strains, positions and rotations.
    """

    def __init__(self, shape: Shape) -> None:
        """Write the integrand in symbols of the state at a place."""
        scene, self.shape = shape.system.scene, shape
        self.exists = not scene.ordinate.places
        if self.exists:
            self._at = LocalState(scene)
            of = scalar(scene.ordinate.of(along_rod(scene, self._at), self._at.constants))
            self.exists, self._of = not is_polynomial(of, self._at.units), Values(of)

    def __call__(self, x: PETSc.Vec) -> Integral:
        """Return the integral of a state ``x``."""
        along = StateAlong(self.shape, x, self._at)
        pieces, last = PIECES, np.inf
        while True:
            value, size = self._integral(along, pieces)
            left = abs(value - last)
            if left <= ENOUGH * size or pieces == MOST:
                return Integral(value, left)
            pieces, last = 2 * pieces, value

    def _integral(self, along: StateAlong, pieces: int) -> tuple[float, float]:
        """Integral by so many pieces of each element, and that of the absolute value."""
        rule, block = composite(pieces, POINTS), max(1, AT_ONCE // (POINTS * pieces))
        value = size = 0.0
        for first in range(0, along.elements, block):
            last = min(first + block, along.elements)
            weights = np.diff(along.ends[first : last + 1])[:, None] * rule.weights[:, 0]
            values = self._of(along(rule.places, first, last)).reshape(weights.shape)
            value, size = value + float((weights * values).sum()), size + float((weights * abs(values)).sum())
        return value, size

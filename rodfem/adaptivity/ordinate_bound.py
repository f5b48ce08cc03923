"""Bounds of the errors of ordinates, from two meshes: at a vertex, inside of an element, or of an integral.

A centreline misses ``h^(2d)`` at vertices, and inside of elements of degree d far more: ``h^(d+2)`` times an
oscillating polynomial, a combination of ``P_d`` and its neighbours.  Near a zero of it two meshes agree by accident,
and the richer one, whose polynomial has other zeros, may miss as much as the first.  What the polynomial amounts to on
the whole element does not cancel.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.tolerances import same_place


def bound(value: complex, richer: complex, left: float, rho: float, about: float = 0.0) -> float:
    """Bound of the error of a value of which ``rho`` is left in the ``richer`` one, itself uncertain by ``left``.

    Both results ``value`` and ``richer`` are loads, ordinates or coefficients, and ``left`` is in their unit, as is the
    largest change ``about`` such a value: by accident the value itself may change by less.
    """
    change = abs(richer - value)
    return change + rho / (1 - rho) * max(change, about) + left


class OrdinateBound:
    """Bounds the errors of ordinates of states on the mesh of a ``coarse`` shape by those of a ``richer`` one."""

    def __init__(self, coarse: Shape, richer: Shape) -> None:
        """Tabulate the weights of positions on the element."""
        self.coarse, self.richer = coarse, richer
        scene, fields = coarse.system.scene, coarse.system.fields
        vertices = fields.all_vertices()
        places = [p for p in scene.ordinate.places if not any(same_place(p, v, scene.length) for v in vertices)]
        tried = np.empty(0)
        for p in places:
            i = int(np.searchsorted(vertices, p))
            # three places for each zero of the polynomial
            tried = np.linspace(vertices[i - 1], vertices[i], 3 * fields.discretization.degree + 2)[1:-1]
        self._tried = [(float(s), coarse.weights(float(s)), richer.weights(float(s))) for s in tried]

    def __call__(self, x: PETSc.Vec, again: PETSc.Vec, left: float, rho: float) -> float:
        """Return a bound of the error of the ordinate of a state, ``x`` on the first mesh and ``again`` on the richer.

        ``left`` is the uncertainty of the ordinate of the richer one, by location and round-off, in its unit, and
        ``rho`` the part of the error that is left in it.
        """
        return bound(self.coarse.ordinate(x), self.richer.ordinate(again), left, rho, self._change(x, again))

    def _change(self, x: PETSc.Vec, again: PETSc.Vec) -> float:
        """Largest change of the ordinate over the element in which it is taken; none at a vertex, or of an integral.

        The ordinate is evaluated at its own place, with the changes of position and rotation of all others.
        """
        if not self._tried:
            return 0.0
        first, second = self.coarse.system.at(x), self.richer.system.at(again)
        of = self.richer.system.scene.ordinate
        r, q = self.richer.place(second, of.s or 0.0)
        value, largest = float(of.of(r, q)), 0.0
        for s, weights, richer in self._tried:
            before, after = self.coarse.place(first, s, weights), self.richer.place(second, s, richer)
            turned = q + after[1] - before[1]
            beside = of.of(r + after[0] - before[0], turned / np.sqrt(turned @ turned))
            largest = max(largest, abs(float(beside) - value))
        return largest

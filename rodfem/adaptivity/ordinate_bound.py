"""Bounds of the errors of ordinates, from two meshes: at a vertex, inside of an element, or of an integral.

A centreline misses ``h^(2d)`` at vertices, and inside of elements of degree d far more: ``h^(d+2)`` times an
oscillating polynomial, a combination of ``P_d`` and its neighbours.  Near a zero of it two meshes agree by accident,
and the richer one, whose polynomial has other zeros, may miss as much as the first.  What the polynomial amounts to on
the whole element does not cancel.

An ordinate ``int f ds`` of a kink, a jump or a peak in the state has an error of its own: the rule's, on the first
mesh ``d = I - T``, with ``T`` the integral by a composite rule.  Two meshes may have such errors alike.  They are
known, as the integrand is, and what changes from one state to the other is the change of ``T``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.fem.quadrature_check import Pieces
from rodfem.fem.shape import Shape
from rodfem.fem.system import System
from rodfem.problem.roles import derived
from rodfem.tolerances import same_place


class Integral(NamedTuple):
    """Integral of a state by a composite rule, and how far it is uncertain."""

    value: float
    left: float


class IntegralOrdinate:
    """Ordinate of the scene of a ``system`` by a composite rule, where it is an integral; collective over its ranks."""

    def __init__(self, system: System) -> None:
        """Cut the elements."""
        self.system, self._pieces = system, derived(system.equations, Pieces, lambda: Pieces(system.equations))

    def __call__(self, x: PETSc.Vec) -> Integral:
        """Return the integral of a state ``x``."""
        state, form = self.system.at(x), self.system.equations.ordinate
        assert form is not None
        self.system.equations.take(state.line)
        values, number = state.local[self._pieces.dofs], self._pieces.number
        mine = [self._pieces.integral(form, values, pieces) for pieces in (2 * number, number)]
        value, coarse = (float(self.system.comm.allreduce(part)) for part in mine)
        return Integral(value, abs(value - coarse))


class Inside:
    """Changes of the ordinate over the element in which it is taken; none at a vertex, or of one that is an integral.

    Of states on the discretisation of the ``coarse`` shape and on that of the ``richer`` one; collective.
    """

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

    def change(self, x: PETSc.Vec, again: PETSc.Vec) -> float:
        """Largest change of the ordinate from a state ``x`` on the coarse mesh to ``again``, that on the richer.

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
        """Tabulate what is needed at the place of the ordinate, or the integrand."""
        self.coarse, self.richer = coarse, richer
        self._inside = Inside(coarse, richer)
        integral = not coarse.system.scene.ordinate.places
        self._integrals = [IntegralOrdinate(shape.system) for shape in (coarse, richer)] if integral else []

    def __call__(self, x: PETSc.Vec, again: PETSc.Vec, left: float, rho: float) -> float:
        """Return a bound of the error of the ordinate of a state.

        Parameters
        ----------
        x, again
            The state on the two meshes.
        left
            Uncertainty of the ordinate of the richer one, by location and round-off, in its unit.
        rho
            Part of the error that is left in it.
        """
        value = self.coarse.ordinate(x)
        if not self._integrals:
            return bound(value, self.richer.ordinate(again), left, rho, self._inside.change(x, again))
        here, there = (of(y) for of, y in zip(self._integrals, (x, again), strict=True))
        return abs(value - here.value) + here.left + there.left + bound(here.value, there.value, left, rho)

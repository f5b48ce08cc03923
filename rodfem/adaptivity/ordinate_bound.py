"""Bounds of the errors of ordinates, from two meshes: at a vertex, inside of an element, or of an integral."""

from __future__ import annotations

from petsc4py import PETSc

from rodfem.adaptivity.inside import Inside
from rodfem.fem.integral_ordinate import IntegralOrdinate
from rodfem.fem.shape import Shape


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

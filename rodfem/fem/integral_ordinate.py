r"""Integrals of a state over the rod: how much the quadrature of an ordinate leaves out.

An ordinate ``int f ds`` of a kink, a jump or a peak in the state has an error of its own: the rule's, on the first
mesh ``d = I - T``, with ``T`` the integral by a composite rule.  Two meshes may have such errors alike.  They are
known, as the integrand is, and what changes from one state to the other is the change of ``T``.
"""

from __future__ import annotations

from typing import NamedTuple

from petsc4py import PETSc

from rodfem.fem.quadrature_check import Pieces
from rodfem.fem.system import System


class Integral(NamedTuple):
    """Integral of a state by a composite rule, and how far it is uncertain."""

    value: float
    left: float


class IntegralOrdinate:
    """Ordinate of the scene of a ``system`` by a composite rule, where it is an integral; collective over its ranks."""

    def __init__(self, system: System) -> None:
        """Cut the elements."""
        self.system, self._pieces = system, Pieces(system)

    def __call__(self, x: PETSc.Vec) -> Integral:
        """Return the integral of a state ``x``."""
        state, form = self.system.at(x), self.system.equations.ordinate
        assert form is not None
        self.system.equations.take(state.line)
        values, number = state.local[self._pieces.dofs], self._pieces.number
        mine = [self._pieces.integral(form, values, pieces) for pieces in (2 * number, number)]
        value, coarse = (float(self.system.comm.allreduce(part)) for part in mine)
        return Integral(value, abs(value - coarse))

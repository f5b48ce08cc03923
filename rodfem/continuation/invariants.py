r"""Invariants of a state, checked at every point that a branch accepts: it is an equilibrium, of unit quaternions.

Newton's method ends with a small correction.  Here the equations themselves are evaluated at the state of the record:
balance of forces and moments, tested with every shape function, the constraints, and the phase conditions.  A rigid
motion that the ends allow is a sum of shape functions, so that the balance of the whole rod is among them; with one
that they do not allow the equations of clamped nodes, which are none of the unknowns', give the reactions.  What is
left must be round-off: below :data:`UNBALANCED` in units of the rod's own energy, or below the round-off of the
product of the second variation with the state.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError

UNBALANCED = 1e-8
"""Residual of an equilibrium, in units of the rod's own energy."""
ROUND_OFF = 1e3 * float(np.finfo(float).eps)
"""The same relative to the product of the second variation with the state."""
UNIT = 1e-8
"""Largest difference of the squared norm of a quaternion from one."""


class Invariants:
    """Checks the points of one solver; collective over its ranks."""

    def __init__(self, solver: BranchSolver) -> None:
        """Allocate a vector for the residual."""
        self.solver, self.system = solver, solver.system
        self._equations = solver.system.new_vector()

    def __call__(self, point: Point) -> None:
        """Check a point; raises :class:`ConvergenceError` that names the equation, or the norm, that is violated."""
        found = self.solver.checked(point.x)
        if found is not None and found.residual <= UNBALANCED and found.norm <= UNIT:
            return
        self._unit_quaternions(point)
        system, residual = self.system, self._equations
        system.set_phase(point.x)
        system.at(point.x).residual(residual)
        left = system.in_units(residual, 1)
        if left.norm(PETSc.NormType.INFINITY) > UNBALANCED:
            self._unbalanced(point, left)

    def _unit_quaternions(self, point: Point) -> None:
        fields = self.system.fields
        if "q" not in fields.dofs:
            return
        norms = np.sum(self.system.at(point.x).values("q") ** 2, axis=-1)
        worst = float(abs(norms - 1.0).max(initial=0.0))
        worst = worst if fields.comm.size == 1 else fields.comm.allreduce(worst, op=MPI.MAX)
        if not worst <= UNIT:
            raise ConvergenceError(
                f"{self._at(point)} a quaternion has a squared norm that differs from one by {worst:.1e}: use more "
                "elements or smaller steps."
            )

    def _unbalanced(self, point: Point, left: PETSc.Vec) -> None:
        """Raise the error on a residual that is no round-off."""
        system = self.system
        self.solver.inertia.at(point.x)
        size = system.matrix_in_units(self.solver.inertia.matrix).norm(PETSc.NormType.INFINITY)
        size *= system.in_units(point.x, -1).norm(PETSc.NormType.INFINITY)
        left.abs()
        number, worst = left.max()
        if not worst <= max(UNBALANCED, ROUND_OFF * size):
            raise ConvergenceError(
                f"{self._at(point)} the state is no equilibrium: the equation of {self._equation(number)} is violated "
                f"by {worst:.1e}; use smaller steps."
            )

    def _equation(self, number: int) -> str:
        """Name of the unknown with a ``number``, whose equation is that of the same row."""
        fields = self.system.fields
        found = [name for name, i in fields.scalars.items() if i == number]
        found += [name for name, dofs in fields.dofs.items() if (fields.number[dofs] == number).any()]
        return str(next(name for names in fields.comm.allgather(found) for name in names))

    def _at(self, point: Point) -> str:
        return f"At {self.system.scene.load} = {point.load:.8g}"

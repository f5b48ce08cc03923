r"""Invariants of a state, checked at every point that a branch or a sweep accepts.

It is an equilibrium, of unit quaternions.
Newton's method ends with a small correction.  Here the equations themselves are evaluated at the state of the record:
balance of forces and moments, tested with every shape function, the constraints, and the phase conditions.  What is
left must be round-off: below :data:`UNBALANCED` in units of the rod's own energy, or below the round-off of the product
of the second variation with the state.

So must be what is left of the balance of the whole rod.  Stored energy and the constraint ``r' = R v`` are invariant
under the rigid motions ``g`` of space, also when discretised: all equations ``F``, those of clamped nodes included,
which are the reactions ``F_c``, tested with ``g`` are minus the work of the loads.  Reactions of the ends, their
moments, and loads thus add up to

    sum_c F_c . g + loads . g = -sum_f F_f . g

with the sum over the nodes ``f`` that are free (Antman, Nonlinear Problems of Elasticity, 2005, chapter 8, in weak
form).  Each term of a fine mesh is as small as its elements; the sum is not.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.fem.generators import Generators
from rodfem.fem.symmetries import capable

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

    @cached_property
    def _matrix(self) -> PETSc.Mat:
        """Room for the second variation, which only a residual that is not small needs."""
        return self.system.state_matrix()

    @cached_property
    def _rigid(self) -> Generators:
        """Rigid motions of space of which the rod is capable."""
        return Generators(self.system, capable(self.system.fields))

    def __call__(self, point: Point) -> None:
        """Check a point; raises :class:`ConvergenceError` that names the equation, or the norm, that is violated."""
        self._unit_quaternions(point)
        system, residual = self.system, self._equations
        system.set_phase(point.x)
        system.at(point.x).residual(residual)
        left = system.in_units(residual, 1)
        if left.norm(PETSc.NormType.INFINITY) > UNBALANCED:
            self._unbalanced(point, left)
        if not self._small(point, left.norm(PETSc.NormType.NORM_1)):
            self._balance_of_the_rod(point, residual)

    def _small(self, point: Point, total: float) -> bool:
        """Whether residuals whose sum is ``total``, in natural units, are too small to be felt in any rigid motion.

        None changes an unknown by more than the largest of them, or by one.
        """
        largest = self.system.in_units(point.x, -1).norm(PETSc.NormType.INFINITY)
        return bool(total * max(largest, 1.0) <= UNBALANCED)

    def _balance_of_the_rod(self, point: Point, residual: PETSc.Vec) -> None:
        """Raise :class:`ConvergenceError` where reactions and loads do not balance each other."""
        system, motions = self.system, self._rigid.at(self.system.at(point.x))
        own = residual.array_r.real[: motions.shape[1]]
        work = motions @ own
        work = work if system.comm.size == 1 else system.comm.allreduce(work, op=MPI.SUM)
        work = abs(work) / system.scene.units.energy
        worst = int(work.argmax()) if work.size else 0
        if work.size and not work[worst] <= max(UNBALANCED, self._round_off(point)):
            name = str(self._rigid.motions[worst])
            what = "moments" if name.startswith("rotation") else "forces"
            raise ConvergenceError(
                f"{self._at(point)} reactions and loads do not balance: their {what} add up to {work[worst]:.1e} for a "
                f"{name}, in units of bending; use more elements or smaller steps."
            )

    def _round_off(self, point: Point) -> float:
        """Round-off of the product of the second variation with the state, in natural units."""
        system, matrix = self.system, self._matrix
        matrix.zeroEntries()
        system.at(point.x).assemble_into(matrix, system.equations.jacobian)
        matrix.assemble()
        size = system.matrix_in_units(matrix).norm(PETSc.NormType.INFINITY)
        return ROUND_OFF * float(size * system.in_units(point.x, -1).norm(PETSc.NormType.INFINITY))

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
        sizes = left.copy()
        sizes.abs()
        number, worst = sizes.max()
        if not worst <= max(UNBALANCED, self._round_off(point)):
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

r"""Checks of the rows of a branch: each is an equilibrium, and each step ends on the branch that it began on.

Newton's method ends with a small correction.  At the state of a row the equations themselves are evaluated: balance of
forces and moments, tested with every shape function, the constraints, and the phase conditions.  What is left must be
round-off: below :data:`VIOLATED` in units of the rod's own energy, or below the round-off of the product of the second
variation with the state.  Quaternions have unit norm.

A branch is the integral of its unit tangent in arclength, ``x_b - x_a = int_a^b t ds``.  With the tangents at the last
rows interpolated (Adams-Moulton weights) what is left of that equation, the *defect*, is of a higher order in the step
than the correction of a prediction.  Between rows of two branches it is at least their distance (Allgower & Georg,
Introduction to Numerical Continuation Methods, 2003, 6.1, on path jumping).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import ROWS, BranchSolver, lagrange
from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.matrices import EPS
from rodfem.linalg.orthogonal import combine

VIOLATED = 1e-8
"""Residual of an equilibrium, in units of the rod's own energy, and difference of a squared norm from one."""
ROUND_OFF = 1e3 * EPS
"""Residual relative to the product of the second variation with the state."""
GAUSS = 0.5 / np.sqrt(3.0)
"""Distance of the two points of Gauss' rule from the middle of a piece of length one: exact for cubics."""


def defect(system: System, rows: Sequence[Point]) -> float:
    """Size, in the metric, of ``x_b - x_a - int_a^b t ds`` across the chord of the last two of the ``rows``.

    Lengths are those of chords, so that the component along the chord is left out.  ``t`` is interpolated through the
    last rows with tangents, on one mesh.
    """
    a, b = rows[-2:]
    known = [p for p in rows[-ROWS:] if p.tangent is not None]
    nodes, length = np.array([p.arclength for p in known]), b.arclength - a.arclength
    first, second = (lagrange(nodes, a.arclength + (0.5 + sign * GAUSS) * length)[0] for sign in (-1, 1))
    rest, chord = combine([p.tangent for p in known], first + second), b.x - a.x
    rest.aypx(-length / 2, chord)
    image = system.metric * chord
    rest.axpy(-image.dot(rest) / image.dot(chord), chord)
    return float(system.norm(rest))


class RowCheck:
    """Checks that points of one solver are equilibria of unit quaternions; collective over its ranks."""

    def __init__(self, solver: BranchSolver) -> None:
        """Allocate a vector for the residual."""
        self.solver, self.system = solver, solver.system
        self._equations = solver.system.new_vector()

    def __call__(self, point: Point) -> None:
        """Check a point; raises :class:`ConvergenceError` that names the equation, or the norm, that is violated."""
        where = f"At {self.system.scene.load} = {point.load:.8g}"
        stretched = self._stretched(point.x)
        if not stretched <= VIOLATED:
            raise ConvergenceError(
                f"{where} a quaternion has a squared norm that differs from one by {stretched:.1e}: use more elements "
                "or smaller steps."
            )
        number, worst = self._residual(point.x)
        if not worst <= VIOLATED and not worst <= self._round_off(point.x):
            raise ConvergenceError(
                f"{where} the state is no equilibrium: the equation of {self._equation(number)} is violated by "
                f"{worst:.1e}; use smaller steps."
            )

    def _residual(self, x: PETSc.Vec) -> tuple[int, float]:
        """Number and size, in natural units, of the largest residual."""
        self.system.set_phase(x)
        self.system.at(x).residual(self._equations)
        sizes = self.system.in_units(self._equations, 1)
        sizes.abs()
        return sizes.max()

    def _round_off(self, x: PETSc.Vec) -> float:
        """Round-off of the product of the second variation with the state, in natural units."""
        system, matrix = self.system, self.system.state_matrix()
        system.at(x).assemble_into(matrix, system.equations.jacobian)
        matrix.assemble()
        sizes = system.matrix_in_units(matrix), system.in_units(x, -1)
        return ROUND_OFF * float(np.prod([size.norm(PETSc.NormType.INFINITY) for size in sizes]))

    def _stretched(self, x: PETSc.Vec) -> float:
        """Largest difference of the squared norm of a quaternion from one."""
        fields = self.system.fields
        if "q" not in fields.dofs:
            return 0.0
        norms = np.sum(self.system.at(x).values("q") ** 2, axis=-1)
        worst = float(abs(norms - 1.0).max(initial=0.0))
        return worst if fields.comm.size == 1 else float(fields.comm.allreduce(worst, op=MPI.MAX))

    def _equation(self, number: int) -> str:
        """Name of the unknown with a ``number``, whose equation is that of the same row."""
        fields = self.system.fields
        found = [name for name, i in fields.scalars.items() if i == number]
        found += [name for name, dofs in fields.dofs.items() if (fields.number[dofs] == number).any()]
        return str(next(name for names in fields.comm.allgather(found) for name in names))

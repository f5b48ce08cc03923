r"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load
couples the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real
axis: flutter.

Eigenvalues are found by shift-invert.  A complex shift ``a + i b`` needs no complex PETSc: with vectors written
as pairs of their real and imaginary parts, ``S - (a + i b) M`` is the real matrix ::

    ( S - a M     b M   )
    (  -b M     S - a M )

whose pencil with ``diag(M, M)`` has the eigenvalues ``mu - (a + i b)`` and their conjugates; those with vectors
of the form ``(x, -i x)`` belong to the first kind.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.errors import ConvergenceError
from rodfem.stability.pencil import assemble_pencil, shift_invert
from rodfem.system import System


@dataclass(frozen=True)
class Frequencies:
    """Eigenvalues ``mu = omega^2`` in ascending order of their real parts, and their backward errors."""

    values: np.ndarray
    errors: np.ndarray

    def unstable(self, tolerance: float) -> int:
        """Number of eigenvalues with a negative real part or a non-zero imaginary part."""
        return int(((self.values.real < -tolerance) | (abs(self.values.imag) > tolerance)).sum())


class Vibration:
    """Computes eigenvalues near a shift, at states of one :class:`~rodfem.system.System`."""

    def __init__(self, system: System) -> None:
        """Allocate the matrices of the pencil once."""
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.state_matrix()

    def assemble(self, x: PETSc.Vec) -> None:
        """Assemble the pencil at the state ``x``."""
        with self.system.clock("assembly"):
            assemble_pencil(self.system, x, self.matrix, self.mass)

    def asymmetry(self) -> tuple[int, float]:
        """Rank of the non-symmetric part of the tangent matrix, and its largest entry relative to the matrix's."""
        transposed = self.matrix.copy()
        transposed.transpose()
        transposed.axpy(-1.0, self.matrix, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        begin, end = transposed.getOwnershipRange()
        rows = [(i, *transposed.getRow(i)) for i in range(begin, end)]
        size = self.matrix.norm(PETSc.NormType.INFINITY)
        mine = [
            (i, j, v)
            for i, columns, values in rows
            for j, v in zip(columns, values, strict=True)
            if abs(v) > 1e-12 * size
        ]
        entries = [e for part in self.system.comm.allgather(mine) for e in part]
        used = sorted({i for i, _, _ in entries})
        small = np.zeros((len(used), len(used)))
        for i, j, v in entries:
            small[used.index(i), used.index(j)] = v
        return (int(np.linalg.matrix_rank(small)), float(abs(small).max() / size)) if used else (0, 0.0)

    def near(self, number: int, target: complex) -> Frequencies:
        """Return the ``number`` (or more) eigenvalues nearest to ``target`` at the state last assembled."""
        with self.system.clock("stability"):
            values, errors = self._real(number, target.real) if target.imag == 0 else self._complex(number, target)
        order = np.lexsort((values.imag, np.round(values.real, 9)))
        return Frequencies(values[order], errors[order])

    def _real(self, number: int, target: float) -> tuple[np.ndarray, np.ndarray]:
        solver = shift_invert(self.matrix, self.mass, number, target, symmetric=False)
        self._run(solver)
        found = self._enough(solver, number)
        values = np.array([solver.getEigenvalue(i) for i in range(found)])
        errors = np.array([solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD) for i in range(found)])
        solver.destroy()
        return values, errors

    def _complex(self, number: int, target: complex) -> tuple[np.ndarray, np.ndarray]:
        a, b = target.real, target.imag
        shifted, upper = self.matrix.copy(), self.mass.copy()
        shifted.axpy(-a, self.mass, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        upper.scale(b)
        lower = upper.copy()
        lower.scale(-1.0)
        pencil = PETSc.Mat().createNest([[shifted, upper], [lower, shifted]], comm=self.system.comm).convert("aij")
        mass = PETSc.Mat().createNest([[self.mass, None], [None, self.mass]], comm=self.system.comm).convert("aij")
        solver = shift_invert(pencil, mass, 2 * number, 0.0, symmetric=False)
        self._run(solver)
        found = self._enough(solver, number)
        re, im = pencil.createVecRight(), pencil.createVecRight()
        kept: list[tuple[complex, float]] = []
        for i in range(found):
            shift = solver.getEigenpair(i, re, im)
            n = re.getLocalSize() // 2  # each rank holds its part of x, then its part of y
            x, y = re.array_r[:n] + 1j * im.array_r[:n], re.array_r[n:] + 1j * im.array_r[n:]
            first, second = self.system.comm.allreduce(
                np.array([np.linalg.norm(x + 1j * y) ** 2, np.linalg.norm(x - 1j * y) ** 2])
            )
            if first >= second:
                kept.append((target + shift, solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)))
        solver.destroy()
        for matrix in (shifted, upper, lower, pencil, mass):
            matrix.destroy()
        kept = kept[:number]
        return np.array([value for value, _ in kept]), np.array([error for _, error in kept])

    @staticmethod
    def _run(solver: SLEPc.EPS) -> None:
        try:
            solver.solve()
        except PETSc.Error as trouble:
            raise ConvergenceError(
                f"SLEPc gave up on the frequencies ({str(trouble).splitlines()[0]}): use a richer discretisation."
            ) from trouble

    def _enough(self, solver: SLEPc.EPS, number: int) -> int:
        found = solver.getConverged()
        if found < number:
            solver.destroy()
            raise ConvergenceError(
                f"SLEPc found {found} of {number} eigenvalues: ask for at most {found} at this discretisation."
            )
        return int(found)

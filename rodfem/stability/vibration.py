r"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load
couples the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real
axis: flutter.

Eigenvalues are found by shift-invert.  A complex PETSc takes a complex shift ``a + i b`` as it is, and is used where
it is what is installed.  A real one needs no more than twice the size: with vectors written as pairs of their real and
imaginary parts, ``S - (a + i b) M`` is the real matrix ::

    ( S - a M     b M   )
    (  -b M     S - a M )

whose pencil with ``diag(M, M)`` has the eigenvalues ``mu - (a + i b)`` and their conjugates; those with vectors
of the form ``(x, -i x)`` belong to the first kind.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem import compat
from rodfem.errors import ConvergenceError
from rodfem.factors import PETSC_ERR_LIB
from rodfem.stability import character
from rodfem.stability.dense import finite_eigenpairs
from rodfem.stability.pencil import assemble_pencil, shift_invert
from rodfem.system import System

FAR = 1e5
"""How many times farther from the shift than the third nearest an eigenvalue may be.

The pencil has infinite eigenvalues with Jordan blocks of size two, one for each pair of constraint and multiplier,
which round-off smears to finite ones about ``1/sqrt(eps)`` times farther than the nearest: those are not kept.
"""
DENSE = 3
"""A pencil smaller than this many Krylov spaces is solved by dense reductions: it may have few finite eigenvalues."""
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Frequencies:
    """Eigenvalues ``mu = omega^2`` in ascending order of their real parts, and their backward errors.

    ``kinds`` names the motion of each: see :mod:`rodfem.stability.character`.  ``vectors`` (n, k) are complex, with the
    n unknowns of this rank.
    """

    values: np.ndarray
    errors: np.ndarray
    kinds: tuple[str, ...] = ()
    vectors: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))

    def unstable(self, tolerance: float) -> int:
        """Number of eigenvalues with a negative real part or a non-zero imaginary part."""
        return int(((self.values.real < -tolerance) | (abs(self.values.imag) > tolerance)).sum())


@dataclass(frozen=True)
class _Pair:
    """An eigenvalue, the real and imaginary part of its vector on this rank, and its backward error."""

    value: complex
    parts: list[np.ndarray]
    error: float


class Vibration:
    """Computes eigenvalues near a shift, at states of one :class:`~rodfem.system.System`."""

    def __init__(self, system: System) -> None:
        """Allocate the matrices of the pencil once."""
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()
        self.turned = np.zeros((0, 0, 4))

    def assemble(self, x: PETSc.Vec) -> None:
        """Assemble the pencil at the state ``x``."""
        with self.system.clock("assembly"):
            assemble_pencil(self.system, x, self.matrix, self.mass)
            f = self.system.fields
            self.turned = f.u.x.array[f.dofs[f.turning.name]]

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
        """Return eigenvalues nearest to ``target`` at the state last assembled: ``number``, or more where they come.

        Fewer are returned only where the discretisation has no more finite ones.  A pencil hardly larger than the
        Krylov space for ``number`` of them is solved by dense reductions.
        """
        with self.system.clock("stability"):
            if self.matrix.getSize()[0] < DENSE * (2 * number + 20):
                found = self._dense()
            elif target.imag == 0 or compat.COMPLEX:
                found = self._shifted(number, target)
            else:
                found = self._doubled(number, target)
            found = sorted(found, key=lambda p: abs(p.value - target))[: number + 2]
            third = abs(found[min(2, len(found) - 1)].value - target)
            found = [p for p in found if abs(p.value - target) <= FAR * third]
            kinds = [character.name(character.shares(self.system, self.turned, p.parts)) for p in found]
        order = sorted(range(len(found)), key=lambda i: (round(found[i].value.real, 9), found[i].value.imag))
        return Frequencies(
            np.array([found[i].value for i in order]),
            np.array([found[i].error for i in order]),
            tuple(kinds[i] for i in order),
            np.stack(
                [found[i].parts[0] + 1j * (0.0 if len(found[i].parts) < 2 else found[i].parts[1]) for i in order], 1
            ),
        )

    def left(self, number: int, target: complex) -> Frequencies:
        """Return the same of the transposed pencil: ``vectors`` are left ones, ``z.S = mu z.M`` without conjugation."""
        kept = self.matrix
        self.matrix = kept.copy()
        self.matrix.transpose()
        try:
            return self.near(number, target)
        finally:
            self.matrix.destroy()
            self.matrix = kept

    def _dense(self) -> list[_Pair]:
        """All finite eigenvalues of a pencil that is small enough for dense matrices, the same on all ranks."""
        S, M = (np.vstack(self.system.comm.allgather(dense_rows(A).real)) for A in (self.matrix, self.mass))
        values, vectors = finite_eigenpairs(S, M)
        if len(values) == 0:
            raise ConvergenceError("The rod has no inertia: give it a mass, or a rotary inertia.")
        begin, end = self.matrix.getOwnershipRange()
        own = vectors[begin:end]
        return [_Pair(complex(w), [x.real.copy(), x.imag.copy()], EPS) for w, x in zip(values, own.T, strict=True)]

    def _shifted(self, number: int, target: complex) -> list[_Pair]:
        """Solve with a shift that this PETSc's numbers can express."""
        sigma = target if compat.COMPLEX else target.real
        solver = self._solve(self.matrix, self.mass, number, sigma)
        re, im = self.system.new_vector(), self.system.new_vector()
        out = []
        for i in range(solver.getConverged()):
            value = solver.getEigenpair(i, re, im)
            parts = character.halves(re) if compat.COMPLEX else [re.array_r.copy(), im.array_r.copy()]
            out.append(_Pair(complex(value), parts, solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)))
        solver.destroy()
        return out

    def _doubled(self, number: int, target: complex) -> list[_Pair]:
        """Solve with a complex shift by the real matrix of twice the size."""
        a, b = target.real, target.imag
        shifted, upper = self.matrix.copy(), self.mass.copy()
        shifted.axpy(-a, self.mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        upper.scale(b)
        lower = upper.copy()
        lower.scale(-1.0)
        pencil = PETSc.Mat().createNest([[shifted, upper], [lower, shifted]], comm=self.system.comm).convert("aij")
        mass = PETSc.Mat().createNest([[self.mass, None], [None, self.mass]], comm=self.system.comm).convert("aij")
        solver = self._solve(pencil, mass, 2 * number, 0.0)
        re, im = pencil.createVecRight(), pencil.createVecRight()
        out = []
        for i in range(solver.getConverged()):
            shift = solver.getEigenpair(i, re, im)
            n = re.getLocalSize() // 2  # each rank holds its part of x, then its part of y
            x, y = re.array_r[:n] + 1j * im.array_r[:n], re.array_r[n:] + 1j * im.array_r[n:]
            first, second = self.system.comm.allreduce(
                np.array([np.linalg.norm(x + 1j * y) ** 2, np.linalg.norm(x - 1j * y) ** 2])
            )
            if first >= second:
                vector = x + 1j * y
                error = solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)
                out.append(_Pair(target + shift, [vector.real.copy(), vector.imag.copy()], error))
        solver.destroy()
        for matrix in (shifted, upper, lower, pencil, mass):
            matrix.destroy()
        return out[:number]

    @staticmethod
    def _solve(matrix: PETSc.Mat, mass: PETSc.Mat, number: int, target: complex) -> SLEPc.EPS:
        """Run SLEPc; raises :class:`ConvergenceError` where it finds nothing at all.

        A small pencil has few finite eigenvalues, and a Krylov space that holds all of them breaks down on the Jordan
        blocks of the infinite ones: it is then made smaller.
        """
        while number:
            solver = shift_invert(matrix, mass, number, target, symmetric=False)
            try:
                solver.solve()
            except PETSc.Error as trouble:
                if trouble.ierr != PETSC_ERR_LIB:
                    raise
            else:
                if solver.getConverged():
                    return solver
            solver.destroy()
            number //= 2
        raise ConvergenceError(f"SLEPc found no eigenvalue near {target:.6g}: use a richer discretisation.")


def dense_rows(matrix: PETSc.Mat) -> np.ndarray:
    """Rows of a matrix that are on this rank, as a dense array (local rows, columns)."""
    dense = matrix.copy().convert("dense")
    return np.array(dense.getDenseArray())

"""Factors of matrices with a fixed pattern by MUMPS.

MUMPS serves rods on several ranks, and is the reference on one: what is factored along the rod
(:mod:`rodfem.linalg.chain`) may be factored by it as well (``Discretization(factors="petsc")``), with the same numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.tolerances import TINY

Sizes = Callable[[], PETSc.Vec]
"""Natural sizes of the unknowns of a matrix, asked for when it is factored."""
PETSC_ERR_LIB = 76
"""PETSc's error code for a failure in a library below."""
PIVOT = 1e-3
"""Threshold of the pivots of LDL^t, relative to the largest entry of a column."""
LONG = 20_000
"""Unknowns from which a rod on several ranks is long.

The elimination tree that QAMD makes of a chain is as deep as the chain is long: MUMPS in parallel gains nothing on it,
and at 1e5 elements its parallel analysis overflows its stack.
"""


def ordering(matrix: PETSc.Mat) -> dict[str, int]:
    """MUMPS's ordering for a matrix on all its ranks, which PETSc takes from its options only.

    QAMD (6) knows dense rows; PORD (4) makes balanced trees, slowly.
    """
    return {"mat_mumps_icntl_7": 4} if matrix.comm.size > 1 and matrix.size[0] >= LONG else {"mat_mumps_icntl_7": 6}


@contextmanager
def preferred(prefix: str, values: dict[str, Any]) -> Iterator[None]:
    """Give PETSc those of the options that nobody has set, while it reads them."""
    options = PETSc.Options(prefix)
    given = [name for name in values if not options.hasName(name)]
    for name in given:
        options.setValue(name, values[name])
    try:
        yield
    finally:
        for name in given:
            options.delValue(name)


class Mumps:
    """Factors ``lu``, or ``cholesky`` (LDL^t, which also counts the inertia), by MUMPS, on all ranks of a matrix.

    ``regular`` is false where the last one was exactly singular, so that it has no solutions.

    Unknowns are ordered by an approximate minimum degree that knows dense rows (QAMD): what MUMPS chooses by itself
    takes ten times as long to order the matrix of 3e4 elements with an integral constraint.  PETSc's options change
    that and all else, ``-rodfem_lu_mat_mumps_icntl_7 2`` or ``-rodfem_cholesky_...`` for example.

    MUMPS's own scaling is off.  A rod in units far from its natural ones has entries of very different sizes, and the
    count of negative pivots is wrong next to an eigenvalue: given the natural ``sizes`` d of the unknowns it is ``D A
    D`` that is factored, which has the same inertia.
    """

    def __init__(self, kind: str, sizes: Sizes | None = None) -> None:
        self.kind, self.sizes, self.prefix = kind, sizes, f"rodfem_{kind}_"
        self._scaled: PETSc.Mat | None = None
        self._scaled_from = 0
        self.room = 50
        self.ksp = PETSc.KSP()
        self.factor: PETSc.Mat | None = None
        self.regular = False
        self._matrix = 0

    def __call__(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises :class:`ConvergenceError` on all ranks where MUMPS gives up on one.

        Delayed pivots may need more room than was estimated.  PETSc does not raise by itself, and what a failed
        factorisation counts or solves is arbitrary: the factors are then made again with more room.
        """
        matrix = self._in_units(matrix)
        while True:
            if self.factor is None or matrix.handle != self._matrix:
                self._prepare(matrix)
            else:
                self.ksp.setOperators(matrix)
            self.ksp.setUp()
            status = self.ksp.getPC().getFactorMatrix().getMumpsInfog(1)
            if status not in (-8, -9, -19) or self.room > 10000:
                break
            self.room *= 4
            self.factor = None
        self.regular = status >= 0
        if status < 0:
            self._matrix = 0  # PETSc would not factor again what has failed: set it up anew next time
        if status < 0 and status != -10:  # -10 is a singular matrix
            raise ConvergenceError(f"MUMPS could not factor the bordered matrix: its status INFOG(1) is {status}.")

    def solve(self, right: PETSc.Vec, out: PETSc.Vec) -> None:
        """Solve with the last factors."""
        if self.sizes is None:
            self.ksp.solve(right, out)
        else:
            sizes = self.sizes()
            self.ksp.solve(right * sizes, out)
            out.pointwiseMult(out, sizes)

    def solve_all(self, right: np.ndarray) -> np.ndarray:
        """Solutions for all columns of ``right`` (own rows, k) at once."""
        sizes = np.ones(len(right)) if self.sizes is None else self.sizes().array_r.real
        columns, out = (self._dense(right.shape[1]) for _ in range(2))
        columns.getDenseArray()[:] = right * sizes[:, None]
        self.ksp.getPC().getFactorMatrix().matSolve(columns, out)
        return np.asarray(out.getDenseArray().real * sizes[:, None])

    def _dense(self, count: int) -> PETSc.Mat:
        """Zero matrix of ``count`` columns, each a vector of the matrix that is factored."""
        matrix = self.ksp.getOperators()[0]
        out = PETSc.Mat().createDense((matrix.getSizes()[0], (None, count)), comm=matrix.comm)
        out.setUp()
        out.assemble()
        return out

    def inertia(self) -> tuple[int, int]:
        """Number of negative eigenvalues of the symmetric matrix last factored, and of pivots that are zero."""
        negative, zero, _ = self.ksp.getPC().getFactorMatrix().getInertia()
        return int(negative), int(zero)

    def _in_units(self, matrix: PETSc.Mat) -> PETSc.Mat:
        """Matrix for unknowns in units of their natural sizes: itself where those are one."""
        if self.sizes is None:
            return matrix
        sizes = self.sizes()
        if self._scaled is None or matrix.handle != self._scaled_from:
            self._scaled, self._scaled_from = matrix.copy(), matrix.handle
        else:  # a new pattern would make PETSc forget all controls
            matrix.copy(self._scaled, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self._scaled.diagonalScale(sizes, sizes)
        return self._scaled

    def _prepare(self, matrix: PETSc.Mat) -> None:
        self.ksp.destroy()
        self.ksp.create(matrix.comm)
        self.ksp.setType("preonly")
        self.ksp.setOptionsPrefix(self.prefix)
        pc = self.ksp.getPC()
        pc.setType(self.kind)
        pc.setFactorSolverType("mumps")
        self.ksp.setFromOptions()
        self.ksp.setOperators(matrix)
        pc.setFactorSetUpSolverType()
        self.factor, self._matrix = pc.getFactorMatrix(), matrix.handle
        self.factor.setOptionsPrefix(self.prefix)  # made before PETSc's own set-up, it has none
        self.factor.setMumpsIcntl(14, self.room)
        self.factor.setMumpsIcntl(8, 0)  # no scaling
        if self.kind == "cholesky":
            self.factor.setMumpsIcntl(13, 1)  # the root of the tree is on one rank, which counts
            self.factor.setMumpsIcntl(24, 1)  # MUMPS reports the inertia
            self.factor.setMumpsCntl(3, -TINY)  # no pivot is taken for zero
            self.factor.setMumpsCntl(1, PIVOT)
        with preferred(self.prefix, ordering(matrix)):
            self.ksp.setUp()

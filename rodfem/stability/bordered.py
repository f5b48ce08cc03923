"""A matrix with dense borders that make it regular where it is singular."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.chain import factors_of
from rodfem.stability.inertia import inertia_factors


class Bordered:
    """A square ``matrix`` of a system with a number of dense ``borders``, a column and a row each, and its factors.

    Those of a symmetric one, ``constraints`` of whose eigenvalues are negative whatever the state, count the rest;
    None: it is not symmetric, and nothing is counted.
    """

    def __init__(self, system: System, matrix: PETSc.Mat, borders: int, constraints: int | None) -> None:
        self.system, self.k, self.constraints = system, borders, constraints
        self.comm, self.last = system.comm, system.has_scalars
        self.extra = borders if self.last else 0
        self.n = system.fields.unknowns
        start, columns, _ = matrix.getValuesCSR()
        rows = len(start) - 1
        lengths = np.concatenate([np.diff(start) + borders, np.full(self.extra, self.n + borders)])
        self.start = np.concatenate([[0], np.cumsum(lengths)]).astype(PETSc.IntType)
        own = int(self.start[rows])
        self._border = np.zeros(own, dtype=bool)
        self._border[(self.start[1 : rows + 1, None] - 1 - np.arange(borders)[::-1]).ravel()] = True
        self.columns = np.empty(self.start[-1], dtype=PETSc.IntType)
        self.columns[:own][~self._border] = columns
        self.columns[:own][self._border] = np.tile(self.n + np.arange(borders), rows)
        self.columns[own:] = np.tile(np.arange(self.n + borders), self.extra)
        self.values, self.own = np.zeros(self.start[-1]), own
        size = (rows + self.extra, self.n + borders)
        self.matrix = PETSc.Mat().createAIJ((size, size), comm=self.comm)
        self.matrix.setPreallocationCSR((self.start, self.columns, self.values))
        along = self.n + borders if system.fields.along else 0
        sizes = along, system.fields.dense_rows + borders
        natural = None if system.natural_sizes is None else self._sizes
        if constraints is None:
            self.factors = factors_of("lu", self.comm, *sizes, natural)
        else:
            self.factors = inertia_factors(self.comm, *sizes, natural)
        self.right, self.out, self.residual = (self.matrix.createVecRight() for _ in range(3))

    def _sizes(self) -> PETSc.Vec:
        """Natural sizes of the unknowns; the multipliers of the borders have those of drifts."""
        out, own = self.matrix.createVecRight(), self.system.balanced.array_r
        out.set(self.system.scene.units.energy**0.5)
        out.array[: len(own)] = own
        return out

    def factor(self, matrix: PETSc.Mat, columns: list[PETSc.Vec], rows: list[PETSc.Vec] | None = None) -> int:
        """Factor with a matrix of the same pattern; its negative eigenvalues off the borders, -1 without a count.

        The ``rows`` of the borders are the ``columns`` unless given.  Raises :class:`ConvergenceError` if it is
        singular.
        """
        self.values[: self.own][~self._border] = matrix.getValuesCSR()[2].real
        local = [np.stack([v.array_r.real for v in side], axis=1) for side in (columns, rows or columns)]
        self.values[: self.own][self._border] = local[0].ravel()
        parts = self.comm.gather(local[1], root=self.comm.size - 1)
        if parts is not None:
            below = np.zeros((self.k, self.n + self.k))
            below[:, : self.n] = np.concatenate(parts).T
            self.values[self.own :] = below.ravel()
        self.matrix.setValuesCSR(self.start, self.columns, self.values)
        self.matrix.assemble()
        with self.system.clock("stability"):
            self.factors(self.matrix)
            if self.constraints is None:
                if not self.factors.regular:
                    raise ConvergenceError("another eigenvalue vanishes")
                return -1
            negative, zero = self.factors.inertia()
        rest = negative - self.constraints - self.system.phase.count - self.k
        if zero or rest < 0:
            raise ConvergenceError("another eigenvalue vanishes")
        return int(rest)

    def solve(self, f: PETSc.Vec | None, g: np.ndarray) -> tuple[PETSc.Vec, np.ndarray]:
        """Solve for the right-hand side ``(f, g)``, with one step of iterative refinement."""
        with self.system.clock("solve"):
            out, right = self.out, self.right
            right.set(0.0)
            rows = right.getLocalSize() - self.extra
            if f is not None:
                right.array[:rows] = f.array_r
            if self.last:
                right.array[rows:] = g
            self.factors.solve(right, out)
            self.matrix.mult(out, self.residual)
            self.residual.aypx(-1.0, right)
            self.factors.solve(self.residual, right)
            out.axpy(1.0, right)
            x = self.system.new_vector()
            x.array[:] = out.array_r[:rows]
            return x, np.array(self.comm.bcast(out.array_r[rows:].copy(), root=self.comm.size - 1))

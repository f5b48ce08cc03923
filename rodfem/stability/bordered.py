"""The saddle matrix of a state with dense borders that make it regular where it is singular."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import Inertia, inertia_factors


class Bordered:
    """The symmetric matrix ``S`` of a state with dense borders, its LDL^t factors and its count."""

    def __init__(self, inertia: Inertia, borders: int) -> None:
        """Allocate for a number of borders, with the pattern of the matrix that ``inertia`` has assembled."""
        self.inertia, self.k = inertia, borders
        self.system = inertia.system
        self.comm, self.last = self.system.comm, self.system.has_scalars
        self.extra = borders if self.last else 0
        self.n = self.system.fields.unknowns
        start, columns, _ = self.inertia.matrix.getValuesCSR()
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
        self.factors = inertia_factors(self.comm, self.n + borders, self.system.fields.dense_rows + borders)
        self.right, self.out, self.residual = (self.matrix.createVecRight() for _ in range(3))

    def factor(self, psi: list[PETSc.Vec]) -> int:
        """Factor with ``S`` as last assembled; negative eigenvalues of ``S`` off the borders."""
        self.values[: self.own][~self._border] = self.inertia.matrix.getValuesCSR()[2]
        local = np.stack([v.array_r for v in psi], axis=1)
        self.values[: self.own][self._border] = local.ravel()
        parts = self.comm.gather(local, root=self.comm.size - 1)
        if parts is not None:
            rows = np.zeros((self.k, self.n + self.k))
            rows[:, : self.n] = np.concatenate(parts).T
            self.values[self.own :] = rows.ravel()
        self.matrix.setValuesCSR(self.start, self.columns, self.values)
        self.matrix.assemble()
        with self.system.clock("stability"):
            self.factors(self.matrix)
            negative, zero = self.factors.inertia()
        rest = negative - self.inertia.constraints - self.system.active_drifts() - self.k
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

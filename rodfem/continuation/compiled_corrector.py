"""Newton's method, tangent and index at a state by symmetric factors along the rod, in one call of compiled code.

The same as :class:`~rodfem.continuation.corrector.Corrector` does step by step (``rodfem/fem/newton.c``).
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.compiled_newton import CompiledNewton, Ended, Limits
from rodfem.fem.state import State
from rodfem.linalg.chain import Chain
from rodfem.linalg.compiled import buffer
from rodfem.stability.inertia import FRESH, Factored, Inertia


class CompiledCorrector(CompiledNewton):
    """The compiled iteration with the matrix and the factors of one :class:`~rodfem.stability.inertia.Inertia`.

    Attributes
    ----------
    tangent
        Unit tangent at the state last factored, (n,).
    """

    def __init__(self, inertia: Inertia, block: int, near_zero: float) -> None:
        """Allocate the vectors that are iterated inversely, ``block`` of them.

        ``near_zero`` is the distance of an eigenvalue from zero below which ``S`` of the ``inertia`` is too near
        singular.
        """
        assert isinstance(inertia.factors, Chain)
        super().__init__(inertia.system, inertia.matrix, inertia.factors)
        self.inertia, n = inertia, inertia.system.fields.unknowns
        fresh = np.stack([inertia.seed(i).array_r.real for i in range(block)])
        self._fresh = fresh, np.ascontiguousarray(inertia.weighed(fresh.T).T)
        self._vectors = np.zeros((block, n)), np.zeros((block, n))
        self.tangent = np.zeros(n)
        b = self.block = self.ffi.new("Block *")
        b.block, b.share, b.near_zero = block, FRESH, near_zero
        self.memory.point(b, vectors=self._vectors[0], images=self._vectors[1])
        self.memory.point(b, fresh=self._fresh[0], fresh_images=self._fresh[1])
        self.memory.point(b, **{name: np.zeros((block + 2) * n) for name in ("right", "solved")})
        self.memory.point(b, tangent=self.tangent, step=np.zeros(n))
        self.restart()

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        for mine, fresh in zip(self._vectors, self._fresh, strict=True):
            mine[:] = fresh
        self.block.started = 0

    @property
    def nearest(self) -> float:
        """Estimated distance of the eigenvalue nearest zero from zero, at the state last factored."""
        return float(self.block.nearest)

    def factor(self, x: PETSc.Vec) -> Factored | None:
        """Factor ``S`` at ``x``, with the phase conditions as they are; None where it is too near singular."""
        self._take()
        failed = self.lib.factor_at(self.rod, self.block, buffer(self.ffi, x.array_r))
        self.factors.adopt(regular=not failed)
        found = self.hold()
        return None if failed else found

    def correct(self, x: PETSc.Vec, row: PETSc.Vec, limits: Limits) -> Ended:
        """As the base class; ``x`` is as it was also where ``S`` is too near singular."""
        outcome = super().correct(x, row, limits)
        if self.newton.factorisations:  # else the matrix holds what it held before
            self.hold()
        return outcome

    def hold(self) -> Factored:
        """The state that the matrix holds now, and its factors."""
        self.inertia.border.array[:] = self.border
        return self.inertia.hold()

    def last_factored(self) -> tuple[State, PETSc.Vec] | None:
        """The iterate that the last correction factored last, and the equations there; None where it factored none."""
        if not self.newton.factorisations:
            return None
        x, equations = self.system.new_vector(), self.system.new_vector()
        x.array[:], equations.array[:] = self.factored, self.equations
        return self.system.at(x), equations

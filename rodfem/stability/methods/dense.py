"""All eigenvalues of the reduced pencil by LAPACK: an oracle for small systems."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.stability.dense import eigenvalues_near, symmetric_eigenpairs
from rodfem.stability.method import NEAR_ZERO, Found, Interval, Method
from rodfem.stability.pencil import scale_in_units

LARGEST = 3000
"""Unknowns that dense matrices may have."""
EXACT = np.finfo(float).eps
"""Backward error of LAPACK's eigenvalues."""


class Dense(Method):
    """Matrices without zeros."""

    @staticmethod
    def refusal(system: System) -> str:
        """More than :data:`LARGEST` unknowns."""
        unknowns = system.fields.unknowns
        return "" if unknowns <= LARGEST else f"is for at most {LARGEST} unknowns, not {unknowns}"

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """By the symmetric eigenvalue problem in the metric of the mass."""
        below = self.work.below(x)
        values, vectors = symmetric_eigenpairs(self.work.pencil(x), below.shift, number)
        errors = np.full(len(values), EXACT)
        return Found(self.work.one * values, self.work.lift(vectors), errors, below.certifies(values))

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """By the QZ algorithm."""
        values = eigenvalues_near(self.work.pencil(x), NEAR_ZERO * scale_in_units(self.work.system))
        values = values[np.argsort(abs(values), kind="stable")[:number]]
        order = np.lexsort((values.imag, np.round(values.real, 9)))
        return Found(self.work.one * values[order], [], np.full(len(values), EXACT))

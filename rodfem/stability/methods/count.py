"""Inertia of the saddle matrix at the shifts -tol and +tol, for conservative loads: the index, no eigenvalues."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.stability.method import Found, Interval, SymmetricMethod


class Count(SymmetricMethod):
    """Every verdict on a conservative state has its index by the count: nothing else is done."""

    finds_modes = False

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """Nothing."""
        return Found(np.zeros(0), [], np.zeros(0), certified=True)

"""SLEPc on the singular pencil, with a shift below its spectrum; eigenvalues nearest zero of one without symmetry."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.stability.method import Found, Interval, Method


class ShiftInvert(Method):
    """One sparse factorisation serves eigenvalues and count."""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """By the Lanczos method."""
        modes = self.work.symmetric.at(x).leftmost(number)
        return Found(modes.values, modes.vectors, modes.errors, modes.certified)

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """By the Arnoldi method."""
        near = self.work.nonsymmetric.at(x).near_zero(number)
        nearest = np.sort(np.argsort(abs(near.values), kind="stable")[:number])
        return Found(near.values[nearest], [], near.errors[nearest], factorisations=1)

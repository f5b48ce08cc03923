"""Shift-invert on the pencil reduced to the kernel of its constraints, as in the paper."""

from __future__ import annotations

from petsc4py import PETSc

from rodfem.stability import reduction
from rodfem.stability.method import NEAR_ZERO, Found, Interval, Method
from rodfem.stability.pencil import scale_in_units


class Reduction(Method):
    """A Krylov space of the reduced pencil."""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """With a shift below the spectrum."""
        below = self.work.below(x)
        found = reduction.Reduction(self.work.pencil(x)).near(number, below.shift)
        certified = below.certifies(found.values)
        vectors = self.work.lift(found.vectors)
        return Found(self.work.one * found.values, vectors, found.errors, certified, reduction.FACTORISATIONS)

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """With a shift near zero."""
        target = NEAR_ZERO * scale_in_units(self.work.system)
        found = reduction.Reduction(self.work.pencil(x)).near(number, target)
        return Found(self.work.one * found.values, [], found.errors, factorisations=1)

"""Cayley's transform of the pencil reduced to the kernel of its constraints, with the paper's parameters."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.stability.method import Found, Interval, SymmetricMethod
from rodfem.stability.reduction import FACTORISATIONS, Reduction, cayley_parameters
from rodfem.stability.workspace import Workspace
from rodfem.tolerances import SAME_EIGENVALUE

APART = 1e-3
"""Eigenvalues closer than this, relative to the greatest, are one for the parameters of the transform."""
LEAST = 1e-3
"""Size of the greatest eigenvalue, at least, to which the others are compared."""


class Cayley(SymmetricMethod):
    """Its parameters are from estimates, or from the last state."""

    def __init__(self, work: Workspace) -> None:
        """There is no last state."""
        super().__init__(work)
        self._estimates: tuple[float, float] | None = None

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """With the parameters of the last state; with new ones where a count finds some missing."""
        below = self.work.below(x)
        reduction = Reduction(self.work.pencil(x))
        most = reduction.projection.kernel.dimension
        made, note = 0, ""
        for fresh in (False, True):
            if self._estimates is None or fresh:
                self._estimates = two_distinct(reduction.near(3, below.shift).values)
                made += FACTORISATIONS
            shift, antishift = cayley_parameters(*self._estimates)
            try:
                # the first two are equally far from the shift: more are asked for than wanted where they are multiple
                found = reduction.near(min(number + 2, most), shift, "cayley", antishift)
            except ConvergenceError:
                continue
            made += FACTORISATIONS
            first = found.values[0] - SAME_EIGENVALUE * max(abs(found.values).max(), LEAST)
            if found.certified and below.below(first) == 0:
                break
        else:
            found = reduction.near(number, below.shift)
            made += FACTORISATIONS
            note = ", but a count found some missing (equal eigenvalues): completed by shift-invert"
        if number > 1:
            self._estimates = two_distinct(found.values)
        values, vectors = found.values[:number], self.work.lift(found.vectors[:, :number])
        certified = below.certifies(values)
        return Found(self.work.one * values, vectors, found.errors[:number], certified, made, note)


def two_distinct(values: np.ndarray) -> tuple[float, float]:
    """The least of ``values``, and the next one that is not equal to it."""
    first = float(values[0])
    others = values[values > first + APART * abs(values).max()]
    return first, float(others[0]) if len(others) else first + 0.5 * abs(values).max()

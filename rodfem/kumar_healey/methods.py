r"""The paper's method for the left-most eigenvalues: reduction with a shift, and with that of its Cayley transform.

The transform ``(mu - a2) / (mu - a1)`` with ``a1 = (mu1 + mu2) / 2`` and ``a2 = 2 mu2 - a1`` is 3 at the first
eigenvalue, -1 at the second, and less than one in size beyond: the first dominates.  Along a branch the two are
estimated by those of the point before.  It belongs to the matrix

    (K - a1 M)^-1 (K - a2 M) = 1 + (a1 - a2) (K - a1 M)^-1 M,

whose Krylov spaces are those of ``(K - a1 M)^-1 M`` for any ``a2``: shift-invert with the shift ``a1``.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.kumar_healey.coordinates import Coordinates
from rodfem.kumar_healey.reduction import Reduced
from rodfem.kumar_healey.reduction import Reduction as ReducedPencil
from rodfem.stability.methods import NEAR_ZERO, Found, Interval, Method, SymmetricMethod, Workspace
from rodfem.stability.pencil import scale_in_units

APART = 1e-3
"""Eigenvalues closer than this, relative to the greatest, are one for the parameters of the transform."""


class Reduction(Method):
    """A Krylov space of the reduced pencil."""

    def __init__(self, work: Workspace) -> None:
        """Work in tangent coordinates."""
        super().__init__(work)
        self.coordinates = Coordinates(work.system)

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """With a shift below the spectrum."""
        below = self.work.below(x)
        found = self.reduced(x).near(number, below.shift)
        return self.lifted(found, below.certifies(found.values), 1)

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """With a shift near zero."""
        found = self.reduced(x).near(number, NEAR_ZERO * scale_in_units(self.work.system))
        return Found(self.work.one * found.values, [], found.errors, factorisations=1)

    def reduced(self, x: PETSc.Vec) -> ReducedPencil:
        """The reduced pencil at ``x``, symmetry modes left out."""
        return ReducedPencil(self.coordinates.without_modes(x, self.work.sizes))

    def lifted(self, found: Reduced, certified: bool, factorisations: int, note: str = "") -> Found:
        """What was ``found``, as vectors of the system and in its units, with ``factorisations`` and a ``note``.

        It is ``certified`` where a count finds no more.
        """
        vectors = self.coordinates.lift(found.vectors, self.work.sizes)
        return Found(self.work.one * found.values, vectors, found.errors, certified, factorisations, note)


class Cayley(Reduction, SymmetricMethod):
    """Its shift is from estimates of the two left-most eigenvalues, or from those of the last state."""

    def __init__(self, work: Workspace) -> None:
        """There is no last state."""
        super().__init__(work)
        self._shift: float | None = None

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """With the shift of the last state; with a new one where a count finds some missing."""
        below, reduced = self.work.below(x), self.reduced(x)
        made, note = 0, ""
        for fresh in (False, True):
            if self._shift is None or fresh:
                self._shift = cayley_shift(reduced.near(3, below.shift).values)
                made += 1
            try:
                # the first two are equally far from the shift: more are asked for than wanted where they are multiple
                found = reduced.near(min(number + 2, reduced.kernel.dimension), self._shift)
            except ConvergenceError:
                continue
            made += 1
            found = Reduced(found.values[:number], found.vectors[:, :number], found.errors[:number])
            if certified := below.certifies(found.values):
                break
        else:
            found = reduced.near(number, below.shift)
            certified = below.certifies(found.values)
            made += 1
            note = ", but a count found some missing (equal eigenvalues): completed by shift-invert"
        if number > 1:
            self._shift = cayley_shift(found.values)
        return self.lifted(found, certified, made, note)


def cayley_shift(values: np.ndarray) -> float:
    """``a1``, the mean of the first of ascending ``values`` (k,), k > 0, and of the next that is not equal."""
    others = values[values > values[0] + APART * abs(values).max()]
    return float((values[0] + others[0]) / 2) if len(others) else float(values[0] + abs(values).max() / 4)

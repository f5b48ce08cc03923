r"""Tangent and index of a regular point from one symmetric factorisation at that state.

At fixed load the saddle matrix ``S`` of a conservative rod is symmetric.  With ``F_lam``, the derivative of the
equations in the load, ``z = (-S^-1 F_lam, 1)`` is a tangent of the branch, and the inertia of the factors is the index
(see :mod:`rodfem.stability.inertia`).

``S`` is singular at a fold, and a count says nothing about eigenvalues within its tolerance: both show in the same
solves.  A block of vectors ``v`` is carried along the branch and iterated inversely, once a point; the least
``|v| / |S^-1 M v|`` is an upper bound of the distance of the nearest eigenvalue from zero, and an estimate as good as
the block is rich in its vector: 1e-3 of a generic vector is added every time, and a vector whose eigenvalue is within
the tolerance, 1e-7 of the usual, grows by 1e7.  If that is too near zero, the tangent is by LU factors of the bordered
matrix, and two shifts count.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import FRESH, Factored, Index, Inertia
from rodfem.tolerances import TINY

BLOCK = 2
"""Number of vectors that are iterated along a branch."""
NEAR = 1e-3
"""Distance of an eigenvalue from zero, over the lowest bending eigenvalue, below which the two shifts count."""


@dataclass(frozen=True)
class RegularPoint:
    """A state whose factors serve: no eigenvalue is near zero.

    Attributes
    ----------
    index
        Its index and zeros by the count of the factors; None where an eigenvalue is too near zero for one count.
    nearest
        Estimated distance of the eigenvalue nearest zero from zero.
    tangent
        Unit tangent, on the side of increasing load.
    """

    index: Index | None
    nearest: float
    tangent: PETSc.Vec

    def along(self, row: PETSc.Vec) -> PETSc.Vec:
        """Unit tangent on the side to which ``row`` points."""
        return self.tangent * -1.0 if row.dot(self.tangent) < 0 else self.tangent


class RegularPoints:
    """Regular points among the states of one :class:`~rodfem.stability.inertia.Inertia`."""

    def __init__(self, inertia: Inertia) -> None:
        """Begin a branch."""
        self.inertia, self.system = inertia, inertia.system
        self._fresh = np.stack([inertia.seed(i).array_r.real for i in range(BLOCK)], axis=1)
        self._fresh_images = inertia.weighed(self._fresh)
        self.restart()

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        self._block, self._images, self._started = self._fresh, self._fresh_images, False

    def at(self, x: PETSc.Vec) -> RegularPoint | None:
        """The regular point ``x``; None where an eigenvalue is too near zero, or a load has no potential."""
        inertia = self.inertia
        if not self.system.scene.conservative:  # S is not symmetric
            return None
        found = inertia.at(x)
        try:
            below = found.below(0.0)
        except ConvergenceError:  # exactly singular: two shifts count it, or tell what is wrong
            return None
        # inverse iteration: one step a point along a branch, three from generic vectors
        for _ in range(1 if self._started else 3):
            tangent, nearest = self._solve(found)
        self._started = nearest > NEAR * inertia.scale
        if not self._started:
            self.restart()
            return None
        certain = nearest >= NEAR * inertia.scale + 10 * inertia.tolerance
        return RegularPoint(Index(below, found.drifts, nearest) if certain else None, nearest, self._unit(tangent))

    def _unit(self, own: np.ndarray) -> PETSc.Vec:
        """Unit vector of these own rows, with one for the load."""
        tangent = self.system.new_vector()
        tangent.array[:] = own
        self.system.set_load(tangent, 1.0)
        tangent.scale(1.0 / self.system.norm(tangent))
        return tangent

    def _solve(self, found: Factored) -> tuple[np.ndarray, float]:
        """Change of state with the load, and the estimated distance of the eigenvalue nearest zero from zero.

        A step of inverse iteration.  All right-hand sides are solved for at once.
        """
        inertia = self.inertia
        block = self._block + FRESH * self._fresh
        images = self._images + FRESH * self._fresh_images
        sizes = np.sqrt(inertia.sum((images * block).sum(axis=0)))
        with self.system.clock("solve"):
            solved = found.factors.solve_all(np.column_stack([found.border.array_r.real, images]))
        # |S^-1 M v| / |v| is at most one over the distance of the nearest eigenvalue from zero
        block = solved[:, 1:]
        images = inertia.weighed(block)
        grown = np.sqrt(np.maximum(inertia.sum((images * block).sum(axis=0)), TINY))
        growth = float((grown / sizes).max()) if np.isfinite(grown).all() else inf
        block, images = block / grown, images / grown
        for i in range(1, BLOCK):  # else all vectors of the block become the same one
            along = inertia.sum(images[:, i] @ block[:, :i])
            block[:, i] -= block[:, :i] @ along
            images[:, i] -= images[:, :i] @ along
        self._block, self._images = block, images
        return -solved[:, 0], 1.0 / growth

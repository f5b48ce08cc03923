"""What a criterion of a locus offers: its defining equations, as a corrector onto the curve."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from petsc4py import PETSc

from rodfem.codim2.parameter_plane import LocusPoint, Tangent
from rodfem.continuation.static_solver import StaticSolver
from rodfem.errors import ConvergenceError

SPLIT = 1.1
"""Times what eigenvalues, or the ``D`` of pairs, that are equal by a symmetry differ by that each may be off: to first
order."""


class Destroyed(ConvergenceError):
    """The special point changes its kind, or ends, along the locus; the message says why."""


class Criterion(Protocol):
    """Defining equations of a locus: a corrector onto it.

    ``solver`` has the mesh.  ``others`` says of a row that the number of unstable eigenvalues but for those of the
    locus has changed.
    """

    solver: StaticSolver
    others: str

    def length(self, dp: np.ndarray, dx: PETSc.Vec) -> float:
        """Size of a step."""

    def correct(
        self, p: np.ndarray, x: PETSc.Vec, tangent: Tangent, near: LocusPoint, reach: float = 1.0
    ) -> LocusPoint:
        """Point of the locus on the plane through ``(p, x)`` across ``tangent``.

        ``near`` is a point of the locus whose null vectors, or invariant subspace, are close by.  ``reach`` bounds how
        far ``x`` may move, in the metric.
        """

    def onto(self, p: np.ndarray, x: PETSc.Vec, tangent: Tangent, near: LocusPoint, reach: float = 1.0) -> LocusPoint:
        """The same point with its parameters, state and double eigenvalue alone: no tangent, modes or counts.

        ``p`` (2,), ``x``, ``tangent``, ``near`` and ``reach`` are those of :meth:`correct`, and so is what is raised.
        """

r"""One factorisation a point: Newton's method, the tangent, and the index from the same symmetric factors.

At fixed load the saddle matrix ``S`` of a conservative rod is symmetric; with ``F_lam`` the derivative of the equations
in the load and ``row`` the arclength equation Newton's matrix is ``J = (S F_lam; row)``.  Block elimination of the load
(Keller 1977) solves with ``J`` by the LDL^t factors of ``S`` alone,

    z = (-S^-1 F_lam, 1),    J^-1 (r, 0) = y - z (row . y) / (row . z),    y = (S^-1 r, 0),

``z`` is a tangent of the branch, and the inertia of the factors is the index (see :mod:`rodfem.stability.inertia`).
``S`` is singular at a fold, and a count says nothing about eigenvalues within its tolerance: both show in the same
solves.  A block of vectors ``v`` is carried along the branch and iterated inversely, once a point; the least
``|v| / |S^-1 M v|`` is an upper bound of the distance of the nearest eigenvalue from zero, and an estimate as good as
the block is rich in its vector: 1e-3 of a generic vector is added every time, and a vector
whose eigenvalue is within the tolerance, 1e-7 of the usual, grows by 1e7.  If that is too near zero, the
state is computed by LU factors of ``J``, and counted by two shifts.

The factors belong to the prediction, the index to the equilibrium.  From one to the other ``S`` changes by ``dS``.  Its
effect on the eigenvalues near zero is measured, not bounded beforehand: a rod that carries a force or a moment, or
whose energy is far from quadratic, may be a thousand times as sensitive as another.  The second variation at the
equilibrium is projected on the block ``Y``, by a difference of the equations along its first vector ``y``: ``y.dS y``
is the first-order change of that eigenvalue, the rest of ``Y^t dS y`` its coupling to the others.  The count at the
prediction is that of the equilibrium only where the distance of all eigenvalues from zero is many times as large; else
``S`` is factored, and counted, at the equilibrium itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import NewtonResult, iterate
from rodfem.fem.state import State
from rodfem.fem.system import dense_columns
from rodfem.stability.inertia import FRESH, Factored, Index, Inertia
from rodfem.tolerances import TINY

BLOCK = 2
"""Number of vectors that are iterated along a branch."""
NEAR = 1e-3
"""Distance of an eigenvalue from zero, over the lowest bending eigenvalue, below which the two shifts count."""
SENSITIVE = 100.0
"""Least change of an eigenvalue assumed when the state moves by one radian, in the same units."""
DIFFERENCE = 0.05
"""Step of the differences, relative to how far the equilibrium is from the prediction."""
SHORTEST = 1e-7
"""Least of these steps, in the metric: shorter ones differ by round-off."""
SAFE = 10.0
"""Least distance of all eigenvalues from zero, over the measured change of those carried along."""


@dataclass(frozen=True)
class Regular:
    """A state ``x`` whose factors serve: no eigenvalue is near zero.

    Attributes
    ----------
    found
        The factors.
    below
        Its index.
    nearest
        Estimated distance of the eigenvalue nearest zero from zero.
    tangent
        Unit tangent, on the side of increasing load.
    projected
        Products of the block with ``S y`` for its first vector ``y``, (BLOCK,).
    """

    x: PETSc.Vec
    found: Factored
    below: int
    nearest: float
    tangent: PETSc.Vec
    projected: np.ndarray

    @property
    def index(self) -> Index:
        """Index and zeros by the count of the factors."""
        return Index(self.below, self.found.drifts, self.found.factors.determinant())

    def along(self, row: PETSc.Vec) -> PETSc.Vec:
        """Unit tangent on the side to which ``row`` points."""
        tangent = self.tangent.copy()
        if row.dot(tangent) < 0:
            tangent.scale(-1.0)
        return tangent


class Corrector:
    """Newton's method with the factors of ``S`` at the states of one :class:`~rodfem.stability.inertia.Inertia`."""

    def __init__(self, inertia: Inertia) -> None:
        """Allocate right-hand sides, solutions and the block of vectors."""
        self.inertia, self.system = inertia, inertia.system
        system = self.system
        self._right, self._solved = dense_columns(system, BLOCK + 2), dense_columns(system, BLOCK + 2)
        self._step, self._image = system.new_vector(), system.new_vector()
        self._beside = system.new_vector()
        self._fresh = [inertia.seed(i) for i in range(BLOCK)]
        self._fresh_images = [inertia.metric * v for v in self._fresh]
        self.restart()

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        self._block = [v.copy() for v in self._fresh]
        self._images = [v.copy() for v in self._fresh_images]
        self._started = False

    def factor(self, x: PETSc.Vec, right: PETSc.Vec | None = None) -> Regular | None:
        """Factor ``S`` at ``x``; solve for the tangent, the block, and ``right`` (into ``_step``).

        None where they do not serve: an eigenvalue is too near zero, or a load has no potential.
        """
        inertia = self.inertia
        if not self.system.scene.conservative:  # S is not symmetric
            return None
        found = inertia.at(x, right)
        try:
            below = found.below(0.0)
        except ConvergenceError:  # exactly singular: two shifts count it, or tell what is wrong
            return None
        # inverse iteration: one step a point along a branch, three from generic vectors
        for _ in range(1 if self._started else 3):
            for i in range(BLOCK):
                self._block[i].axpy(FRESH, self._fresh[i])
                self._images[i].axpy(FRESH, self._fresh_images[i])
            tangent, nearest = self._solve(found, right)
        self._started = nearest > NEAR * inertia.scale
        if not self._started:
            self.restart()
            return None
        # y.S v for the first vector y of the block: the eigenvalue itself, and its couplings to the rest of the block
        found.matrix.mult(self._block[0], self._image)
        projected = np.array([self._image.dot(v) for v in self._block])
        return Regular(x.copy(), found, below, nearest, tangent, projected)

    def _project_at(self, x: PETSc.Vec, step: float) -> np.ndarray:
        """The same of ``S`` at the equilibrium ``x``, by a difference of the equations over ``step``."""
        # F(x) = 0, so that F(x + step y) / step is S y up to first order in the step: no matrix is assembled
        self._beside.waxpy(step, self._block[0], x)
        self.system.at(self._beside).residual(self._image)
        return np.array([self._image.dot(v) for v in self._block]) / step

    def _solve(self, found: Factored, right: PETSc.Vec | None) -> tuple[PETSc.Vec, float]:
        """Solve for all right-hand sides at once: the cost is that of the call, hardly of a column.

        Returns the tangent, and the estimated distance of the eigenvalue nearest zero from zero.
        """
        system, inertia = self.system, self.inertia
        with system.clock("solve"):
            columns = self._right.getDenseArray()
            columns[:, 0] = 0.0 if right is None else right.array_r
            columns[:, 1] = found.border.array_r
            sizes = []
            for i, (v, image) in enumerate(zip(self._block, self._images, strict=True)):
                columns[:, 2 + i] = image.array_r
                sizes.append(image.dot(v) ** 0.5)
            found.factors.solve_all(self._right, self._solved)
            solved = self._solved.getDenseArray()
            self._step.array[:] = solved[:, 0]
            tangent = system.new_vector()  # z = (-S^-1 F_lam, 1)
            tangent.array[:] = -solved[:, 1]
            system.set_load(tangent, 1.0)
            tangent.scale(1.0 / system.norm(tangent))
            growth = 0.0
            for i, (v, image, size) in enumerate(zip(self._block, self._images, sizes, strict=True)):
                v.array[:] = solved[:, 2 + i]
                inertia.metric.mult(v, image)
                # |S^-1 M v| / |v| is at most one over the distance of the nearest eigenvalue from zero
                grown = max(image.dot(v), TINY) ** 0.5
                growth = max(growth, grown / size) if isfinite(grown) else float("inf")
                v.scale(1.0 / grown)
                image.scale(1.0 / grown)
                for j in range(i):  # else all vectors of the block become the same one
                    along = image.dot(self._block[j])
                    v.axpy(-along, self._block[j])
                    image.axpy(-along, self._images[j])
        return tangent, 1.0 / growth

    def correct(
        self, x: PETSc.Vec, row: PETSc.Vec, most: int = 12, reach: float = 1e3, tolerance: float = 0.0
    ) -> tuple[NewtonResult, Regular | None] | None:
        """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place.

        As :func:`rodfem.fem.newton.iterate`; also the state whose factors served last, on the way.  None, with ``x`` as
        it was, where ``S`` is too near singular.  ``most``, ``reach`` and ``tolerance`` are those of that function.
        """
        self.system.set_phase(x)
        origin, singular, at = x.copy(), False, None

        def solve(state: State, equations: PETSc.Vec, fresh: bool) -> PETSc.Vec | None:
            nonlocal singular, at
            if fresh:
                at = self.factor(x, equations)
            if at is None:
                singular = True
                return None
            if not fresh:
                with self.system.clock("solve"):
                    at.found.factors.solve(equations, self._step)
            # J^-1 (r, 0) = y - z (row . y) / (row . z): the step stays on the plane across row
            self._step.axpy(-row.dot(self._step) / row.dot(at.tangent), at.tangent)
            return self._step

        outcome = iterate(self.system, x, solve, most, reach, tolerance)
        if singular:
            origin.copy(x)
            return None
        return outcome, at

    def settled(self, x: PETSc.Vec, at: Regular) -> Regular | None:
        """State whose index and tangent serve for ``x``: ``at``, factored near by, or else ``x`` itself.

        Those of ``at`` hold where no eigenvalue can have come near zero, let alone crossed it, on the way to ``x``.
        None where one of them may be zero.
        """
        inertia = self.inertia
        self._image.waxpy(-1.0, at.x, x)
        moved = self.system.norm(self._image)
        least = NEAR * inertia.scale + 10 * inertia.tolerance
        if moved:
            projected = self._project_at(x, max(DIFFERENCE * moved, SHORTEST))
            change = float(np.linalg.norm(projected - at.projected))
            # the count at the prediction holds only if no eigenvalue can have crossed zero on the way from there
            if at.nearest < least + SENSITIVE * moved * inertia.scale + SAFE * change:
                there = self.factor(x)
                if there is None:
                    return None
                at = there
        return at if at.nearest >= least else None

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

from math import isfinite

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import Outcome, iterate
from rodfem.fem.state import State
from rodfem.fem.system import dense_columns
from rodfem.stability.inertia import Index, Inertia

BLOCK = 2
"""Number of vectors that are iterated along a branch."""
FRESH = 1e-3
"""Weight of a generic vector that is added to each vector of the block before it is iterated."""
NEAR = 1e-3
"""Distance of an eigenvalue from zero, over the lowest bending eigenvalue, below which the two shifts count."""
SENSITIVE = 100.0
"""Least change of an eigenvalue assumed when the state moves by one radian, in the same units."""
DIFFERENCE = 0.05
"""Step of the differences, relative to how far the equilibrium is from the prediction."""
SAFE = 10.0
"""Least distance of all eigenvalues from zero, over the measured change of those carried along."""


class Corrector:
    """Newton's method with the factors of ``S`` at the states of one :class:`~rodfem.stability.inertia.Inertia`.

    Attributes
    ----------
    tangent
        Unit tangent at the state last factored, on the side of increasing load.
    nearest
        Estimated distance of the eigenvalue nearest zero from zero, at the state last factored.
    regular
        Whether that is far enough for the factors to serve.
    """

    def __init__(self, inertia: Inertia) -> None:
        """Allocate right-hand sides, solutions and the block of vectors."""
        self.inertia, self.system = inertia, inertia.system
        system = self.system
        self._right, self._solved = dense_columns(system, BLOCK + 2), dense_columns(system, BLOCK + 2)
        self._step, self._image = system.new_vector(), system.new_vector()
        self._factored, self._beside = system.new_vector(), system.new_vector()
        self._fresh = [inertia.seed(i) for i in range(BLOCK)]
        self._fresh_images = [inertia.metric * v for v in self._fresh]
        self._below = 0
        self._projected = np.zeros(BLOCK)
        self.tangent = system.new_vector()
        self.nearest = 0.0
        self.regular = False
        self.restart()

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        self._block = [v.copy() for v in self._fresh]
        self._images = [v.copy() for v in self._fresh_images]
        self._started = False

    def factor(self, x: PETSc.Vec, right: PETSc.Vec | None = None) -> bool:
        """Factor ``S`` at ``x``; solve for the tangent, the block, and ``right`` (into ``_step``).

        False where they do not serve: an eigenvalue is too near zero, or a load has no potential.
        """
        inertia, self.regular = self.inertia, False
        if not self.system.scene.conservative:  # S is not symmetric
            return False
        inertia.assemble(x, right)
        try:
            self._below = inertia.below(0.0)
        except ConvergenceError:  # exactly singular: two shifts count it, or tell what is wrong
            self.nearest = 0.0
            return False
        x.copy(self._factored)
        for _ in range(1 if self._started else 3):
            for i in range(BLOCK):
                self._block[i].axpy(FRESH, self._fresh[i])
                self._images[i].axpy(FRESH, self._fresh_images[i])
            self._solve(right)
        self._started = self.regular = self.nearest > NEAR * inertia.scale
        if self.regular:
            self._projected = self._project()
        else:
            self.restart()
        return self.regular

    def _project(self) -> np.ndarray:
        """Products of the block with ``S y`` for its first vector ``y``, of the matrix last assembled: (BLOCK,)."""
        self.inertia.matrix.mult(self._block[0], self._image)
        return np.array([self._image.dot(v) for v in self._block])

    def _project_at(self, x: PETSc.Vec, step: float) -> np.ndarray:
        """The same of ``S`` at the equilibrium ``x``, by a difference of the equations over ``step``."""
        self._beside.waxpy(step, self._block[0], x)
        self.system.at(self._beside).residual(self._image)
        return np.array([self._image.dot(v) for v in self._block]) / step

    def _solve(self, right: PETSc.Vec | None) -> None:
        """Solve for all right-hand sides at once: the cost is that of the call, hardly of a column."""
        system, inertia = self.system, self.inertia
        with system.clock("solve"):
            columns = self._right.getDenseArray()
            columns[:, 0] = 0.0 if right is None else right.array_r
            columns[:, 1] = inertia.border.array_r
            sizes = []
            for i, (v, image) in enumerate(zip(self._block, self._images, strict=True)):
                columns[:, 2 + i] = image.array_r
                sizes.append(image.dot(v) ** 0.5)
            inertia.factors.solve_all(self._right, self._solved)
            solved = self._solved.getDenseArray()
            self._step.array[:] = solved[:, 0]
            self.tangent.array[:] = -solved[:, 1]
            system.set_load(self.tangent, 1.0)
            self.tangent.scale(1.0 / system.norm(self.tangent))
            growth = 0.0
            for i, (v, image, size) in enumerate(zip(self._block, self._images, sizes, strict=True)):
                v.array[:] = solved[:, 2 + i]
                inertia.metric.mult(v, image)
                grown = max(image.dot(v), 1e-300) ** 0.5
                growth = max(growth, grown / size) if isfinite(grown) else float("inf")
                v.scale(1.0 / grown)
                image.scale(1.0 / grown)
                for j in range(i):
                    along = image.dot(self._block[j])
                    v.axpy(-along, self._block[j])
                    image.axpy(-along, self._images[j])
            self.nearest = 1.0 / growth

    def _chord(self, right: PETSc.Vec) -> None:
        with self.system.clock("solve"):
            self.inertia.factors.solve(right, self._step)

    def correct(
        self, x: PETSc.Vec, row: PETSc.Vec, most: int = 12, reach: float = 1e3, tolerance: float = 0.0
    ) -> Outcome | None:
        """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place.

        As :func:`rodfem.fem.newton.iterate`.  None, with ``x`` as it was, where ``S`` is too near singular.
        """
        origin, singular = x.copy(), False

        def solve(state: State, equations: PETSc.Vec, fresh: bool) -> PETSc.Vec | None:
            nonlocal singular
            if not fresh:
                self._chord(equations)
            elif not self.factor(x, equations):
                singular = True
                return None
            self._step.axpy(-row.dot(self._step) / row.dot(self.tangent), self.tangent)
            return self._step

        outcome = iterate(self.system, x, solve, most, reach, tolerance)
        if singular:
            origin.copy(x)
            return None
        return outcome

    def tangent_along(self, row: PETSc.Vec) -> PETSc.Vec:
        """Unit tangent at the state last factored, on the side to which ``row`` points."""
        tangent = self.tangent.copy()
        if row.dot(tangent) < 0:
            tangent.scale(-1.0)
        return tangent

    def index(self, x: PETSc.Vec) -> Index | None:
        """Index of ``x``, a state near the one last factored; None where one of its eigenvalues may be zero.

        The count of the factors holds where no eigenvalue can have crossed zero on the way to ``x``; else ``S`` is
        factored at ``x``.
        """
        inertia, drifts = self.inertia, self.system.active_drifts()
        self._image.waxpy(-1.0, self._factored, x)
        moved = self.system.norm(self._image)
        least = NEAR * inertia.scale + 10 * inertia.tolerance
        if moved:
            projected = self._project_at(x, max(DIFFERENCE * moved, 1e-7))
            change = float(np.linalg.norm(projected - self._projected))
            if self.nearest < least + SENSITIVE * moved * inertia.scale + SAFE * change and not self.factor(x):
                return None
        return Index(self._below, drifts) if self.nearest >= least else None

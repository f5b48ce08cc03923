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

Tangent and index of a row are from factors at the row's own state, those of Newton's method from factors at the
prediction: an eigenvalue may cross zero, and the branch may bend, on the way from one to the other.  Where there is no
way, as the prediction is the state but for round-off (a straight rod's), the factors of the one correction serve.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.compiled_corrector import CompiledCorrector
from rodfem.errors import ConvergenceError
from rodfem.fem.compiled_newton import SINGULAR
from rodfem.fem.newton import NewtonResult, iterate, limits, result
from rodfem.fem.state import State
from rodfem.stability.inertia import FRESH, Factored, Index, Inertia
from rodfem.tolerances import NEGLIGIBLE, TINY

STEPS = 8
"""Iterations of Newton's method in a step along a branch, at most: a shorter step is cheaper than more of them."""
BLOCK = 2
"""Number of vectors that are iterated along a branch."""
NEAR = 1e-3
"""Distance of an eigenvalue from zero, over the lowest bending eigenvalue, below which the two shifts count."""


@dataclass(frozen=True)
class Regular:
    """A state ``x`` whose factors serve: no eigenvalue is near zero.

    Attributes
    ----------
    found
        The factors.
    index
        Its index and zeros by the count of the factors; None where an eigenvalue is too near zero for one count.
    nearest
        Estimated distance of the eigenvalue nearest zero from zero.
    tangent
        Unit tangent, on the side of increasing load.
    """

    x: PETSc.Vec
    found: Factored
    index: Index | None
    nearest: float
    tangent: PETSc.Vec

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
        self._step = system.new_vector()
        near_zero = NEAR * inertia.scale
        serves = CompiledCorrector.serves(inertia.matrix, inertia.factors)
        self.compiled = CompiledCorrector(inertia, BLOCK, near_zero) if serves else None
        self._fresh = np.stack([inertia.seed(i).array_r for i in range(BLOCK)], axis=1)
        self._fresh_images = inertia.weighed(self._fresh)
        self.restart()

    def restart(self) -> None:
        """Begin a branch: nothing is known about its eigenvectors."""
        self._block, self._images, self._started = self._fresh, self._fresh_images, False
        if self.compiled is not None:
            self.compiled.restart()

    def corrected(self, x: PETSc.Vec, outcome: NewtonResult) -> Regular | None:
        """Factors of ``S`` at a state that :meth:`correct` has just converged to; None where they do not serve.

        Those of the correction itself, where it was the only one and moved the state by less than :data:`NEGLIGIBLE`.
        """
        if self.compiled is None or outcome.iterations > 1 or outcome.error > NEGLIGIBLE or self.system.damping:
            return self.factor(x)
        return self._counted(self.compiled, x, self.inertia.held)

    def factor(self, x: PETSc.Vec, right: PETSc.Vec | None = None) -> Regular | None:
        """Factor ``S`` at ``x``; solve for the tangent, the block, and ``right`` (into ``_step``).

        None where they do not serve: an eigenvalue is too near zero, or a load has no potential.
        """
        inertia = self.inertia
        if not self.system.scene.conservative:  # S is not symmetric
            return None
        if self.compiled is not None:
            return self._compiled_factor(self.compiled, x)
        found = inertia.at(x, right)
        try:
            below = found.below(0.0)
        except ConvergenceError:  # exactly singular: two shifts count it, or tell what is wrong
            return None
        # inverse iteration: one step a point along a branch, three from generic vectors
        for _ in range(1 if self._started else 3):
            self._block = self._block + FRESH * self._fresh
            self._images = self._images + FRESH * self._fresh_images
            tangent, nearest = self._solve(found, right)
        self._started = nearest > NEAR * inertia.scale
        if not self._started:
            self.restart()
            return None
        return self._regular(x, found, below, nearest, tangent)

    def _compiled_factor(self, compiled: CompiledCorrector, x: PETSc.Vec) -> Regular | None:
        system, inertia = self.system, self.inertia
        system.set_phase(x)
        with system.clock("solve"):
            found = compiled.factor(x)
        if not system.verify(inertia.matrix, system.at(x)):
            found = compiled.factor(x)
        return None if found is None else self._counted(compiled, x, found)

    def _counted(self, compiled: CompiledCorrector, x: PETSc.Vec, found: Factored) -> Regular | None:
        system = self.system
        try:
            below = found.counted()
        except ConvergenceError:
            return None
        tangent = system.new_vector()
        tangent.array[:] = compiled.tangent
        return self._regular(x, found, below, compiled.nearest, tangent)

    def _regular(self, x: PETSc.Vec, found: Factored, below: int, nearest: float, tangent: PETSc.Vec) -> Regular:
        return Regular(x.copy(), found, self.index(found, below, nearest), nearest, tangent)

    def index(self, found: Factored, below: int, nearest: float) -> Index | None:
        """Index by one count of factors, unless an eigenvalue is too near zero."""
        inertia = self.inertia
        certain = nearest >= NEAR * inertia.scale + 10 * inertia.tolerance
        return Index(below, found.drifts, nearest) if certain else None

    def _solve(self, found: Factored, right: PETSc.Vec | None) -> tuple[PETSc.Vec, float]:
        """Solve for all right-hand sides at once: the cost is that of the call, hardly of a column.

        Returns the tangent, and the estimated distance of the eigenvalue nearest zero from zero.
        """
        system, inertia = self.system, self.inertia
        with system.clock("solve"):
            first = np.zeros(len(self._images)) if right is None else right.array_r.real
            columns = np.column_stack([first, found.border.array_r.real, self._images])
            sizes = np.sqrt(inertia.sum((self._images * self._block).sum(axis=0)))
            solved = found.factors.solve_all(columns)
            self._step.array[:] = solved[:, 0]
            tangent = system.new_vector()  # z = (-S^-1 F_lam, 1)
            tangent.array[:] = -solved[:, 1]
            system.set_load(tangent, 1.0)
            tangent.scale(1.0 / system.norm(tangent))
            # |S^-1 M v| / |v| is at most one over the distance of the nearest eigenvalue from zero
            block = solved[:, 2:]
            images = inertia.weighed(block)
            grown = np.sqrt(np.maximum(inertia.sum((images * block).sum(axis=0)), TINY))
            growth = float((grown / sizes).max()) if np.isfinite(grown).all() else inf
            block, images = block / grown, images / grown
            for i in range(1, BLOCK):  # else all vectors of the block become the same one
                along = inertia.sum(images[:, i] @ block[:, :i])
                block[:, i] -= block[:, :i] @ along
                images[:, i] -= images[:, :i] @ along
            self._block, self._images = block, images
        return tangent, 1.0 / growth

    def correct(
        self, x: PETSc.Vec, row: PETSc.Vec, most: int = 12, reach: float = 1e3, tolerance: float = 0.0
    ) -> NewtonResult | None:
        """Solve the equations on the plane through ``x`` orthogonal to ``row``, in place.

        As :func:`rodfem.fem.newton.iterate`.  None, with ``x`` as it was, where ``S`` is too near singular.  ``most``,
        ``reach`` and ``tolerance`` are those of that function.
        """
        self.system.set_phase(x)
        if self.compiled is not None and self.system.scene.conservative:
            return self._compiled_correct(self.compiled, x, row, most, reach, tolerance)
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
        return outcome

    def _compiled_correct(
        self, compiled: CompiledCorrector, x: PETSc.Vec, row: PETSc.Vec, most: int, reach: float, tolerance: float
    ) -> NewtonResult | None:
        system, origin = self.system, x.copy()
        with system.clock("solve"):
            ended = compiled.correct(x, row, limits(system, most, reach, tolerance))
        last = compiled.last_factored() if system.symmetries else None
        if last is None or system.verify(self.inertia.matrix, *last):
            return None if ended.status >= SINGULAR else result(ended)
        origin.copy(x)  # with a condition that belongs to no symmetry: once more without it
        return self._compiled_correct(compiled, x, row, most, reach, tolerance)

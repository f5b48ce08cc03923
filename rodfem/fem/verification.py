r"""Symmetries verified at each state: a generator must be a null vector of the second variation.

Where the equations are equivariant their derivative along a generator ``g(x) = A x + c`` is known, at any state ``x``,

    S(x) g(x) + A^t F(x) = 0,

at an equilibrium ``S g = 0``.  One generator is tried whenever ``S`` is assembled, a random combination of all: it
costs one product with ``S``.  What is left must be round-off, relative to ``|S| |g|``, and so must the quotient
``g.(S g + A^t F) / g.M g``, which is the eigenvalue that the symmetry explains: that of its own terms, whatever the
stiffest strain is.  A ring is closed by multipliers that are no part of a generator: what is left is taken across their
columns.  The motion of a closed rod along itself is one of its mesh up to the mesh's error: of that the quotient alone
is asked, with ``F`` along the change of ``g``.

A symmetry that fails is dropped, with a notice.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from rodfem.fem.symmetries import SYMMETRIC_STATE, mismatch
from rodfem.linalg.matrices import rounding
from rodfem.problem.contribution import Motion

if TYPE_CHECKING:
    from rodfem.fem.state import State
    from rodfem.fem.system import System

EPS = 100 * float(np.finfo(float).eps)
RESIDUAL = 1e-8
"""Residual ``S g`` of a symmetry, relative to ``|S| |g|``."""
ZERO = 1e-10
"""Eigenvalue that a symmetry may have, over the rod's lowest bending eigenvalue, beside round-off: what Newton's method
makes of a state."""
ROUND_OFF = 10.0
"""Times the effect of independent relative errors eps of all entries of ``S`` on the quotient: its round-off."""
TINY = 0.01
"""A generator (of unit rotations and translations) of this size is small: the state has the symmetry itself, nearly."""
ALONG = 1e-5
"""The same as :data:`ZERO` of the motion of a ring along itself, whose state is no solution but on its mesh."""
OF_THE_MESH = 100.0
"""Eigenvalue that a mesh makes of a motion along itself, at most, over the lowest bending one and its mismatch."""
FAR = 1e-4
"""Error that a mesh makes of the equations' part in it, at most, relative."""


class Verification:
    """Verifies the symmetries of one :class:`~rodfem.fem.system.System` at states where ``S`` is assembled.

    Attributes
    ----------
    dropped
        Places of the symmetries that were found to be none.
    notices
        A sentence on each of them that nobody has read yet.
    norm
        That of ``S`` at the first state, to which residuals are relative; zero before.
    """

    def __init__(self, system: System) -> None:
        """Nothing is dropped."""
        self.system = system
        self.dropped: set[int] = set()
        self.notices: list[str] = []
        self.norm = 0.0
        self._closing: list[PETSc.Vec] | None = None
        self._left, self._generator, self._none = system.new_vector(), system.new_vector(), np.zeros(len(system.drifts))

    def __call__(self, matrix: PETSc.Mat, state: State) -> bool:
        """Try the symmetries at an equilibrium, whose ``S`` is given; False where one of them was dropped."""
        failed = self._failing(matrix, state, None)
        if failed:  # the state may be no equilibrium: one that was carried over from another mesh
            equations = self.system.new_vector()
            state.residual(equations)
            failed = self._failing(matrix, state, equations)
        for i in failed:
            self.drop(i, state.load)
        return not failed

    def _failing(self, matrix: PETSc.Mat, state: State, equations: PETSc.Vec | None) -> list[int]:
        """Symmetries, by number, whose generators are no null vectors of ``S`` at the state."""
        exact, suspects = (self._candidates(along=along) for along in (False, True))
        if not exact and not suspects:
            return []
        self.norm = self.norm or self.system.matrix_in_units(matrix).norm(PETSc.NormType.INFINITY)
        if exact and not self._holds(matrix, exact, state, equations):
            suspects += exact
        return [i for i in suspects if not self._holds(matrix, [i], state, equations)]

    def _candidates(self, *, along: bool) -> list[int]:
        """Symmetries, by number, that are not dropped: those with the motion along itself, or without it."""
        every = enumerate(self.system.symmetries)
        return [i for i, symmetry in every if i not in self.dropped and bool(symmetry.along) == along]

    def drop(self, i: int, at: float) -> None:
        """Drop a symmetry that failed at a load, in words."""
        load = self.system.scene.load
        self.dropped.add(i)
        self.notices.append(
            f"No symmetry is the {self.system.symmetries[i]}: it was taken for one, but is no null vector of the "
            f"second variation at {load} = {at:.6g}; it is left out from there on."
        )

    def read(self) -> list[str]:
        """Notices that nobody has read."""
        out, self.notices = self.notices, []
        return out

    def _holds(self, matrix: PETSc.Mat, chosen: list[int], state: State, equations: PETSc.Vec | None) -> bool:
        """Whether a generic combination of the ``chosen`` generators is a null vector of ``S`` at the ``state``.

        ``matrix`` is ``S``, ``equations`` those there, zero at an equilibrium (None).
        """
        system, left, generators = self.system, self._left, state.generators
        weights = generic_weights(len(chosen))
        g, own = self._generator, generators.shape[1]
        g.array[:own] = weights @ generators[chosen]
        matrix.mult(g, left)
        if system.has_scalars:
            left.setValues(system.drifts, self._none)  # phase conditions, no part of S
        left.assemble()
        size, length = system.norm(g) ** 2, system.in_units(g, -1).norm()
        quotient = float(np.real(left.dot(g)))
        if system.symmetries[chosen[0]].along:
            zero = ALONG * system.stiffness_scale * max(size, TINY) + EPS * self.norm * length**2
            if abs(quotient) <= zero:
                return True
            part, error = self._of_the_mesh(g, state, equations)
            return abs(quotient + part) <= zero + error
        small = RESIDUAL * self.norm * (length + TINY)
        if equations is not None:
            pulled = system.generators.pulled_back(self._unloaded(state, equations))
            left.array[:own] += weights @ pulled[chosen]
            quotient = float(np.real(left.dot(g)))
        left = system.in_units(left, 1)
        if left.norm() > small:
            self._across_closing(matrix, left)
        # a generator below SYMMETRIC_STATE explains no eigenvalue
        excess = abs(quotient) - ZERO * system.stiffness_scale * max(size, SYMMETRIC_STATE**2)
        return left.norm() <= small and (excess <= 0 or excess <= ROUND_OFF * rounding(matrix, g, g))

    def _of_the_mesh(self, g: PETSc.Vec, state: State, equations: PETSc.Vec | None) -> tuple[float, float]:
        """What ``equations`` that are not zero add to the quotient of the motion along itself, and the mesh's error.

        ``g`` is the change of the ``state`` by it; it is the last symmetry.
        """
        system, part = self.system, 0.0
        error = OF_THE_MESH * system.stiffness_scale * mismatch(state) * system.norm(g)
        if equations is not None:
            change = system.generators.vector(system.generators.linear(g)[-1])  # A g
            part = float(np.real(equations.dot(change)))
            error += FAR * equations.norm() * change.norm()
        return part, error

    def _unloaded(self, state: State, equations: PETSc.Vec) -> PETSc.Vec:
        """The equations without the forces of the drift scalars."""
        if not state.drifts.any():
            return equations
        out = equations.copy()
        for drift, phase in zip(state.drifts.tolist(), self.system.phase.pushes, strict=True):
            if phase is not None and drift:
                out.axpy(-drift, phase)
        return out

    def _across_closing(self, matrix: PETSc.Mat, left: PETSc.Vec) -> None:
        """Project ``left`` across the columns of the multipliers that close a ring, in place."""
        if self._closing is None:
            fields, self._closing = self.system.fields, []
            for unknown in fields.unknown_scalars:
                if unknown.group.motion is Motion.CLOSING:
                    column = self.system.new_vector()
                    matrix.getColumnVector(fields.scalars[unknown.name], column)
                    column = self.system.in_units(column, 1)
                    column.normalize()
                    self._closing.append(column)
        for column in self._closing:
            left.axpy(-column.dot(left), column)


@cache
def generic_weights(count: int) -> np.ndarray:
    """Weights (count,) of a generic combination of as many generators."""
    return np.random.default_rng(0).uniform(0.5, 1.0, count) * (-1.0) ** np.arange(count) if count > 1 else np.ones(1)

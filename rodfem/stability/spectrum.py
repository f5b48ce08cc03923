r"""Left-most eigenvalues of an equilibrium by SLEPc, on the singular pencil of its saddle matrix.

    (K C; C^t 0) x = mu (M 0; 0 0) x

with ``M`` the kinetic metric: stable where all ``mu = omega^2`` are positive (Kumar & Healey 2010, (21) and
(45)).  ``M`` is singular, so that only shift-invert is free of spurious eigenvalues: its image ``(S - sigma M)^-1
M`` is zero on all that has no inertia.  No Dirichlet row exists that could bring one in.  Symmetry modes are
deflated: their zero eigenvalue is known and is not among those returned.

The shift is put below the spectrum, which a count by inertia at the shift proves; the nearest eigenvalues to it
are then the left-most ones, and a second count, just above the last of them, proves that none is missing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import Inertia, inertia_factorizer
from rodfem.stability.pencil import assemble_pencil, shift_invert


@dataclass(frozen=True)
class Modes:
    """Left-most eigenvalues in ascending order (symmetry modes left out), their vectors, and their backward errors."""

    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    certified: bool

    def negative(self, tolerance: float) -> int:
        """Number of eigenvalues below ``-tolerance``."""
        return int((self.values < -tolerance).sum())


class Spectrum:
    """Computes left-most eigenvalues at states of the system of an :class:`~rodfem.stability.inertia.Inertia`."""

    def __init__(self, inertia: Inertia) -> None:
        """Allocate the matrices of the pencil once."""
        self.inertia, self.system = inertia, inertia.system
        self.matrix = self.system.state_matrix()
        self.mass = self.system.state_matrix()
        self._shifted = self.system.state_matrix()
        self._factors = inertia_factorizer(self.system.comm)
        self.shift = -inertia.scale

    def leftmost(self, x: PETSc.Vec, number: int) -> Modes:
        """Return the ``number`` left-most eigenvalues of the state ``x``, at which the phase conditions must be set.

        Raises :class:`ConvergenceError` where SLEPc finds fewer.
        """
        system = self.system
        symmetry = [system.generator(x, i) for i, phase in enumerate(system.phases) if phase is not None]
        with system.clock("assembly"):
            assemble_pencil(system, x, self.matrix, self.mass)
        with system.clock("stability"):
            for _ in range(40):
                if self._below(self.shift) == 0:
                    break
                self.shift *= 4
            else:
                raise ConvergenceError(
                    "The spectrum has no lower end: the kinetic metric is too small for the rod's stiffness."
                )
            for extra in (2, 6, 14):
                modes = self._solve(number, extra, symmetry)
                if modes.certified:
                    break
        if abs(modes.values[0]) * 100 < abs(self.shift):
            self.shift = min(2 * modes.values[0], -self.inertia.scale)
        return modes

    def _below(self, sigma: float) -> int:
        """Number of eigenvalues of the pencil below ``sigma``, symmetry modes included."""
        self.matrix.copy(self._shifted, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self._shifted.axpy(-sigma, self.mass, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self._shifted.stateIncrease()
        return int(self._factors(self._shifted).getInertia()[0] - self.inertia.constraints)

    def _solve(self, number: int, extra: int, symmetry: list[PETSc.Vec]) -> Modes:
        """Solve for ``number`` values and some more, and count whether any is missing among the first ``number``.

        A Krylov method finds the second of two equal eigenvalues late, by round-off: it is there when more are
        asked for.
        """
        solver = shift_invert(self.matrix, self.mass, number + extra, self.shift, symmetric=True)
        if symmetry:
            solver.setDeflationSpace(symmetry)
        solver.solve()
        found = solver.getConverged()
        if found < number:
            solver.destroy()
            raise ConvergenceError(
                f"SLEPc found {found} of the {number} eigenvalues asked for: "
                f"ask for at most {found} at this discretisation."
            )
        values = np.array([solver.getEigenvalue(i).real for i in range(found)])
        order = np.argsort(values)
        cut = values[order[number - 1]]
        cut += 1e-6 * max(abs(cut), self.inertia.scale)
        known = int((values < cut).sum()) + (len(symmetry) if cut > 0 else 0)
        order = order[:number]
        errors = np.array([solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD) for i in order])
        vectors = [self.system.new_vector() for _ in order]
        for i, vector in zip(order, vectors, strict=True):
            solver.getEigenvector(i, vector)
        solver.destroy()
        return Modes(values[order], vectors, errors, self._below(cut) == known)

"""SLEPc's spectrum slicing in an interval that holds the eigenvalues wanted."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.errors import ConvergenceError, InputError
from rodfem.linalg.factorization import PETSC_ERR_LIB
from rodfem.stability.method import Found, Interval, SymmetricMethod
from rodfem.stability.pencil import in_interval
from rodfem.stability.symmetric import SymmetricPencil

WIDER = (0.0, 1e-9, 1e-7, 1e-5)
"""By how much of itself an interval is widened where what SLEPc finds in it does not match the counts at its ends."""
PETSC_ERR_PLIB = 77
"""PETSc's error code for that."""
ROOMS = (100, 400, 1600)
"""Percentages of room beyond MUMPS's estimate: where rotations have no mass many pivots of the pencil are delayed."""
STEP, CUT = 1.0371, 0.4931
"""Factors of the ends tried, no simple numbers: an end on an eigenvalue is unlikely."""
HALVINGS = 20
"""Most steps that shorten an interval which holds too many eigenvalues."""
FACTORISATIONS = 3
"""Those of SLEPc, at least."""


class Slicing(SymmetricMethod):
    """All eigenvalues in an interval."""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """In the ``interval``, or in one found by counting that holds ``number`` of them and few more.

        Raises :class:`InputError` for an empty interval, :class:`ConvergenceError` where an end is an eigenvalue.
        """
        pencil, units = self.work.below(x), self.work.system.scene.units
        one = units.omega2
        low, high = (interval[0] / one, interval[1] / one) if interval else enclose(pencil, number)
        if not low < high:
            raise InputError(f"An interval from {one * low:g} to {one * high:g} is empty: give its lower end first.")
        for wider in WIDER:  # an end on an eigenvalue is moved off it
            low, high = low - wider * (high - low), high + wider * (high - low)
            wanted = pencil.below(high) - pencil.below(low)
            solver = solved(*pencil.scaled, low, high)
            if solver is not None:
                break
        else:
            ends = f"{one * low:.6g} to {one * high:.6g}"
            raise ConvergenceError(f"An end of the interval from {ends} is an eigenvalue: move it.")
        values = np.array([solver.getEigenvalue(i).real for i in range(solver.getConverged())])
        complete = len(values) == wanted
        order = np.argsort(values)[: None if interval else number]
        vectors = [self.work.system.new_vector() for _ in order]
        for i, vector in zip(order, vectors, strict=True):
            solver.getEigenvector(int(i), vector)
        solver.destroy()
        values = values[order]
        errors = pencil.backward_errors(values, vectors)
        for vector in vectors:
            vector.pointwiseMult(vector, pencil.sizes)
        return Found(one * values, vectors, errors, complete, FACTORISATIONS)


def solved(matrix: PETSc.Mat, mass: PETSc.Mat, low: float, high: float) -> SLEPc.EPS | None:
    """Eigenvalues of a pencil between ``low`` and ``high``; None where they do not match the counts at these ends.

    Raises :class:`PETSc.Error` where PETSc gives up, MUMPS with the largest of :data:`ROOMS`.  ``matrix - mu mass`` is
    the pencil.
    """
    for room in ROOMS:
        try:
            solver = in_interval(matrix, mass, low, high, room)
            solver.solve()
        except PETSc.Error as trouble:
            if trouble.ierr == PETSC_ERR_PLIB:
                return None
            if trouble.ierr != PETSC_ERR_LIB or room == ROOMS[-1]:
                raise
        else:
            return solver
    return None


def enclose(pencil: SymmetricPencil, number: int) -> Interval:
    """Interval from below the spectrum that holds at least ``number`` eigenvalues, and not many more."""
    low, step = pencil.shift, max(abs(pencil.shift), pencil.scale) * STEP
    high = low + step
    inside = low
    while pencil.below(high) < number:
        inside, step = high, 2 * step
        high = inside + step
    for _ in range(HALVINGS):
        if pencil.below(high) <= 2 * number:
            break
        middle = inside + CUT * (high - inside)
        if pencil.below(middle) < number:
            inside = middle
        else:
            high = middle
    return low, high

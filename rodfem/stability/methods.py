"""What a method for stability offers, and those that need no reduction of the pencil.

``count`` is the inertia of the saddle matrix alone; ``shift-invert`` a Krylov space of the singular pencil; ``slicing``
all eigenvalues in an interval; ``dense`` all there are.  A method is a class here or in another room, and a name in
:mod:`rodfem.stability.registry`.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.compat import slepc_errors
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.system import System
from rodfem.linalg.factorization import PETSC_ERR_LIB, ordering, preferred
from rodfem.linalg.matrices import gathered
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.spectrum import FINITE, condensed
from rodfem.stability.symmetric import Found, SymmetricPencil, SymmetricSolver, eigensolver

Interval = tuple[float, float]
NEAR_ZERO = 1e-3
"""Target of the eigenvalues nearest zero, relative to the scale of the stiffness."""
SLICED = 1e-10
"""Relative tolerance of SLEPc for all eigenvalues of an interval."""
WIDER = (0.0, 1e-9, 1e-7, 1e-5)
"""By how much of itself an interval is widened where what SLEPc finds in it does not match the counts at its ends."""
ROOMS = (100, 400, 1600)
"""Percentages of room beyond MUMPS's estimate: where rotations have no mass many pivots of the pencil are delayed."""
LARGEST = 3000
"""Unknowns that dense matrices may have."""


class Workspace:
    """Matrices and factorisations on one system, made when they are asked for and kept for the next state."""

    def __init__(self, source: Any) -> None:
        self.system: System = source if isinstance(source, System) else source.system
        self.conservative, self.one = self.system.scene.conservative, self.system.scene.units.omega2
        given = getattr(source, "inertia", None)
        self.inertia: Inertia | None = (given or Inertia(self.system)) if self.conservative else None

    @cached_property
    def symmetric(self) -> SymmetricSolver:
        """Left-most eigenvalues of conservative states."""
        assert self.inertia is not None
        return SymmetricSolver(self.inertia)

    @cached_property
    def nonsymmetric(self) -> NonsymmetricSolver:
        """Eigenvalues of states under loads without a potential."""
        assert not self.conservative
        return NonsymmetricSolver(self.system)

    def factorisations(self) -> int:
        """Number of those of the symmetric pencil, so far."""
        return self.symmetric.factorisations if "symmetric" in vars(self) else 0

    def below(self, x: PETSc.Vec) -> SymmetricPencil:
        """Symmetric pencil at ``x``, its shift below all eigenvalues."""
        pencil = self.symmetric.at(x)
        pencil.go_below()
        return pencil

    @property
    def sizes(self) -> PETSc.Vec:
        """Natural size of each unknown."""
        return (self.symmetric if self.conservative else self.nonsymmetric).sizes


class Method:
    """A way to the eigenvalues that decide the stability of states of one system."""

    finds_modes = True
    """Whether it finds eigenvalues and vectors."""

    def __init__(self, work: Workspace) -> None:
        self.work = work

    @staticmethod
    def refusal(system: System) -> str:
        """Why it does not apply to a system, in words that follow its name; empty where it does."""
        return ""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """Left-most eigenvalues of a conservative state, ``number`` of them or those in an interval."""
        raise NotImplementedError

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """Eigenvalues nearest zero of a state under loads without a potential."""
        raise NotImplementedError


class SymmetricMethod(Method):
    """A method for conservative loads alone."""

    @staticmethod
    def refusal(system: System) -> str:
        """Loads without a potential."""
        trouble = "needs a symmetric pencil, which a load without potential does not have"
        return "" if system.scene.conservative else trouble


class Count(SymmetricMethod):
    """The index alone, by the inertia of the saddle matrix, which every verdict on a conservative state has."""

    finds_modes = False

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """Nothing."""
        return Found(np.zeros(0), [], np.zeros(0), certified=True)


class ShiftInvert(Method):
    """SLEPc on the singular pencil: one sparse factorisation serves eigenvalues and count."""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """By the Lanczos method, with a shift below the spectrum."""
        return self.work.symmetric.at(x).leftmost(number)

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """By the Arnoldi method."""
        near = self.work.nonsymmetric.at(x).near_zero(number)
        nearest = np.sort(np.argsort(abs(near.values), kind="stable")[:number])
        return Found(near.values[nearest], [], near.errors[nearest], factorisations=1)


class Dense(Method):
    """All eigenvalues by LAPACK, of the pencil on its unknowns with mass: an oracle for small systems."""

    @staticmethod
    def refusal(system: System) -> str:
        """More than :data:`LARGEST` unknowns."""
        unknowns = system.fields.unknowns
        return "" if unknowns <= LARGEST else f"is for at most {LARGEST} unknowns, not {unknowns}"

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """By the symmetric ``T`` of :mod:`rodfem.stability.spectrum`, positive for a shift below all eigenvalues.

        Raises :class:`InputError` if fewer than ``number`` are finite.
        """
        below = self.work.below(x)
        stiffness, mass = (gathered(A).real for A in below.solver.scaled)
        pencil = condensed(stiffness, mass, below.solver.shift)
        T = pencil.dual.T @ pencil.inverse
        nu, w = np.linalg.eigh((T + T.T) / 2)
        if number > (finite := int((nu > FINITE * nu[-1]).sum())):
            raise InputError(
                f"The rod has {finite} eigenvalues on this mesh, not {number}: give number={finite} or less, or use "
                "more elements."
            )
        nu, w = nu[::-1][:number], w[:, ::-1][:, :number]
        vectors, own = [], slice(*below.matrix.getOwnershipRange())
        for column in (pencil.images @ w / nu).T:
            vectors.append(self.work.system.new_vector())
            vectors[-1].array[:] = column[own]
        values = below.solver.shift + 1.0 / nu
        errors = below.backward_errors(values, vectors)
        return Found(self.work.one * values, below.unscaled(vectors), errors, below.certifies(values))

    def nearest(self, x: PETSc.Vec, number: int) -> Found:
        """Those of all that are nearest zero."""
        near = self.work.nonsymmetric.at(x).nearest(number)
        nearest = np.sort(np.argsort(abs(near.values), kind="stable")[:number])
        order = nearest[np.lexsort((near.values[nearest].imag, np.round(near.values[nearest].real, 9)))]
        return Found(near.values[order], [], near.errors[order])


class Slicing(SymmetricMethod):
    """SLEPc's spectrum slicing: all eigenvalues in an interval."""

    def leftmost(self, x: PETSc.Vec, number: int, interval: Interval | None) -> Found:
        """In the ``interval``, or in one found by counting that holds ``number`` of them and few more.

        Raises :class:`InputError` for an empty interval, :class:`ConvergenceError` if an end is an eigenvalue.
        """
        pencil, one = self.work.below(x), self.work.one
        low, high = (interval[0] / one, interval[1] / one) if interval else enclosed(pencil, number)
        if not low < high:
            raise InputError(f"An interval from {one * low:g} to {one * high:g} is empty: give its lower end first.")
        for wider in WIDER:  # an end on an eigenvalue is moved off it
            low, high = low - wider * (high - low), high + wider * (high - low)
            wanted = pencil.below(high) - pencil.below(low)
            if (solver := sliced(pencil, low, high)) is not None:
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
        errors = pencil.backward_errors(values[order], vectors)
        return Found(one * values[order], pencil.unscaled(vectors), errors, complete, 3)  # SLEPc's own, at least


def sliced(pencil: SymmetricPencil, low: float, high: float) -> SLEPc.EPS | None:
    """Eigenvalues of a ``pencil`` between ``low`` and ``high``; None if they do not match the counts at these ends.

    Raises :class:`PETSc.Error` where PETSc gives up, MUMPS with the largest of :data:`ROOMS`.
    """
    for room in ROOMS:
        try:
            solver = in_interval(*pencil.solver.scaled, low, high, room)
            with slepc_errors():
                solver.solve()
        except PETSc.Error as trouble:
            if trouble.ierr == 77:  # PETSC_ERR_PLIB: what it finds does not match the counts at the ends
                return None
            if trouble.ierr != PETSC_ERR_LIB or room == ROOMS[-1]:
                raise
        else:
            return solver
    return None


def in_interval(matrix: PETSc.Mat, mass: PETSc.Mat, low: float, high: float, room: int = 100) -> SLEPc.EPS:
    """Set up spectrum slicing for all eigenvalues of a pencil ``matrix - mu mass`` between ``low`` and ``high``.

    ``room`` is what MUMPS has beyond its estimate, a percentage.  Options: ``-rodfem_slicing_eps_...``,
    ``-rodfem_slicing_st_...``.  Raises :class:`PETSc.Error` where an end is an eigenvalue.
    """
    solver = eigensolver(matrix, mass, "rodfem_slicing_")
    solver.setWhichEigenpairs(SLEPc.EPS.Which.ALL)
    solver.setInterval(low, high)
    solver.setTolerances(tol=SLICED)
    solver.getST().setMatStructure(PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
    with slepc_errors():
        solver.setFromOptions()
        ksp = solver.getKrylovSchurKSP()  # that of the solver for one slice
        ksp.setType("preonly")
        ksp.getPC().setType("cholesky")
        ksp.getPC().setFactorSolverType("mumps")
        controls = {"mat_mumps_icntl_8": 0, "mat_mumps_icntl_13": 1, "mat_mumps_icntl_14": room}
        with preferred(ksp.getOptionsPrefix(), ordering(matrix) | controls):
            solver.setUp()
    return solver


def enclosed(pencil: SymmetricPencil, number: int) -> Interval:
    """Interval from below the spectrum that holds at least ``number`` eigenvalues, and not many more."""
    # no simple factor: an end on an eigenvalue is unlikely
    low, step = pencil.solver.shift, max(abs(pencil.solver.shift), pencil.solver.scale) * 1.0371
    while pencil.below(low + step) < number:
        step *= 2
    return low, low + step

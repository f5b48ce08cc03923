"""A state in, a report on its stability out: one interface to all methods.

Every verdict on a conservative state has its index by the count, decided within the count's band by Rayleigh quotients
(:mod:`rodfem.stability.near_zero`); methods differ in how they find eigenvalues and vectors: ``count`` finds none,
``shift-invert`` has a Krylov space of the singular pencil, ``slicing`` all in an interval, ``dense`` all there are.  A
method is a class here or in another room, and a name in :data:`rodfem.stability.METHODS`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem.compat import slepc_errors
from rodfem.errors import ConvergenceError, InputError, many
from rodfem.fem.shape import Shape
from rodfem.fem.system import System
from rodfem.linalg.factorization import PETSC_ERR_LIB, ordering, preferred
from rodfem.linalg.matrices import gathered
from rodfem.ranks import as_failure
from rodfem.stability import AUTO, METHODS, find
from rodfem.stability.dependence import require_independent_constraints
from rodfem.stability.inertia import Inertia
from rodfem.stability.near_zero import Decision, decide
from rodfem.stability.nonsymmetric import Frequencies, NonsymmetricSolver
from rodfem.stability.soft_mode import ONE_SIDE, WORDS, SoftMode, is_stable, stability
from rodfem.stability.spectrum import FINITE, Spectrum
from rodfem.stability.symmetric import Eigenvalues, SymmetricSolver, eigensolver

COUNT, DENSE = "count", "dense"
"""Methods that find no eigenvalues, and all there are."""
LARGEST = 3000
"""Unknowns that dense matrices may have."""


@dataclass(frozen=True, repr=False)
class Verdict:
    """Stability of one state: what :meth:`rodfem.Solver.assess` returns.

    Under loads without a potential unstable eigenvalues are those with a negative real part or an imaginary part, of
    all that the mesh has (of those found, if it is too large), and zero ones those of free motions.
    """

    negative: int  #: index, or number of unstable eigenvalues
    zero: int  #: number of zero eigenvalues, symmetry modes included
    values: np.ndarray  #: left-most mu = omega^2 (nearest zero, without a potential), without symmetry modes
    vectors: list[PETSc.Vec]  #: without multipliers if constraints were reduced; none without a potential
    errors: np.ndarray  #: backward errors
    band: float  #: half width of the interval about zero, in the metric, in which inertia alone decides nothing
    inside: np.ndarray  #: Rayleigh quotients of the eigenvalues in that band
    uncertainty: np.ndarray  #: their round-off
    certified: bool  #: whether counts prove that none is missing among the values
    seconds: float  #: cost of the verdict
    factorisations: int  #: of matrices
    method: str  #: how it was done
    reason: str  #: why so
    undecided: int = 0  #: number of eigenvalues whose sign is not decided, which are not among the negative ones
    soft: tuple[SoftMode, ...] = ()  #: eigenvalues near zero in the metric, by name
    kink: str = ""  #: what has a kink at the very state, where the numbers are those of one side
    uncompared: str = ""  #: why the index was not compared with that of a richer mesh
    negative_in_space: int | None = None  #: index in space of a planar rod, if it is known

    @property
    def stable(self) -> bool | None:
        """Whether no direction is unstable; None where that is not decided."""
        doubt = self.kink or self.uncompared
        return is_stable(stability(self.negative, self.undecided, doubt, self.negative_in_space))

    def at(self, point: Any) -> Verdict:
        """The same with kink and soft modes of a ``point`` of a branch, and the index as far as they are decided."""
        here = replace(self, kink=point.kink, uncompared=point.uncompared, negative_in_space=point.negative_in_space)
        if not point.soft:
            return here
        counts = replace(here, negative=point.negative, zero=point.zero, undecided=point.undecided)
        return replace(counts, soft=tuple(point.soft))

    def __repr__(self) -> str:
        """Stability, counts and the left-most eigenvalue."""
        first = f", left-most mu = {self.values[0]:.10g}" if len(self.values) else ""
        undecided = f", {self.undecided} undecided" if self.undecided else ""
        words = f"{WORDS[self.stable]}, {self.negative} negative{undecided}, {self.zero} zero"
        return f"<Verdict by {self.method}: {words}{first}>"

    def __str__(self) -> str:
        values = ", ".join(f"{v:.10g}" for v in self.values) or "none computed"
        proof = ", none missing" if self.certified and len(self.values) else ""
        alone = f"; not compared with a richer mesh: {self.uncompared}" if self.uncompared else ""
        inside = f"; {len(self.inside)} inside the band {self.band:.1e} of the count" if len(self.inside) else ""
        undecided = f", {self.undecided} undecided" if self.undecided else ""
        undecided += f", {ONE_SIDE} of the {self.kink}" if self.kink else ""
        undecided += f", {self.negative_in_space} negative in space" if self.negative_in_space is not None else ""
        return (
            f"{self.negative} negative, {self.zero} zero{undecided}{inside}; left-most: {values}{proof} "
            f"({self.method}: {self.reason}; {many(self.factorisations, 'factorisation')}, {1e3 * self.seconds:.1f} ms)"
            f"{alone}"
        )


class Assessor:
    """Judges states of one system; keeps matrices, symbolic factorisations and the last modes for the next state."""

    def __init__(self, source: Any) -> None:
        """Take a system, or a solver with its inertia."""
        self.system: System = source if isinstance(source, System) else source.system
        self.conservative, self.one = self.system.scene.conservative, self.system.scene.units.omega2
        given = getattr(source, "inertia", None)
        self.inertia: Inertia | None = (given or Inertia(self.system)) if self.conservative else None
        self._methods: dict[str, Method] = {}

    @cached_property
    def symmetric(self) -> SymmetricSolver:
        """Left-most eigenvalues of conservative states."""
        assert self.inertia is not None
        return SymmetricSolver(self.inertia)

    @cached_property
    def nonsymmetric(self) -> NonsymmetricSolver:
        """Eigenvalues of states under loads without a potential."""
        return NonsymmetricSolver(self.system)

    def low_pencil(self, x: PETSc.Vec) -> SymmetricSolver:
        """Symmetric pencil at ``x``, its shift below all eigenvalues."""
        pencil = self.symmetric.at(x)
        pencil.go_below()
        return pencil

    def choose(self, name: str, number: int) -> tuple[str, str]:
        """Name of the method to use and the reason; raises :class:`InputError` for one unknown or not applicable."""
        if name == AUTO:
            if not self.conservative:
                return "shift-invert", "the load has no potential, the pencil no symmetry"
            if number == 0:
                return COUNT, "no eigenvalues were asked for"
            if self._few(number):
                return DENSE, f"{self.system.fields.unknowns} unknowns are too few for a Krylov space"
            return "shift-invert", "the pencil is symmetric: one sparse factorisation serves eigenvalues and count"
        if refusal := find(name).refusal(self.system):
            others = ", ".join(other for other in METHODS if not find(other).refusal(self.system))
            raise InputError(f"Method {name!r} {refusal}: choose one of {others}.")
        return name, "as asked"

    def _few(self, number: int) -> bool:
        """Whether there are so few unknowns that the mesh may have no such ``number`` of eigenvalues."""
        return self.system.fields.unknowns < 12 * number

    def __call__(self, x: PETSc.Vec, method: str = AUTO, number: int = 4) -> Verdict:
        """Assess the equilibrium ``x`` by a ``method`` of :data:`rodfem.stability.METHODS`, or ``auto``.

        Raises :class:`InputError` for a method that does not exist or apply, for dependent constraints, and for more
        than the ``number`` of eigenvalues that a small mesh has, :class:`ConvergenceError` if an eigensolver fails.
        """
        name, reason = self.choose(method, number)
        if number < 0:
            raise InputError(f"{number} eigenvalues cannot be computed: ask for none or more.")
        started, made, nothing = perf_counter(), 0, np.zeros(0)
        if self.conservative:
            decision = self._index(x)
            counts = decision.index.negative, decision.index.zero
            inside = decision.band, decision.inside, decision.uncertainty
            made -= self._factorisations() - 2
            found = self._leftmost(x, name if number else COUNT, number)
            made += self._factorisations()
        else:
            with as_failure(self.system.comm):
                found = self._method(name).nearest(x, max(number, 1))
            pencil = self.nonsymmetric.at(x)
            counts = pencil.spectrum.unstable + pencil.massless, self.system.active_drifts(x)
            inside = 0.0, nothing, nothing
        return Verdict(
            *(*counts, found.values, found.vectors, found.errors, *inside, found.certified),
            *(perf_counter() - started, made + found.factorisations, name, reason + found.note),
        )

    def _leftmost(self, x: PETSc.Vec, name: str, number: int) -> Eigenvalues:
        """By a method; of a small mesh with fewer than ``number`` eigenvalues LAPACK has the sentence on that."""
        try:
            with as_failure(self.system.comm):
                found = self._method(name).leftmost(x, number)
            if len(found.values) < number and name != COUNT:
                raise ConvergenceError(
                    f"The method {name} found {len(found.values)} of {number} eigenvalues: ask for fewer of them, "
                    "or choose another method."
                )
        except ConvergenceError:
            if self._few(number) and not find(DENSE).refusal(self.system):
                self._method(DENSE).leftmost(x, number)
            raise
        return found

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """The ``number`` left-most eigenpairs of the conservative state ``x`` alone, without its index."""
        with as_failure(self.system.comm):
            return self._method(self.choose(AUTO, number)[0]).leftmost(x, number)

    def _factorisations(self) -> int:
        """Number of those of the symmetric pencil, so far."""
        return self.symmetric.factorisations if "symmetric" in vars(self) else 0

    def _method(self, name: str) -> Method:
        """Method by name, kept for the next state."""
        if name not in self._methods:
            self._methods[name] = find(name)(self)
        return self._methods[name]

    def _index(self, x: PETSc.Vec) -> Decision:
        """Count; where that breaks down, name the constraints that depend on each other."""
        assert self.inertia is not None
        try:
            return decide(self.inertia.at(x))
        except ConvergenceError:
            require_independent_constraints(Shape(self.system), x)
            raise


class Method:
    """A way to the eigenvalues that decide the stability of states of one system."""

    finds_modes = True
    """Whether it finds eigenvalues and vectors."""

    def __init__(self, work: Assessor) -> None:
        self.work = work

    @staticmethod
    def refusal(system: System) -> str:
        """Why it does not apply to a system, in words that follow its name; empty where it does."""
        return ""

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """The ``number`` left-most eigenvalues of a conservative state."""
        raise NotImplementedError

    def nearest(self, x: PETSc.Vec, number: int) -> Eigenvalues:
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

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """Nothing."""
        return Eigenvalues(np.zeros(0), [], np.zeros(0), certified=True)


class ShiftInvert(Method):
    """SLEPc on the singular pencil: one sparse factorisation serves eigenvalues and count."""

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """By the Lanczos method, with a shift below the spectrum."""
        return self.work.symmetric.at(x).leftmost(number)

    def nearest(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """By the Arnoldi method."""
        return _nearest(self.work.nonsymmetric.at(x).near_zero(number), number)


class Dense(Method):
    """All eigenvalues by LAPACK, of the pencil on its unknowns with mass: an oracle for small systems."""

    @staticmethod
    def refusal(system: System) -> str:
        """More than :data:`LARGEST` unknowns."""
        unknowns = system.fields.unknowns
        return "" if unknowns <= LARGEST else f"is for at most {LARGEST} unknowns, not {unknowns}"

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """By the symmetric ``T`` of :mod:`rodfem.stability.spectrum`, positive for a shift below all eigenvalues."""
        below = self.work.low_pencil(x)
        stiffness, mass = (gathered(A).real for A in below.scaled)
        pencil = Spectrum(stiffness, mass, below.shift)
        T = pencil.dual.T @ pencil.inverse
        nu, w = np.linalg.eigh((T + T.T) / 2)
        if number > (finite := int((nu > FINITE * nu[-1]).sum())):
            raise InputError(
                f"The rod has {finite} eigenvalues on this mesh, not {number}: give number={finite} or less, or use "
                "more elements."
            )
        nu, w = nu[::-1][:number], w[:, ::-1][:, :number]
        own, values = slice(*below.matrix.getOwnershipRange()), below.shift + 1.0 / nu
        vectors = self.work.system.vectors((pencil.images @ w / nu)[own])
        errors = below.backward_errors(values, vectors)
        return Eigenvalues(self.work.one * values, below.unscaled(vectors), errors, below.certifies(values))

    def nearest(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """Those of all that are nearest zero."""
        return _nearest(self.work.nonsymmetric.at(x).leftmost(number), number)._replace(factorisations=0)


def _nearest(found: Frequencies, number: int) -> Eigenvalues:
    """The ``number`` of some eigenvalues that are nearest zero, in the order in which they were found."""
    nearest = np.sort(np.argsort(abs(found.values), kind="stable")[:number])
    return Eigenvalues(found.values[nearest], [], found.errors[nearest], factorisations=1)


class Slicing(SymmetricMethod):
    """SLEPc's spectrum slicing: all eigenvalues in an interval, found by counting, with the left-most and few more."""

    def leftmost(self, x: PETSc.Vec, number: int) -> Eigenvalues:
        """Those in an interval from below the spectrum."""
        pencil, own = self.work.low_pencil(x), self.work.symmetric
        # no simple factor: an end on an eigenvalue is unlikely
        low, width = own.shift, max(abs(own.shift), own.scale) * 1.0371
        while pencil.eigenvalue_count(low + width) < number:
            width *= 2
        high = low + width
        for wider in (0.0, 1e-9, 1e-7, 1e-5):  # an end on an eigenvalue is moved off it
            low, high = low - wider * (high - low), high + wider * (high - low)
            if (solver := sliced(pencil, low, high)) is not None:
                break
        else:
            raise ConvergenceError(f"{low:.6g} or {high:.6g} is an eigenvalue: choose another method.")
        complete = solver.getConverged() == pencil.eigenvalue_count(high) - pencil.eigenvalue_count(low)
        values, vectors = pencil.converged(solver, number)
        solver.destroy()
        errors = pencil.backward_errors(values, vectors)
        return Eigenvalues(self.work.one * values, pencil.unscaled(vectors), errors, complete, 3)  # SLEPc's, at least


def sliced(pencil: SymmetricSolver, low: float, high: float) -> SLEPc.EPS | None:
    """Eigenvalues of a ``pencil`` between ``low`` and ``high``; None if they do not match the counts at these ends."""
    rooms = 100, 400, 1600  # where rotations have no mass many pivots of the pencil are delayed
    for room in rooms:
        try:
            solver = in_interval(*pencil.scaled, low, high, room)
            with slepc_errors():
                solver.solve()
        except PETSc.Error as trouble:
            if trouble.ierr == 77:  # PETSC_ERR_PLIB: what it finds does not match the counts at the ends
                break
            if trouble.ierr != PETSC_ERR_LIB or room == rooms[-1]:
                raise
        else:
            return solver
    return None


def in_interval(matrix: PETSc.Mat, mass: PETSc.Mat, low: float, high: float, room: int = 100) -> SLEPc.EPS:
    """Spectrum slicing for all eigenvalues between two; MUMPS has ``room`` beyond its estimate, a percentage."""
    solver = eigensolver(matrix, mass, "rodfem_slicing_")
    solver.setWhichEigenpairs(SLEPc.EPS.Which.ALL)
    solver.setInterval(low, high)
    solver.setTolerances(tol=1e-10)  # of vectors
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

r"""A state in, a report on its stability out: one interface to all methods.

| method | what it does | applies |
|---|---|---|
| count | inertia of the saddle matrix at shifts -tol, +tol | conservative loads |
| shift-invert | SLEPc on the singular pencil; non-conservative: eigenvalues nearest zero | always |
| cayley | SLEPc on the pencil reduced to the kernel of its constraints, paper's parameters | conservative loads |
| slicing | SLEPc's spectrum slicing in an interval that holds the eigenvalues wanted | conservative loads |
| reduction | shift-invert on the reduced pencil | always |
| dense | all of the reduced pencil's eigenvalues by LAPACK: an oracle for small systems | always |

Every verdict on a conservative state has its index by the count, decided within the count's band by Rayleigh quotients
(:mod:`rodfem.stability.round_off`); methods differ in how they find eigenvalues and vectors.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.system import System
from rodfem.linalg.matrices import first_of, gathered, local_rows
from rodfem.stability.blocks import Blocks, Pencil
from rodfem.stability.dense import eigenvalues_near, symmetric_eigenpairs
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import Vibration
from rodfem.stability.pencil import in_interval, symmetry_modes, weighed_modes
from rodfem.stability.rank import rank_of
from rodfem.stability.reduction import Reduction, cayley_parameters
from rodfem.stability.round_off import Decision, decide
from rodfem.stability.symmetric import Spectrum

METHODS = ("count", "shift-invert", "cayley", "slicing", "reduction", "dense")
SYMMETRIC_ONLY = ("count", "cayley", "slicing")
SMALL = 12
"""A system with fewer unknowns than this for each eigenvalue is solved by dense matrices."""
LARGEST = 3000
"""Unknowns that dense matrices may have."""
WIDER = (0.0, 1e-9, 1e-7, 1e-5)
"""By how much of itself an interval is widened where what SLEPc finds in it does not match the counts at its ends."""
PETSC_ERR_PLIB = 77
"""PETSc's error code for that."""
DISTINCT = 1e-3
"""Eigenvalues closer than this, relative to the greatest, are one for the parameters of Cayley's transform."""


@dataclass(frozen=True)
class Verdict:
    """Stability of one state.

    Attributes
    ----------
    negative, zero
        Index and number of zero eigenvalues (symmetry modes included); under non-conservative loads the number of
        eigenvalues found that have a negative real part or an imaginary part, and that of free motions.
    values, vectors, errors
        Left-most eigenvalues ``mu = omega^2`` without symmetry modes (under non-conservative loads those nearest zero),
        their vectors (without multipliers where constraints were reduced), and backward errors.  No vectors where mu is
        complex.
    band
        Half width of the interval about zero, relative to the system's metric, in which inertia alone decides nothing.
    inside, uncertainty
        Rayleigh quotients of what the band holds, and what of them is round-off.
    certified
        Whether counts prove that none is missing among the values.
    seconds, factorisations
        What it took.
    method, reason
        How it was done, and why so.
    """

    negative: int
    zero: int
    values: np.ndarray
    vectors: list[PETSc.Vec]
    errors: np.ndarray
    band: float
    inside: np.ndarray
    uncertainty: np.ndarray
    certified: bool
    seconds: float
    factorisations: int
    method: str
    reason: str

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable."""
        return self.negative == 0

    def __str__(self) -> str:
        """One line for the terminal."""
        values = ", ".join(f"{v:.10g}" for v in self.values) or "none computed"
        proof = ", none missing" if self.certified and len(self.values) else ""
        inside = f"; {len(self.inside)} inside the band {self.band:.1e} of the count" if len(self.inside) else ""
        return (
            f"{self.negative} negative, {self.zero} zero{inside}; left-most: {values}{proof} "
            f"({self.method}: {self.reason}; {self.factorisations} factorisations, {1e3 * self.seconds:.1f} ms)"
        )


class Judge:
    """Judges states of one system; keeps matrices, symbolic factorisations and the last modes for the next state."""

    def __init__(self, source: Any) -> None:
        """Take a :class:`~rodfem.fem.system.System`, or what has one (a follower)."""
        self.system: System = source if isinstance(source, System) else source.system
        self.conservative = self.system.scene.conservative
        given = getattr(source, "inertia", None)
        self.inertia: Inertia | None = (given or Inertia(self.system)) if self.conservative else None
        self.vibration = None if self.conservative else Vibration(self.system)
        self._blocks: Blocks | None = None
        self._map: sp.csr_matrix | None = None
        self._estimates: tuple[float, float] | None = None
        self._made, self._note = 0, ""

    @cached_property
    def spectrum(self) -> Spectrum | None:
        """Left-most eigenvalues of conservative states; its matrices are made when they are asked for."""
        return Spectrum(self.inertia) if self.inertia else None

    def choose(self, method: str, number: int) -> tuple[str, str]:
        """Name of the method to use and the reason; raises :class:`SceneError` for one unknown or not applicable."""
        if method == "auto":
            if not self.conservative:
                return "shift-invert", "the load has no potential, the pencil no symmetry"
            if number == 0:
                return "count", "no eigenvalues were asked for"
            if self.system.fields.unknowns < SMALL * number:
                return "dense", f"{self.system.fields.unknowns} unknowns are too few for a Krylov space"
            return "shift-invert", "the pencil is symmetric: one sparse factorisation serves eigenvalues and count"
        if method not in METHODS:
            raise SceneError(f"Unknown method {method!r}: choose one of auto, {', '.join(METHODS)}.")
        if method in SYMMETRIC_ONLY and not self.conservative:
            raise SceneError(
                f"Method {method!r} needs a symmetric pencil, which a load without potential does not have: "
                "use shift-invert, reduction or dense."
            )
        if method == "dense" and self.system.fields.unknowns > LARGEST:
            raise SceneError(
                f"Method 'dense' is for at most {LARGEST} unknowns, not {self.system.fields.unknowns}: "
                "use another method, or a coarser discretisation."
            )
        return method, "as asked"

    def __call__(self, x: PETSc.Vec, method: str = "auto", number: int = 4, interval: Any = None) -> Verdict:
        """Judge the equilibrium ``x``; sets the phase conditions there.

        ``interval`` (low, high) is where slicing looks, by default where the ``number`` left-most are.  Raises
        :class:`SceneError` for a method that does not exist or apply and for dependent constraints,
        :class:`ConvergenceError` where an eigensolver fails.
        """
        method, reason = self.choose(method, number)
        if number < 0:
            raise SceneError(f"{number} eigenvalues cannot be computed: ask for none or more.")
        started = perf_counter()
        self.system.set_phase(x)
        self._made, self._note = 0, ""
        if self.inertia is None:
            values, vectors, errors = self._non_symmetric(x, method, max(number, 1))
            scale = self.system.stiffness_scale / self.system.scene.length
            bad = int(((values.real < -1e-7 * scale) | (abs(values.imag) > 1e-7 * scale)).sum())
            nothing = np.zeros(0)
            return Verdict(
                *(bad, self.system.active_drifts(), values, vectors, errors, 0.0, nothing, nothing, False),
                *(perf_counter() - started, self._made, method, reason),
            )
        found = self._index(x)
        values, vectors, errors, certified = np.zeros(0), [], np.zeros(0), True
        if method != "count" and number:
            assert self.spectrum is not None
            before = self.spectrum.factorisations
            values, vectors, errors, certified = self._symmetric(x, method, number, interval)
            self._made += self.spectrum.factorisations - before
        return Verdict(
            *(found.index.negative, found.index.zero, values, vectors, errors),
            *(found.band, found.inside, found.uncertainty, certified),
            *(perf_counter() - started, self._made, method, reason + self._note),
        )

    def _index(self, x: PETSc.Vec) -> Decision:
        """Count; where that breaks down, name the constraints that depend on each other."""
        assert self.inertia is not None
        try:
            found = decide(self.inertia.at(x))
        except ConvergenceError:
            rank_of(self._pencil(x, "full"))
            raise
        self._made += 2
        return found

    # --- symmetric pencils -------------------------------------------------------------------------------------

    def _symmetric(
        self, x: PETSc.Vec, method: str, number: int, interval: tuple[float, float] | None
    ) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray, bool]:
        """Left-most eigenvalues, vectors, backward errors, and whether counts prove that none is missing."""
        spectrum = self.spectrum
        assert spectrum is not None
        if method == "shift-invert":
            modes = spectrum.leftmost(x, number)
            return modes.values, modes.vectors, modes.errors, modes.certified
        spectrum.assemble(x)
        spectrum.go_below()
        if method == "slicing":
            return self._slices(number, interval)
        pencil = self._pencil(x)
        if method == "dense":
            values, vectors = symmetric_eigenpairs(pencil, spectrum.shift, number)
            errors = np.full(len(values), np.finfo(float).eps)
        else:
            reduction = Reduction(pencil)
            if method == "cayley":
                found = self._cayley(reduction, number)
            else:
                found = reduction.near(number, spectrum.shift)
                self._made += 3
            values, vectors, errors = found.values, found.vectors, found.errors
        return values, self._lift(vectors), errors, self._proved(values)

    def _proved(self, values: np.ndarray) -> bool:
        """Whether counts find none below the least of ``values``, and as many as there are below the greatest."""
        spectrum = self.spectrum
        assert spectrum is not None
        small = 1e-6 * max(abs(values).max(), spectrum.inertia.scale)
        distinct = values < values[-1] - small
        return (
            spectrum.below(values[0] - small) == 0
            and spectrum.below(values[-1] - small) == distinct.sum()
            and spectrum.below(values[-1] + small) >= len(values)
        )

    def _cayley(self, reduction: Reduction, number: int) -> Any:
        """Left-most eigenvalues by Cayley's transform with the paper's parameters, from estimates or the last state."""
        assert self.spectrum is not None
        most = reduction.projection.kernel.dimension
        for fresh in (False, True):
            if self._estimates is None or fresh:
                self._estimates = two_distinct(reduction.near(3, self.spectrum.shift).values)
                self._made += 3
            shift, antishift = cayley_parameters(*self._estimates)
            try:
                # the first two are equally far from the shift: more are asked for than wanted where they are multiple
                found = reduction.near(min(number + 2, most), shift, "cayley", antishift)
            except ConvergenceError:
                continue
            self._made += 3
            first = found.values[0] - 1e-6 * max(abs(found.values).max(), 1e-3)
            if found.certified and self.spectrum.below(first) == 0:
                break
        else:
            found = reduction.near(number, self.spectrum.shift)
            self._made += 3
            self._note = ", but a count found some missing (equal eigenvalues): completed by shift-invert"
        if number > 1:
            self._estimates = two_distinct(found.values)
        return replace(
            found, values=found.values[:number], vectors=found.vectors[:, :number], errors=found.errors[:number]
        )

    def _slices(
        self, number: int, interval: tuple[float, float] | None
    ) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray, bool]:
        """All eigenvalues in an interval, or in one found by counting that holds ``number`` of them and few more."""
        spectrum = self.spectrum
        assert spectrum is not None
        low, high = interval or self._enclose(number)
        if not low < high:
            raise SceneError(f"An interval from {low:g} to {high:g} is empty: give its lower end first.")
        for wider in WIDER:  # an end on an eigenvalue is moved off it
            low, high = low - wider * (high - low), high + wider * (high - low)
            wanted = spectrum.below(high) - spectrum.below(low)
            try:
                solver = in_interval(spectrum.matrix, spectrum.mass, low, high)
                solver.solve()
            except PETSc.Error as trouble:
                if trouble.ierr != PETSC_ERR_PLIB:
                    raise
            else:
                break
        else:
            raise ConvergenceError(f"An end of the interval from {low:.6g} to {high:.6g} is an eigenvalue: move it.")
        values = np.array([solver.getEigenvalue(i).real for i in range(solver.getConverged())])
        complete = len(values) == wanted
        order = np.argsort(values)[: None if interval else number]
        vectors = [self.system.new_vector() for _ in order]
        for i, vector in zip(order, vectors, strict=True):
            solver.getEigenvector(int(i), vector)
        solver.destroy()
        self._made += 3
        values = values[order]
        return values, vectors, spectrum.backward_errors(values, vectors), complete

    def _enclose(self, number: int) -> tuple[float, float]:
        """Interval from below the spectrum that holds at least ``number`` eigenvalues, and not many more."""
        spectrum = self.spectrum
        assert spectrum is not None
        low, step = spectrum.shift, max(abs(spectrum.shift), spectrum.inertia.scale) * 1.0371
        high = low + step
        inside = low
        while spectrum.below(high) < number:
            inside, step = high, 2 * step
            high = inside + step
        for _ in range(20):
            if spectrum.below(high) <= 2 * number:
                break
            middle = inside + 0.4931 * (high - inside)
            if spectrum.below(middle) < number:
                inside = middle
            else:
                high = middle
        return low, high

    # --- others ------------------------------------------------------------------------------------------------

    def _non_symmetric(self, x: PETSc.Vec, method: str, number: int) -> tuple[np.ndarray, list[PETSc.Vec], np.ndarray]:
        """Eigenvalues nearest zero of a pencil without symmetry."""
        if method == "shift-invert":
            assert self.vibration is not None
            self.vibration.assemble(x)
            near = self.vibration.near(number, 0.0)
            nearest = np.sort(np.argsort(abs(near.values), kind="stable")[:number])
            self._made += 1
            return near.values[nearest], [], near.errors[nearest]
        pencil = self._pencil(x)
        if method == "reduction":
            target = 1e-3 * self.system.stiffness_scale
            found = Reduction(pencil).near(number, target)
            self._made += 1
            return found.values, [], found.errors
        values = eigenvalues_near(pencil, 1e-3 * self.system.stiffness_scale)
        values = values[np.argsort(abs(values), kind="stable")[:number]]
        order = np.lexsort((values.imag, np.round(values.real, 9)))
        return values[order], [], np.full(len(values), np.finfo(float).eps)

    def _pencil(self, x: PETSc.Vec, coordinates: str = "tangent") -> Pencil:
        """Blocks at ``x``, with a constraint ``g.Mx = 0`` more for each symmetry mode ``g``."""
        if self._blocks is None or self._blocks.coordinates != coordinates:
            self._blocks = Blocks(self.system, coordinates)
        blocks = self._blocks
        modes = symmetry_modes(self.system, x)
        pencil = blocks.assemble(x)
        self._map = gathered(pencil.T) if pencil.T is not None else None
        if not modes:
            return pencil
        comm = self.system.comm
        images = []
        for _, weighed in weighed_modes(self.system, modes, blocks.mass).values():
            full = weighed.array_r[blocks.rows - self.system.fields.offset].copy()
            image = PETSc.Vec().createWithArray(full, comm=comm)
            if pencil.T is not None:
                image, product = pencil.T.createVecRight(), image
                pencil.T.multTranspose(product, image)
            images.append(image.array_r.copy())
        last = comm.rank == comm.size - 1
        local = sp.hstack([local_rows(pencil.C), np.stack(images, axis=1)]).tocsr()
        local.sort_indices()
        rows, columns = pencil.C.getLocalSize()
        size = ((rows, PETSc.DETERMINE), (columns + len(modes) * last, PETSc.DETERMINE))
        csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
        C = PETSc.Mat().createAIJ(size, csr=csr, comm=comm)
        return replace(pencil, C=C, place=np.append(pencil.place, np.full(len(modes), np.nan)))

    def _lift(self, vectors: np.ndarray) -> list[PETSc.Vec]:
        """Vectors of the system from columns in the pencil's coordinates."""
        blocks = self._blocks
        assert blocks is not None
        full: Any = vectors if self._map is None else self._map @ vectors
        first = first_of(self.system.comm, len(blocks.rows))
        out = []
        for column in full.T:
            vector = self.system.new_vector()
            vector.array[blocks.rows - self.system.fields.offset] = column[first : first + len(blocks.rows)]
            vector.assemble()
            out.append(vector)
        return out


def two_distinct(values: np.ndarray) -> tuple[float, float]:
    """The least of ``values``, and the next one that is not equal to it."""
    first = float(values[0])
    others = values[values > first + DISTINCT * abs(values).max()]
    return first, float(others[0]) if len(others) else first + 0.5 * abs(values).max()


def judge(source: Any, x: PETSc.Vec, method: str = "auto", number: int = 4) -> Verdict:
    """Judge one state of a system or follower: see :class:`Judge`, which is to be kept along a branch."""
    return Judge(source)(x, method, number)

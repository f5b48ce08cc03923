r"""The index of an equilibrium from the inertia of its saddle matrix.

At fixed load the second variation and the constraints form the saddle matrix ``S = (K C; C^t 0)``.  Where ``C``
has full column rank, Sylvester's law of inertia gives

    (negative eigenvalues of S) - (number of constraints) = number of negative eigenvalues of K on the kernel of C,

and likewise for ``S - sigma M`` the number of eigenvalues below ``sigma``.  Counting at ``sigma = -tol`` and
``+tol`` separates zero eigenvalues from small ones without ever factoring a singular matrix.  Symmetry modes do not
disturb: the phase condition counts as one more constraint, and takes the zero mode out of the kernel.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.compiled_newton import CompiledNewton
from rodfem.fem.phase import Phase
from rodfem.fem.state import State
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain
from rodfem.linalg.factorization import Factors, Sizes
from rodfem.linalg.matrices import local_rows, places_in, rounding, shared
from rodfem.linalg.orthogonal import Basis, combine, generic, orthonormalize
from rodfem.linalg.selection import factors_of
from rodfem.tolerances import TINY

EPS = float(np.finfo(float).eps)
NOISE = 8.0
"""Largest observed ratio of the round-off in an eigenvalue to the effect of random errors of the matrix's entries."""
ZERO_BAND = 1e-7
"""Half width of the band of eigenvalues that count as zero, over the lowest bending one, where round-off is below."""
NULL, ROUGH = 1e-8, 1e-2
"""Relative change of eigenvalues nearest zero at which their vectors are null vectors, and first guesses of a mode."""
EXPANDED, DEPTH = 4, 5
"""Iterations of a block before a Krylov space takes its place, and blocks of that space."""
DEPENDENT = 1e-10
"""Part of a vector that is left across a space, below which it spans nothing new."""
FRESH = 1e-3
"""Weight of a generic vector that is added to each vector of a block before it is iterated."""
FAR = 0.1
"""Shift of the factors, over the lowest bending eigenvalue, above which they lead to others than those near zero."""
PIVOT = 1e-3
"""Threshold of MUMPS's pivots, relative to the largest entry of a column."""


@dataclass(frozen=True)
class Index:
    """Numbers ``negative`` and ``zero`` of eigenvalues of the constrained second variation, symmetry modes among these.

    ``nearest`` is an estimate of the distance of the nearest eigenvalue from zero, symmetry modes left out; 0 where
    there is none.
    """

    negative: int
    zero: int
    nearest: float = field(default=0.0, compare=False)


def inertia_factors(comm: MPI.Comm, unknowns: int, scalars: int, sizes: Sizes | None = None) -> Factors:
    """LDL^t factors that report the inertia, of matrices of ``unknowns`` rows, the last ``scalars`` perhaps dense.

    The matrices are those of a communicator ``comm``; ``sizes`` are the natural sizes of the unknowns, None where they
    are one.

    ICNTL(24) = 1 is what makes MUMPS report it; CNTL(3) is so small that no pivot is taken for zero: the matrices are
    shifted off their eigenvalues.  ICNTL(8) = 0: with MUMPS's own scaling of saddle matrices solutions were seen to
    lose ten digits, and factorisations take up to ten times as long.  CNTL(1) is ten times below MUMPS's own threshold:
    the stiffness is 1/h and the constraints are h, and at 1e5 elements pivots were delayed by the hundred thousand, to
    the few rows of the scalars, which cost several times the factorisation itself.
    """
    return factors_of("cholesky", comm, unknowns, scalars, {24: 1, 8: 0}, {3: -TINY, 1: PIVOT}, sizes=sizes)


class Inertia:
    """Matrix ``S`` and its factors, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`.

    Eigenvalues ``mu`` are relative to the system's metric.  ``tolerance`` is the half width of what counts as zero, the
    larger of 1e-7 of the rod's lowest bending eigenvalue and of ``resolution``, the band of round-off.
    ``vectors`` are those that :meth:`Factored.nearest` found last.
    """

    def __init__(self, system: System) -> None:
        """Allocate the matrix and its LDL^t factors once."""
        self.system = system
        self.matrix = system.state_matrix(load=True)
        self.border = system.new_vector()
        self._axis = system.load_axis()
        self._without_load = system.new_vector()
        self._without_load.set(1.0)
        system.set_load(self._without_load, 0.0)
        self.metric = system.metric.copy()
        if system.has_scalars:  # the load is no part of a perturbation
            self.metric.setValue(system.load_index, system.load_index, 0.0)
        self.metric.assemble()
        self._weights = local_rows(self.metric) if system.comm.size == 1 else None
        self._shared, self._on_metric = shared(self.matrix), np.zeros(0, dtype=int)
        if self._shared is not None and self._weights is not None:
            self._on_metric = places_in(self._shared.pattern, self._weights)
        self.factors = inertia_factors(system.comm, system.fields.along, system.fields.dense_rows, system.natural_sizes)
        self.constraints = system.fields.constraints()
        self.scale = system.stiffness_scale
        self.tolerance = ZERO_BAND * self.scale
        self.resolution = 0.0
        self.vectors: list[PETSc.Vec] = []
        self.shift, self.filled, self.factored = 0.0, 0, 0
        self._held: tuple[State, Phase, int] | None = None
        self.compiled: CompiledNewton | None = None
        if isinstance(self.factors, Chain) and CompiledNewton.serves(self.matrix, self.factors):
            self.compiled = CompiledNewton(system, self.matrix, self.factors)

    def at(self, x: PETSc.Vec) -> Factored:
        """Assemble ``S`` at an equilibrium ``x``, with its phase conditions, unless the matrix is that one.

        The symmetries are verified there.
        """
        self.system.set_phase(x)
        state = self.system.at(x)
        if not self._holds(state):
            self._assemble(x, state)
            # a generator that is no null vector of S is no symmetry: verify drops its phase condition
            with self.system.clock("stability"):
                sound = self.system.verify(self.matrix, state)
            if not sound:
                self._assemble(x, state)
            self.filled += 1
            self._held = state, self.system.phase, self.matrix.stateGet()
        return Factored(self)

    def _holds(self, state: State) -> bool:
        """Whether the matrix is ``S`` at a state, with its phase conditions."""
        held, phase, changes = self._held or (None, None, 0)
        return held is state and phase is self.system.phase and changes == self.matrix.stateGet()

    def _assemble(self, x: PETSc.Vec, state: State) -> None:
        system = self.system
        with system.clock("assembly"):
            if self.compiled is not None:
                self.compiled.assemble(x)
                self.border.array[:] = self.compiled.border
            else:
                self._assemble_by_petsc(state)
        self.shift = 0.0
        self._settle_band()

    def _assemble_by_petsc(self, state: State) -> None:
        system = self.system
        self.matrix.zeroEntries()
        state.assemble_into(self.matrix, system.equations.jacobian, load=True)
        system.add_drifts(self.matrix)
        self.matrix.assemble()
        # at fixed load: the column of the load becomes the border F_lam, a unit diagonal stands for its unknown
        self.matrix.mult(self._axis, self.border)
        self.matrix.diagonalScale(R=self._without_load)
        if system.has_scalars:
            self.matrix.setValue(system.load_index, system.load_index, 1.0)
        self.matrix.assemble()

    def move(self, sigma: float) -> None:
        """Let the matrix be ``S - sigma M``, whatever its shift was."""
        by, self.shift = self.shift - sigma, sigma
        if by and self._shared is not None and self._weights is not None:
            self._shared.values[self._on_metric] += by * self._weights.data
        elif by:
            self.matrix.axpy(by, self.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        if by:
            self.matrix.stateIncrease()  # a parallel axpy does not count as a change of the matrix by itself

    def _settle_band(self) -> None:
        system = self.system
        if not self.resolution:  # the band of round-off, eps |S| / m, for the smallest weight m of the metric
            weights = self.metric.getDiagonal()  # not the load's, which has the units of the span
            weights.pointwiseMult(weights, system.sizes * system.sizes)
            mass = weights.array_r[weights.array_r > 0]
            smallest = system.comm.allreduce(float(mass.min()) if len(mass) else np.inf, op=MPI.MIN)
            self.resolution = 10 * EPS * system.matrix_in_units(self.matrix).norm(PETSc.NormType.INFINITY) / smallest
            self.tolerance = max(self.tolerance, self.resolution)

    def forget_band(self) -> None:
        """Settle the band of round-off, and that of symmetries, at the next state."""
        self.resolution, self.tolerance, self._held = 0.0, ZERO_BAND * self.scale, None
        self.system.verification.norm = 0.0

    @contextmanager
    def afresh(self) -> Iterator[None]:
        """Let :meth:`Factored.nearest` begin without the ``vectors`` found before, and leave these as they were."""
        kept, self.vectors = self.vectors, []
        try:
            yield
        finally:
            self.vectors = kept

    def modes_near_zero(self, x: PETSc.Vec, number: int, accuracy: float = NULL) -> list[PETSc.Vec]:
        """Vectors of the ``number`` eigenvalues nearest zero at ``x``: see :meth:`Factored.nearest`."""
        found = self.at(x)
        found.count()
        return found.nearest(number, accuracy)[1]

    def weighed(self, own: np.ndarray) -> np.ndarray:
        """Metric times vectors, the columns of ``own`` (own rows, count)."""
        if self._weights is not None:
            return np.asarray(self._weights @ own)
        vector, out = self.system.new_vector(), np.empty_like(own)
        for i in range(own.shape[1]):
            vector.array[:] = own[:, i]
            out[:, i] = (self.metric * vector).array_r.real
        return out

    def sum(self, own: np.ndarray) -> np.ndarray:
        """Sum over the ranks."""
        return own if self.system.comm.size == 1 else np.asarray(self.system.comm.allreduce(own, op=MPI.SUM))

    def seed(self, i: int) -> PETSc.Vec:
        """Generic vector: components along all unknowns of fields, none along scalars."""
        vector = self.system.new_vector()
        begin, end = vector.getOwnershipRange()
        numbers = np.arange(begin, min(end, self.system.fields.field_unknowns))
        vector.array[: len(numbers)] = generic(numbers, i)
        return vector


class Factored:
    """``S`` at one state, and the results of its factors: a count, the eigenvalues nearest zero, solutions.

    Raises :class:`RuntimeError` where the matrix holds another state by now, or what is asked for needs factors
    (:meth:`below`, :meth:`count`) that were not made: a number of another state is never returned.
    """

    def __init__(self, inertia: Inertia) -> None:
        """Stand for the state that the matrix was just filled for."""
        self.inertia, self._filled, self.drifts = inertia, inertia.filled, inertia.system.phase.count

    def _own(self) -> Inertia:
        """Matrix and factors, while they are those of this state."""
        if self.inertia.filled != self._filled:
            raise RuntimeError("The matrix holds another state by now: ask for this one again, by Inertia.at.")
        return self.inertia

    @property
    def factors(self) -> Factors:
        """Factors of ``S - shift M``; raises :class:`RuntimeError` before a count has made them."""
        inertia = self._own()
        if inertia.factored != self._filled:
            raise RuntimeError("The matrix of this state was not factored: count first.")
        return inertia.factors

    @property
    def matrix(self) -> PETSc.Mat:
        """``S - shift M``."""
        return self._own().matrix

    @property
    def border(self) -> PETSc.Vec:
        """Derivative of the equations in the load."""
        return self._own().border

    @property
    def shift(self) -> float:
        """Shift of the last count."""
        return self._own().shift

    def below(self, sigma: float) -> int:
        """Number of eigenvalues below ``sigma``; symmetry modes not counted.

        Raises :class:`ConvergenceError` where the count breaks down.
        """
        own = self._own()
        with own.system.clock("stability"):
            if own.factored != self._filled or own.shift != sigma:
                own.move(sigma)
                own.factors(own.matrix)
                own.factored = self._filled
        return self.counted()

    def counted(self) -> int:
        """Number of eigenvalues below the shift that was factored; symmetry modes not counted.

        Raises :class:`ConvergenceError` where the count breaks down.
        """
        own, (negative, zero) = self._own(), self.factors.inertia()
        # Sylvester's law: each constraint, and each phase condition, has one negative eigenvalue of the saddle matrix
        below = negative - own.constraints - self.drifts
        if zero or below < 0:
            raise ConvergenceError(
                f"The count of eigenvalues below {own.shift:.2g} broke down ({zero} zero pivots, {negative} negative "
                f"ones for {own.constraints} constraints): the constraints depend on each other."
            )
        return int(below)

    def count(self) -> Index:
        """Index; two factorisations, the last of which serves :meth:`nearest`."""
        own = self._own()
        negative = self.below(-own.tolerance)
        # a phase condition takes its symmetry mode out of both counts, and it is a zero eigenvalue of the state
        zero = self.below(own.tolerance) - negative + self.drifts
        return Index(negative, zero)

    def nearest(
        self, number: int, accuracy: float = 1e-3, most: int = 60, spare: int = 1
    ) -> tuple[np.ndarray, list[PETSc.Vec]]:
        """Return the eigenvalues nearest zero, and their vectors (metric norm 1).

        Block inverse iteration from the vectors of the last call, with a Rayleigh-Ritz projection of ``S``, until the
        ``number`` wanted values change by less than ``accuracy`` relative to themselves (or by what the arithmetic
        resolves).  The block has ``spare`` more vectors.  It converges as the ratio of the eigenvalues inside it to the
        next one, slowly where these are close: every few iterations a Krylov space takes its place, where all converge
        much faster.  At most ``most`` iterations are made.  Factors of a count at the edge of a wide band of round-off
        are replaced by others.
        """
        own, block = self._own(), number + spare
        if own.factored == self._filled and abs(own.shift) > FAR * own.scale:
            self.below(ZERO_BAND * own.scale)
        vectors = own.vectors[:block] + [own.seed(i) for i in range(len(own.vectors), block)]
        values = np.full(block, np.inf)
        for i, v in enumerate(vectors):
            v.axpy(FRESH, own.seed(i))  # the old vectors may span an invariant space that misses the nearest one
        with own.system.clock("stability"):
            for iteration in range(most):
                own.system.tidy(block)
                if iteration and iteration % EXPANDED == 0:
                    vectors = self._in_krylov_space(vectors)
                solved = self._inverse(vectors)
                orthonormalize(solved, own.metric)
                images = [own.matrix * y for y in solved]
                # Rayleigh-Ritz: the quotients of S - shift M on the block, whose basis is orthonormal in M
                theta, z = np.linalg.eigh(np.array([[y.dot(w) for w in images] for y in solved]))
                order = np.argsort(abs(theta + own.shift))
                last, values = values, theta[order] + own.shift
                vectors = [combine(solved, z[:, j]) for j in order]
                change = abs(values - last)[:number]
                # a wide band of round-off is that of rough vectors: it does not excuse an inexact smooth one
                floor = min(own.resolution, accuracy * own.scale)
                if np.all(change <= np.maximum(accuracy * abs(values[:number]), floor)):
                    break
        own.vectors = vectors
        return values[:number], [v.copy() for v in vectors[:number]]

    def _inverse(self, vectors: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """``S^-1 M`` of vectors."""
        out = [v.duplicate() for v in vectors]
        for v, solved in zip(vectors, out, strict=True):
            self.factors.solve(self.inertia.metric * v, solved)
        return out

    def _in_krylov_space(self, block: list[PETSc.Vec]) -> list[PETSc.Vec]:
        """As many Ritz vectors of ``A = S^-1 M`` in the space of ``block, A block, ...``, for its largest eigenvalues.

        Block Lanczos with full orthogonalisation.  The projection is that of ``A``, whose eigenvalues of interest are
        outermost: one of ``S`` would have values near zero that are nobody's.
        """
        basis, new = Basis(self.inertia.metric), block
        images: list[PETSc.Vec] = []
        for _ in range(DEPTH):
            for v in new:
                basis.add(v.copy(), DEPENDENT)
            new = self._inverse(basis.vectors[len(images) :])
            images += new
        if len(images) < len(block):  # a mesh of a few unknowns has no more
            return block
        projection = np.array([[dual.dot(w).real for w in images] for dual in basis.duals])
        nu, z = np.linalg.eigh((projection + projection.T) / 2)
        return [combine(basis.vectors, z[:, j]) for j in np.argsort(-abs(nu))[: len(block)]]

    def noise(self, mode: PETSc.Vec) -> float:
        r"""Round-off in the eigenvalue of a ``mode`` of metric norm 1.

        First-order perturbation theory: entries ``S_ij`` that err by ``eps |S_ij|`` each, at random, move it by
        ``eps sqrt(sum (S_ij mode_i mode_j)^2)``; :data:`NOISE` times that is returned.
        """
        return NOISE * rounding(self.matrix, mode, mode)

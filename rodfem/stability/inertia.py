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
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.newton import compiled_newton
from rodfem.linalg.chain import Factors
from rodfem.linalg.matrices import EPS, local_rows, places_in, rounding, shared, times
from rodfem.linalg.orthogonal import generic
from rodfem.problem.functions import derived
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.fem.state import State
    from rodfem.fem.symmetries import Phase
    from rodfem.fem.system import System

NOISE = 8.0
"""Largest observed ratio of the round-off in an eigenvalue to the effect of random errors of the matrix's entries."""
ZERO_BAND = 1e-7
"""Half width of the band of eigenvalues that count as zero, over the lowest bending one, where round-off is below."""
NULL, ROUGH = 1e-8, 1e-2
"""Relative change of eigenvalues nearest zero at which their vectors are null vectors, and first guesses of a mode."""
ROUNDED = 1e-13
"""Residual over the largest eigenvalue of the inverse, and square of the part of a vector across others, that is
round-off."""
FRESH = 1e-3
"""Weight of a generic vector that is added to each vector of a block before it is iterated."""
REGULAR = 1e-5
"""Distance of the nearest eigenvalue from zero, over the lowest bending one, from which on one factorisation serves."""
DOUBTFUL = 1e-3
"""The same below which what factors tell is sharpened once: solutions, and an estimate of that distance."""
DECIDED = 1e-3
"""Relative accuracy of eigenvalues that decide a sign."""
SPARE = 2
"""Vectors more than there are eigenvalues in the band."""
FAR = 0.1
"""Shift of the factors, over the lowest bending eigenvalue, above which they lead to others than those near zero."""


@dataclass(frozen=True)
class Index:
    """Numbers ``negative`` and ``zero`` of eigenvalues of the constrained second variation; symmetries are zero ones.

    ``nearest`` estimates the distance of the nearest other eigenvalue from zero; 0 where there is no estimate.
    """

    negative: int
    zero: int
    nearest: float = field(default=0.0, compare=False)


@dataclass(frozen=True)
class Quotients:
    """Rayleigh quotients ``values`` (k,) of ``vectors``, and their ``uncertainty`` (k,) by round-off in the matrix."""

    values: np.ndarray
    vectors: list[PETSc.Vec]
    uncertainty: np.ndarray

    @property
    def negative(self) -> int:
        """Number of those that are negative."""
        return int((self.values < -self.uncertainty).sum())

    @property
    def zero(self) -> int:
        """Number of those that are zero to working accuracy."""
        return int((abs(self.values) <= self.uncertainty).sum())


def quotient_error(matrix: PETSc.Mat, y: PETSc.Vec) -> float:
    """Ten times the change of ``y.Sy`` by independent relative errors eps of all entries of S."""
    return 10 * rounding(matrix, y, y)


class Inertia:
    """Matrix ``S`` and its factors, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`.

    Eigenvalues ``mu`` are relative to the system's metric.  ``tolerance`` is the half width of what counts as zero, the
    larger of 1e-7 of the rod's lowest bending eigenvalue and of ``resolution``, the band of round-off.
    ``vectors`` are those that :meth:`Factored.nearest` found last, and the columns of ``edge`` (own rows, k) the border
    of a branch: the metric times modes near zero, with which :meth:`Factored.solutions` are made as well.
    """

    def __init__(self, system: System) -> None:
        self.system, self.sum, fields = system, system.sum, system.fields
        self.matrix, self.border = system.state_matrix(load=True), system.new_vector()
        self._axis, self._without_load = system.load_axis(), system.new_vector()
        self._without_load.set(1.0)
        system.set_load(self._without_load, 0.0)
        self.metric = system.metric.copy()
        if system.has_scalars:  # the load is no part of a perturbation
            self.metric.setValue(system.load_index, system.load_index, 0.0)
        self.metric.assemble()
        self._weights, self._shared = local_rows(self.metric).real, shared(self.matrix)
        self._on_metric = None if self._shared is None else places_in(self._shared.pattern, self._weights)
        self.factors = fields.factors("cholesky", system.natural_sizes)
        self.constraints, self.scale = fields.constraints(), system.stiffness_scale
        self.tolerance, self.resolution = ZERO_BAND * self.scale, 0.0
        self.vectors: list[PETSc.Vec] = []
        self.edge = np.zeros((self.border.local_size, 0))
        self.relaxed = 0, self.edge, self.edge  # of which matrix, for which border, and the solutions
        self.shift, self.filled, self.factored = 0.0, 0, 0
        self.bordered: dict[int, Any] = {}  # see rodfem.stability.reduced_stiffness
        self._held: tuple[State, Phase, int] | None = None
        self.compiled = compiled_newton(system, self.matrix, self.factors)

    def at(self, x: PETSc.Vec) -> Factored:
        """Assemble ``S`` at an equilibrium ``x``, with its phase conditions."""
        self.system.set_phase(x)
        state = self.system.at(x)
        held, phase, changes = self._held or (None, None, 0)
        if not (held is state and phase is self.system.phase and changes == self.matrix.stateGet()):
            self._assemble(x, state)
            self.filled += 1
            self._held = state, self.system.phase, self.matrix.stateGet()
        return Factored(self)

    def images(self, x: PETSc.Vec, own: np.ndarray, *, transposed: bool = False) -> np.ndarray:
        """Products of ``(S F_lam)`` near the last state, at ``x``, or of its transpose, with columns (own rows, k).

        Phase conditions stay, and so do the matrix and its factors, if code is compiled.  The row of the load is zero.
        """
        if self.compiled is not None:
            with self.system.clock("assembly"):
                return self.compiled.images(x, own, transposed=transposed)
        self._assemble(x, self.system.at(x))
        self.filled += 1
        out = np.empty_like(own)
        for column, image in zip(own.T, out.T, strict=True):
            change, product = self.system.new_vector(column), self.system.new_vector()
            load = self.system.scalar(change)
            self.system.set_load(change, 0.0)
            (self.matrix.multTranspose if transposed else self.matrix.mult)(change, product)
            product.axpy(load, self.border)
            self.system.set_load(product, 0.0)
            image[:] = product.array_r.real
        return out

    def force(self, x: PETSc.Vec) -> PETSc.Vec:
        """Derivative of the equations in the load at ``x``."""
        return self.system.new_vector(self.images(x, self._axis.array_r[:, None])[:, 0])

    def _assemble(self, x: PETSc.Vec, state: State) -> None:
        with self.system.clock("assembly"):
            if self.compiled is not None:
                self.compiled.assemble(x)
                self.border.array[:] = self.compiled.border
            else:
                self._assemble_by_petsc(state)
        self.shift = 0.0
        self._settle_band()

    def _assemble_by_petsc(self, state: State) -> None:
        system, matrix = self.system, self.matrix
        matrix.zeroEntries()
        state.assemble_into(matrix, system.equations.jacobian, load=True)
        system.add_drifts(matrix)
        matrix.assemble()
        # at fixed load: the column of the load becomes the border F_lam, a unit diagonal stands for its unknown
        matrix.mult(self._axis, self.border)
        matrix.diagonalScale(R=self._without_load)
        if system.has_scalars:
            matrix.setValue(system.load_index, system.load_index, 1.0)
        matrix.assemble()

    def move(self, sigma: float) -> None:
        """Let the matrix be ``S - sigma M``, whatever its shift was."""
        by, self.shift = self.shift - sigma, sigma
        if not by:
            return
        if self._shared is not None:
            self._shared.values[self._on_metric] += by * self._weights.data
        else:
            self.matrix.axpy(by, self.metric, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self.matrix.stateIncrease()  # a parallel axpy does not count as a change of the matrix by itself

    def _settle_band(self) -> None:
        """The band of round-off, ``eps |S| / m`` for the smallest weight m of the metric, of the first state."""
        if self.resolution:
            return
        system, weights = self.system, self.metric.getDiagonal()  # without the load's, which has the units of the span
        weights.pointwiseMult(weights, system.sizes * system.sizes)
        smallest = system.comm.allreduce(weights.array_r[weights.array_r > 0].min(initial=np.inf), op=MPI.MIN)
        self.resolution = 10 * EPS * system.matrix_in_units(self.matrix).norm(PETSc.NormType.INFINITY) / smallest
        self.tolerance = max(self.tolerance, self.resolution)

    @property
    def regular(self) -> float:
        """Distance of the nearest eigenvalue from zero from which on factors of ``S`` itself count and solve."""
        return REGULAR * self.scale + 10 * self.tolerance

    def forget_band(self) -> None:
        """Settle the band of round-off at the next state."""
        self.resolution, self.tolerance, self._held = 0.0, ZERO_BAND * self.scale, None

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
        return times(self._weights, self.system.whole(own))

    def times(self, own: np.ndarray) -> np.ndarray:
        """The matrix times vectors, the columns of ``own`` (own rows, count)."""
        rows = local_rows(self.matrix).real if self._shared is None else self._shared.matrix
        return times(rows, self.system.whole(own))

    def counted(self, factors: Factors, sigma: float, drifts: int) -> int:
        """Number of eigenvalues below ``sigma`` by ``factors`` of ``S - sigma M`` with ``drifts`` phase conditions.

        Raises :class:`ConvergenceError` if the count breaks down.
        """
        negative, zero = factors.inertia()
        # Sylvester's law: each constraint, and each phase condition, has one negative eigenvalue of the saddle matrix
        below = negative - self.constraints - drifts
        if zero or below < 0:
            raise ConvergenceError(
                f"The count of eigenvalues below {sigma:.6g} broke down ({zero} zero pivots, {negative} negative ones "
                f"for {self.constraints} constraints): the constraints depend on each other."
            )
        return int(below)

    def extension(self, own: np.ndarray, basis: np.ndarray, duals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Basis of what vectors (own rows, k) span in addition to a ``basis``, and its products with the metric.

        Both are orthonormal in the metric, ``duals`` are its products with the ``basis``.
        """
        size = self.sizes(own)
        own = own[:, size > 0] / size[size > 0]
        for least in (1e-10, 0.5):  # what little is left of a vector has round-off of all of it: again
            own = own - basis @ self.sum(duals.T @ own)
            images = self.weighed(own)
            left = np.sqrt(np.maximum(self.sum((own * images).sum(axis=0)), TINY))
            own, images = own[:, left > least] / left[left > least], images[:, left > least] / left[left > least]
            squares, turn = np.linalg.eigh(self.sum(own.T @ images))
            turn = turn[:, squares > ROUNDED] / np.sqrt(squares[squares > ROUNDED])
            own, images = own @ turn, images @ turn
        return own, images

    def sizes(self, own: np.ndarray) -> np.ndarray:
        """Norms (k,) of vectors (own rows, k) in the metric."""
        return np.sqrt(np.maximum(self.sum((own * self.weighed(own)).sum(axis=0)), 0.0))

    def seed(self, i: int) -> PETSc.Vec:
        """Generic vector with components along all unknowns of fields, none along scalars."""
        vector = self.system.new_vector()
        begin, end = vector.getOwnershipRange()
        numbers = np.arange(begin, min(end, self.system.fields.field_unknowns))
        vector.array[: len(numbers)] = generic(numbers, i)
        return vector

    def waves(self, count: int) -> list[PETSc.Vec]:
        """Products with the metric of smooth changes of a state, which know no mesh and no ranks."""
        fields, vector = self.system.fields, self.system.vector
        waves = range(1, count + 1)
        return derived(self, count, lambda: [self.metric * vector(fields.sizes * fields.wave(i)) for i in waves])


class Factored:
    """``S`` at one state, and the results of its factors: a count, the eigenvalues nearest zero, solutions.

    Raises :class:`RuntimeError` where the matrix holds another state by now, or before :meth:`below` or :meth:`count`
    have made factors.
    """

    def __init__(self, inertia: Inertia) -> None:
        self.inertia, self._filled, self.drifts = inertia, inertia.filled, inertia.system.phase.count

    def _own(self) -> Inertia:
        if self.inertia.filled != self._filled:
            raise RuntimeError("The matrix holds another state by now: ask for this one again, by Inertia.at.")
        return self.inertia

    @property
    def factors(self) -> Factors:
        """Factors of ``S - shift M``; raises :class:`RuntimeError` before a count."""
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

    def eigenvalue_count(self, sigma: float) -> int:
        """Number of eigenvalues below ``sigma``, symmetries left out; :class:`ConvergenceError` if the count fails."""
        own = self._own()
        with own.system.clock("stability"):
            if own.factored != self._filled or own.shift != sigma:
                own.move(sigma)
                own.factors(own.matrix)
                own.factored = self._filled
        return own.counted(own.factors, own.shift, self.drifts)

    def solutions(self, right: np.ndarray) -> np.ndarray:
        """Solutions for the columns of ``right`` (own rows, k), and for those of the inertia's border."""
        own = self._own()
        out = self.factors.solve_all(np.hstack([right, own.edge]))
        own.relaxed = self._filled, own.edge, out[:, right.shape[1] :]
        return out

    def relaxed(self, edge: np.ndarray) -> np.ndarray:
        """Solutions for the columns of a border, which are known if it is that of the inertia."""
        filled, known, out = self._own().relaxed
        return out if filled == self._filled and known is edge else self.factors.solve_all(edge)

    def count(self) -> Index:
        """Index; two factorisations, the last of which serves :meth:`nearest`."""
        own = self._own()
        negative = self.eigenvalue_count(-own.tolerance)
        # a phase condition takes its symmetry mode out of both counts, and it is a zero eigenvalue of the state
        zero = self.eigenvalue_count(own.tolerance) - negative + self.drifts
        return Index(negative, zero)

    def nearest(self, number: int, accuracy: float = 1e-3, spare: int = 1) -> tuple[np.ndarray, list[PETSc.Vec]]:
        """Return the eigenvalues nearest zero, and their vectors (metric norm 1).

        Block Lanczos for the largest eigenvalues ``nu`` of ``A = S^-1 M`` with full orthogonalisation, restarted with a
        block of ``spare`` vectors more than the ``number`` wanted, first those of the last call, until each has the
        relative ``accuracy``, or what the arithmetic resolves, by its residual in the metric or by its last change.
        Values are the quotients of ``S`` then, fewer where the mesh has no more.  Factors at the edge of a wide band of
        round-off are replaced by others.  Raises :class:`InputError` where the mesh has none.
        """
        own, block = self._own(), number + spare
        if own.factored == self._filled and abs(own.shift) > FAR * own.scale:
            self.eigenvalue_count(ZERO_BAND * own.scale)
        # the old vectors may span an invariant space that misses the nearest one
        vectors = np.stack([own.seed(i).array_r.real for i in range(block)], axis=1)
        for column, known in zip(vectors.T, own.vectors, strict=False):
            column[:] = known.array_r.real + FRESH * column
        before = np.full(number, np.inf)
        with own.system.clock("stability"):
            for _ in range(20):
                nu, vectors, residuals = self._in_krylov_space(vectors)
                if self._settled(nu, before, residuals, accuracy):
                    break
                before = nu[:number]
            images = own.times(vectors)
            theta, z = np.linalg.eigh(own.sum(vectors.T @ images))
            if not len(theta):
                raise InputError("The mesh lets the rod move in no way: use more elements, or a higher degree.")
            order = np.argsort(abs(theta + own.shift))
            found = own.system.vectors(vectors @ z[:, order])
        own.vectors = found
        return (theta[order] + own.shift)[:number], [v.copy() for v in found[:number]]

    def _settled(self, nu: np.ndarray, before: np.ndarray, residuals: np.ndarray, accuracy: float) -> bool:
        """Whether the first k eigenvalues ``nu`` have an ``accuracy``, of 1 / nu relative to itself.

        Each is known to its residual ``r``, to ``r^2`` over its distance from the others (Kato 1949, Temple 1928), or
        to its change since it was ``before`` (k,).
        """
        wanted, others = np.split(nu, [len(before)])
        before, residuals = before[: len(wanted)], residuals[: len(wanted)]
        apart = abs(wanted[:, None] - others).min(axis=1, initial=np.inf)
        left = residuals * np.minimum(1.0, residuals / np.maximum(apart, TINY))
        # a wide band of round-off is that of rough vectors: it does not excuse an inexact smooth one
        floor = min(self.inertia.resolution, accuracy * self.inertia.scale)
        allowed = np.maximum(accuracy * abs(wanted), floor * wanted**2)
        left = np.minimum(left, abs(wanted - before))
        return bool((left <= np.maximum(allowed, ROUNDED * abs(wanted).max(initial=0.0))).all())

    def _in_krylov_space(self, block: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Eigenvalues of ``A`` in the space of ``block, A block, ...``, the largest in size first.

        Of as many as there are vectors, returns ``A`` times theirs, orthonormalised, and residuals, both in the metric.
        """
        own, size = self.inertia, block.shape[1]
        basis = duals = images = np.zeros((len(block), 0))
        new = block
        for _ in range(5):
            new, weighed = own.extension(new, basis, duals)
            if not new.shape[1]:
                break
            basis, duals = np.hstack([basis, new]), np.hstack([duals, weighed])
            new = self.factors.solve_all(weighed)
            images = np.hstack([images, new])
        projection = own.sum(duals.T @ images)
        nu, z = np.linalg.eigh((projection + projection.T) / 2)
        order = np.argsort(-abs(nu))
        # what constraints forbid has a nu of round-off: a small mesh has fewer motions than are asked for
        order = order[abs(nu[order]) > ROUNDED * max(1 / own.scale, abs(nu).max(initial=0.0))]
        nu, z = nu[order], z[:, order[:size]]
        vectors = images @ z
        residuals = own.sizes(vectors - basis @ z * nu[:size])
        return nu, own.extension(vectors, basis[:, :0], basis[:, :0])[0], residuals

    def quotients(self, vectors: list[PETSc.Vec], least: float) -> Quotients:
        """Rayleigh quotients of ``vectors`` of metric norm 1; ``least`` is the smallest uncertainty."""
        values = np.array([v.dot(self.matrix * v).real for v in vectors]) + self.shift
        return Quotients(values, vectors, np.array([max(quotient_error(self.matrix, v), least) for v in vectors]))

    def inside_band(self, number: int, accuracy: float = DECIDED, least: float = 0.0) -> Quotients:
        """The ``number`` eigenvalues inside the band of the count, of uncertainty ``least`` at least."""
        own, (theta, vectors) = self.inertia, self.nearest(number + SPARE, DECIDED)
        vectors = [vectors[i] for i in np.argsort(abs(theta))]
        small = int((abs(theta) < 1e-2 * own.scale).sum())  # an accuracy of 1e-3 decides the signs of all others
        if accuracy < DECIDED and small:
            vectors[:small] = self.nearest(small, accuracy)[1]
            own.vectors = list(vectors)
        out = self.quotients(vectors[:number], least)
        if (abs(out.values) > 2 * own.tolerance).any():
            raise ConvergenceError(
                f"{number} eigenvalues are within round-off of the count, {own.tolerance:.2g} in the metric, and are "
                "not distinct: take larger elements, or a lower degree."
            )
        return out

    def noise(self, mode: PETSc.Vec) -> float:
        """Round-off in the eigenvalue of a ``mode`` of metric norm 1: :data:`NOISE` times that of its quotient."""
        return NOISE * rounding(self.matrix, mode, mode)

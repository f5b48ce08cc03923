r"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load
couples the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real
axis: flutter.

Eigenvalues are found by shift-invert.  A complex PETSc takes a complex shift ``a + i b`` as it is, and is used where
it is what is installed.  A real one needs no more than twice the size: with vectors written as pairs of their real and
imaginary parts, ``S - (a + i b) M`` is the real matrix ::

    ( S - a M     b M   )
    (  -b M     S - a M )

whose pencil with ``diag(M, M)`` has the eigenvalues ``mu - (a + i b)`` and their conjugates; those with vectors
of the form ``(x, -i x)`` belong to the first kind.

A motion ``g`` that nothing holds has ``S g = 0``.  The pencil is bordered by ``M g`` on both sides: an eigenvector
``x`` of ``mu`` becomes ``x - g (g.Mx)`` with the multiplier ``-mu (g.Mx)``, and all of the spectrum is left but a zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem import compat
from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain, Elimination
from rodfem.linalg.factorization import PETSC_ERR_LIB, Factors, GaveUpError, is_spread
from rodfem.linalg.matrices import Shared, gathered, local_rows, petsc_matrix, places_in, shared
from rodfem.linalg.selection import factors_of
from rodfem.problem.local_state import floats
from rodfem.stability import mode_type
from rodfem.stability.dense import finite_eigenpairs
from rodfem.stability.frequencies import EPS, Frequencies, named, orthonormal, product, squares
from rodfem.stability.pencil import (
    FACTORS,
    Inverse,
    PencilMatrices,
    StatePencil,
    assemble_pencil,
    exclude_modes,
    shift_invert,
    symmetry_modes,
    weighed_modes,
    with_factors,
)
from rodfem.tolerances import NEGLIGIBLE, TINY

FAR = 1e5
"""How many times farther from the shift than the third nearest an eigenvalue may be.

The pencil has infinite eigenvalues with Jordan blocks of size two, one for each pair of constraint and multiplier,
which round-off smears to finite ones about ``1/sqrt(eps)`` times farther than the nearest: those are not kept.
"""
NEAR = 10.0
"""Times the distance from the shift of the nearest eigenvalue, or of zero, within which another is none of those."""
DOUBT = 1e-4
"""Relative round-off of an eigenvalue above which it may be infinite: its vector hardly moves.

It is that of the stiffness over the kinetic energy of the vector: 5e-4 and more for such.  Beside a body of 1e4 times
its mass a light rod has them among the finite ones.  It is 2e-5 and less for others, but for a rod that cannot stretch
and is nearly taut, of whose vectors the forces are the largest part.
"""
AGAIN = 1e-3
"""Relative difference of a finite eigenvalue from one shift and from another: 3e-5 and less, of others 0.2 and more."""
LOST = 1e-6
"""Relative round-off of the kinetic energy above which an eigenvalue has no digits: beside a body of 1e9 masses of the
rod."""
SHIFT = -10.0
"""Eigenvalues are sought next to this one, over their natural size: beside zero, where the matrix may be singular.

Far enough from it for a rod that floats, whose rigid motions are zero eigenvalues: what is nearest to the shift takes
its digits from all others.
"""
BEYOND = 6
"""Eigenvalues beside the shift that are sought beyond those nearest zero: a negative one may be nearer to it."""
DENSE = 3
"""A pencil smaller than this many Krylov spaces is solved by dense reductions: it may have few finite eigenvalues."""
PILE = 64
"""States after which what PETSc keeps of matrices that are not used any more is destroyed."""
DRAWN = 3.0
"""Imaginary part of an eigenvalue that is round-off, over the distance of its real part from its Rayleigh quotient.

That is, beside a body of 1e6 times the rod's mass, what another shift changes it by: 1e-6 of the fourth, 1e-4 of the
last one of a dozen.
"""
SPARE = 2
"""Eigenvalues that are kept beyond those asked for: one of a pair, or of equal ones, may be the last."""


@dataclass(frozen=True)
class _Pair:
    """An eigenvalue, the real and imaginary part of its vector on this rank, and its backward error.

    A ``noisy`` one has more round-off than :data:`DOUBT`: far from the shift it is ``doubtful``, an infinite one maybe.
    """

    value: complex
    parts: list[np.ndarray]
    error: float
    noisy: bool = False
    doubtful: bool = False

    @property
    def vector(self) -> np.ndarray:
        """The vector on this rank, complex."""
        return np.asarray(self.parts[0] + 1j * (0.0 if len(self.parts) < 2 else self.parts[1]))


class NonsymmetricSolver(PencilMatrices):
    """Matrices of the pencil, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`."""

    def __init__(self, system: System) -> None:
        """Allocate the matrices of the pencil once."""
        super().__init__(system)
        self.inverted: tuple[PETSc.Mat, Factors] | None = None
        self.places: np.ndarray | None = None
        self.turned, self.free = np.zeros((0, 0, 4)), dict[int, PETSc.Vec]()
        self._rows: sp.csr_matrix | None = None
        self.floating = system.scene.closed or floats(system.scene)

    @property
    def rows(self) -> sp.csr_matrix:
        """The mass on one rank, real; where compiled code assembles it, an array that is the matrix's own."""
        if (own := shared(self.mass)) is None:
            start, columns, values = self.mass.getValuesCSR()
            return sp.csr_matrix((values.real, columns, start), shape=self.mass.size)
        if self._rows is None:
            self._rows = own.matrix
        return self._rows

    def at(self, x: PETSc.Vec) -> NonsymmetricPencil:
        """Assemble the pencil at the state ``x``.

        Motions of symmetries are kept out, as elsewhere: the massless spin of a thin rod would make it singular.
        """
        self.filled += 1
        if self.filled % PILE == 0:
            compat.destroy_garbage(self.system.comm)
        with self.system.clock("assembly"):
            state = assemble_pencil(self.system, x, self.matrix, self.mass)
            self.system.verify(self.matrix, state)
            free = symmetry_modes(self.system, x)
            if free:
                exclude_modes(self.system, free, self.matrix, self.mass)
            self.free = {i: mode for i, (mode, _) in weighed_modes(self.system, free, self.mass).items()}
            self.turned = state.turned
        return NonsymmetricPencil(self)


class NonsymmetricPencil(StatePencil[NonsymmetricSolver]):
    """The pencil of one state: eigenvalues near a shift, and products in its mass."""

    def __init__(self, shared: NonsymmetricSolver) -> None:
        """Be the state that the matrices were just filled for."""
        super().__init__(shared)
        self.turned, self._free, self._own = shared.turned, shared.free, slice(None)

    def asymmetry(self) -> tuple[int, float]:
        """Rank of the non-symmetric part of the tangent matrix, and its largest entry relative to the matrix's."""
        matrix, _ = self.in_units()
        transposed = matrix.copy()
        transposed.transpose()
        transposed.axpy(-1.0, matrix, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        size = matrix.norm(PETSc.NormType.INFINITY)
        mine = local_rows(transposed).tocoo()
        counted = abs(mine.data) > NEGLIGIBLE * size
        part = mine.row[counted] + transposed.getOwnershipRange()[0], mine.col[counted], mine.data[counted].real
        rows, columns, values = map(np.concatenate, zip(*self.system.comm.allgather(part), strict=True))
        used = np.unique(rows)
        small = np.zeros((len(used), len(used)))
        small[np.searchsorted(used, rows), np.searchsorted(used, columns)] = values
        return (int(np.linalg.matrix_rank(small)), float(abs(small).max() / size)) if len(used) else (0, 0.0)

    def near(self, number: int, target: complex) -> Frequencies:
        """Return eigenvalues nearest to ``target``: ``number``, or more where they come.

        Fewer are returned only where the discretisation has no more finite ones.  A pencil hardly larger than the
        Krylov space for ``number`` of them is solved by dense reductions.
        """
        return self._near(number, target, *self._whole())

    def near_zero(self, number: int) -> Frequencies:
        """Return more than the ``number`` eigenvalues nearest zero, in ascending order of their real parts."""
        return self.near(number + BEYOND, SHIFT * self.system.scene.units.omega2)

    def left_near_zero(self, number: int) -> Frequencies:
        """Return the same of the transposed pencil."""
        return self.left(number + BEYOND, SHIFT * self.system.scene.units.omega2)

    def left(self, number: int, target: complex) -> Frequencies:
        """Return those of the transposed pencil: ``vectors`` are left ones, ``z.S = mu z.M`` without conjugation.

        They have no parts along free motions ``g``: of ``S g = 0`` follows ``z.Mg = 0``.
        """
        matrix, mass = self._whole()
        transposed = matrix.copy()
        transposed.transpose()
        try:
            return self._near(number, target, transposed, mass, left=True)
        finally:
            transposed.destroy()

    def _whole(self) -> tuple[PETSc.Mat, PETSc.Mat]:
        """The pencil; of a rod that is not long all of it on each rank, which solves alone."""
        pencil, comm = self.in_units(), self.system.comm
        if comm.size == 1 or is_spread(comm, self.matrix.getSize()[0]):
            return pencil
        self._own = slice(*self.matrix.getOwnershipRange())
        whole, mass = (petsc_matrix(MPI.COMM_SELF, gathered(matrix)) for matrix in pencil)
        return whole, mass

    def _near(
        self, number: int, target: complex, matrix: PETSc.Mat, mass: PETSc.Mat, *, left: bool = False
    ) -> Frequencies:
        target /= self.system.scene.units.omega2
        with self.system.clock("stability"):
            if matrix.getSize()[0] < DENSE * (2 * number + 20):
                found = self._dense(matrix, mass)
            elif target.imag == 0 or compat.COMPLEX:
                found = self._shifted(number, target, matrix, mass)
            else:
                found = self._doubled(number, target, matrix, mass)
            found = _whole_pairs(sorted(found, key=lambda p: abs(p.value - target))[: number + SPARE], target)
            third = abs(found[min(2, len(found) - 1)].value - target)
            found = [p for p in found if abs(p.value - target) <= FAR * third]
            vectors = np.stack([p.vector for p in found], axis=1)
            values, errors = np.array([p.value for p in found]), np.array([p.error for p in found])
            return named(self.system, [(self.unnamed(values, errors, vectors, left=left), self.turned)])[0]

    def unnamed(
        self,
        values: np.ndarray,
        errors: np.ndarray,
        vectors: np.ndarray,
        weighed: np.ndarray | None = None,
        *,
        left: bool = False,
    ) -> Frequencies:
        """Frequencies of ``values`` with their ``errors`` and ``vectors`` before their motions are named.

        Vectors (n, k) are complex, in units of natural sizes, and those of the transposed pencil where they are
        ``left`` ones.  The ``weighed`` vectors are the products with the mass, in the same units, where they are known.
        """
        units = self.system.scene.units
        if not units.ordinary:
            values, vectors, weighed = values * units.omega2, vectors * self.sizes.array_r.real[:, None], None
        if self._free and not left:
            vectors, weighed = vectors.astype(complex), None
            self._complete(values, vectors)
        order = np.lexsort((values.imag, np.round(values.real / units.omega2, 9)))
        if (np.diff(order) != 1).any():
            values, errors, vectors = values[order], errors[order], vectors[:, order]
            weighed = None if weighed is None else weighed[:, order]
        weighed = self.weighed(vectors) if weighed is None else weighed
        return Frequencies(values, errors, (), vectors, weighed, units.omega2, self._shared.floating)

    def motion(self, basis: np.ndarray) -> str:
        """Type of the motion spanned by a ``basis`` (n, k)."""
        return mode_type.name(mode_type.shares(self.system, self.turned, [*basis.real.T, *basis.imag.T]))

    def weighed(self, vectors: np.ndarray) -> np.ndarray:
        """``M X`` for real or complex vectors (n, k), with any PETSc."""
        if self.system.comm.size == 1:
            rows = self._held().rows
            if not np.iscomplexobj(vectors):
                return np.asarray(rows @ vectors)
            parts = np.ascontiguousarray(vectors).view(float)  # real and imaginary parts in turn, in real arithmetic
            return np.ascontiguousarray(rows @ parts).view(complex)
        if np.iscomplexobj(vectors):
            return np.asarray(self.weighed(vectors.real) + 1j * self.weighed(vectors.imag))
        out, x = np.empty_like(vectors), self.system.new_vector()
        for i, column in enumerate(vectors.T):
            x.array[:] = column
            out[:, i] = (self.mass * x).array_r.real
        return out

    def mass_in_units(self) -> sp.csr_matrix:
        """The mass on one rank for unknowns in units of their natural sizes."""
        return self._held().rows if self.system.scene.units.ordinary else local_rows(self.in_units()[1])

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """``a^* b`` of all ranks' rows."""
        return product(self.system.comm, a, b)

    def squares(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Products of each column of ``a`` with the same of ``b``, real parts."""
        return squares(self.system.comm, a, b)

    def orthonormal(self, vectors: np.ndarray) -> np.ndarray:
        """Basis of the span of complex vectors (n, k), orthonormal in the mass."""
        return orthonormal(self.system.comm, vectors, self.weighed(vectors))

    def _complete(self, values: np.ndarray, vectors: np.ndarray) -> None:
        """Add to vectors, in place, their parts along free motions ``g``: ``g . S x / mu``, of ``g . Mx = 0`` before.

        From ``S (x + c g) = mu M (x + c g)``, with ``S g = 0``.  The multiplier of ``g . Mx = 0`` is ``-mu c`` as well,
        but that of a vector which was predicted belongs to the basis ``g`` at the loads that it was predicted from.
        """
        begin, end = self.matrix.getOwnershipRange()
        drifts = [index - begin for index in self.system.drifts if begin <= index < end]
        moving = abs(values) > 0
        for mode in self._free.values():
            force = mode.duplicate()
            self.matrix.multTranspose(mode, force)
            force.array[drifts] = 0.0
            work = self.system.comm.allreduce(force.array_r.real @ vectors)
            shares = np.zeros_like(work)
            shares[moving] = work[moving] / values[moving]
            vectors += np.outer(mode.array_r.real, shares)

    def _dense(self, matrix: PETSc.Mat, mass: PETSc.Mat) -> list[_Pair]:
        """All finite eigenvalues of a pencil that is small enough for dense matrices."""
        values, vectors = finite_eigenpairs(*(dense(A) for A in (matrix, mass)))
        if len(values) == 0:
            raise ConvergenceError("The rod has no inertia: give it a mass, or a rotary inertia.")
        own = vectors[self._own]
        return [_Pair(complex(w), [x.real.copy(), x.imag.copy()], EPS) for w, x in zip(values, own.T, strict=True)]

    def _shifted(self, number: int, target: complex, matrix: PETSc.Mat, mass: PETSc.Mat) -> list[_Pair]:
        """Solve with a shift that this PETSc's numbers can express.

        What may be infinite, for its round-off, is sought from another shift: finite eigenvalues are found again.
        """
        found = self._pairs(number, target, matrix, mass)
        if any(pair.doubtful for pair in found):
            others = [pair.value for pair in self._pairs(number, target + SHIFT, matrix, mass) if pair.noisy]
            found = [
                pair
                for pair in found
                if not pair.doubtful or any(abs(pair.value - v) <= AGAIN * abs(v) for v in others)
            ]
        return found[: number + SPARE]

    def _pairs(self, number: int, target: complex, matrix: PETSc.Mat, mass: PETSc.Mat) -> list[_Pair]:
        """Eigenpairs that have digits, nearest to the shift first; ``number`` or more of them are finite."""
        solver = self._solve(matrix, mass, number, target if compat.COMPLEX else target.real)
        re, im = matrix.createVecRight(), matrix.createVecRight()
        values, out = [solver.getEigenvalue(i) for i in range(solver.getConverged())], list[_Pair]()
        stiffness, inertia = EPS * self._stiffness(matrix), EPS * mass.norm(PETSc.NormType.INFINITY)
        heavy = mass.getDiagonal()
        heavy.array[:] = abs(heavy.array_r) > 0
        nearest = min((abs(value - target) for value in values), default=0.0)
        far = min(FAR * nearest, NEAR * max(nearest, -SHIFT))  # rigid motions have no kinetic energy here
        for i in sorted(range(len(values)), key=lambda i: abs(values[i] - target)):
            value = solver.getEigenpair(i, re, im)
            size = max(abs(value), abs(value - target))
            kinetic = sum(abs(x.dot(mass * x)) for x in (re, im))
            moved = sum((x * heavy).norm() ** 2 for x in (re, im))
            noise = stiffness * (re.norm() ** 2 + im.norm() ** 2)
            beyond = abs(value - target) > far
            if beyond and inertia * moved > LOST * kinetic:
                continue
            parts = mode_type.halves(re) if compat.COMPLEX else [re.array_r, im.array_r]
            error = solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)
            if value.imag and abs(value.imag) <= DRAWN * self._off(matrix, mass, value, re, im):
                value = value.real
            noisy = bool(noise > DOUBT * size * kinetic)
            own = [part[self._own].copy() for part in parts]
            out.append(_Pair(complex(value), own, error, noisy, beyond and noisy))
            if sum(not pair.doubtful for pair in out) == number + SPARE:
                break
        solver.destroy()
        return out

    def _off(self, matrix: PETSc.Mat, mass: PETSc.Mat, value: complex, re: PETSc.Vec, im: PETSc.Vec) -> float:
        """Distance of an eigenvalue from the Rayleigh quotient of its vector, ``re + i im``: about its round-off.

        Where PETSc is complex ``re`` is all of it.  The rows of the load and of drifts are left out, which have no part
        in it and other units.
        """
        parts = [re] if compat.COMPLEX else [re, im]
        left, other = [x.copy() for x in parts], self._others(matrix)
        for x in left:
            x.array[other] = 0.0
        S, M = (np.array([[x.dot(A * y) for y in parts] for x in left]) for A in (matrix, mass))
        if compat.COMPLEX:
            stiffness, inertia = S[0, 0], M[0, 0]
        else:  # (re - i im) . A (re + i im)
            stiffness, inertia = (A[0, 0] + A[1, 1] + 1j * (A[0, 1] - A[1, 0]) for A in (S, M))
        return float(abs(stiffness - value * inertia) / max(abs(inertia), TINY))

    def _others(self, matrix: PETSc.Mat) -> list[int]:
        """Rows of the load and of drifts, of those that this rank has of a matrix."""
        begin, end = matrix.getOwnershipRange()
        return [i - begin for i in (self.system.load_index, *self.system.drifts) if begin <= i < end]

    def _stiffness(self, matrix: PETSc.Mat) -> float:
        """Largest sum of the absolute entries of a row of ``matrix``, but for rows of the load and of drifts.

        These have a one on the diagonal, which is no stiffness and has other units.
        """
        sums = np.asarray(abs(local_rows(matrix)).sum(axis=1)).ravel()
        sums[self._others(matrix)] = 0.0
        return float(matrix.comm.tompi4py().allreduce(float(sums.max(initial=0.0)), op=MPI.MAX))

    def _doubled(self, number: int, target: complex, matrix: PETSc.Mat, mass: PETSc.Mat) -> list[_Pair]:
        """Solve with a complex shift by the real matrix of twice the size."""
        a, b, comm = target.real, target.imag, matrix.comm
        shifted, upper = matrix.copy(), mass.copy()
        shifted.axpy(-a, mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        upper.scale(b)
        lower = upper.copy()
        lower.scale(-1.0)
        pencil = PETSc.Mat().createNest([[shifted, upper], [lower, shifted]], comm=comm).convert("aij")
        masses = PETSc.Mat().createNest([[mass, None], [None, mass]], comm=comm).convert("aij")
        solver = self._solve(pencil, masses, 2 * number, 0.0)
        re, im = pencil.createVecRight(), pencil.createVecRight()
        out = []
        for i in range(solver.getConverged()):
            shift = solver.getEigenpair(i, re, im)
            n = re.getLocalSize() // 2  # each rank holds its part of x, then its part of y
            x, y = re.array_r[:n] + 1j * im.array_r[:n], re.array_r[n:] + 1j * im.array_r[n:]
            first, second = comm.tompi4py().allreduce(
                np.array([np.linalg.norm(x + 1j * y) ** 2, np.linalg.norm(x - 1j * y) ** 2])
            )
            if first >= second:
                vector = (x + 1j * y)[self._own]
                error = solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)
                out.append(_Pair(target + shift, [vector.real.copy(), vector.imag.copy()], error))
        solver.destroy()
        for made in (shifted, upper, lower, pencil, masses):
            made.destroy()
        return out[:number]

    def _solve(self, matrix: PETSc.Mat, mass: PETSc.Mat, number: int, target: complex) -> SLEPc.EPS:
        """Run SLEPc; raises :class:`ConvergenceError` where it finds nothing at all, or has no factors to do so.

        A small pencil has few finite eigenvalues, and a Krylov space that holds all of them breaks down on the Jordan
        blocks of the infinite ones: it is then made smaller.
        """
        inverse = self._inverse(matrix, mass, target)
        while number:
            try:
                if inverse is None:
                    solver = shift_invert(matrix, mass, number, target)
                else:
                    solver = with_factors(matrix, mass, number, target, inverse, symmetric=False)
                solver.setUp()
            except PETSc.Error as trouble:
                raise ConvergenceError(_singular(target)) from trouble
            try:
                solver.solve()
            except PETSc.Error as trouble:
                if trouble.ierr != PETSC_ERR_LIB:
                    raise
            else:
                if solver.getConverged():
                    return solver
            solver.destroy()
            number //= 2
        raise ConvergenceError(f"SLEPc found no eigenvalue near {target:.6g}: use a richer discretisation.")

    def eliminated(self, target: float) -> Elimination | None:
        """Factors of ``S - target M`` in units of natural sizes that solve for arrays; None where there are none."""
        if self.system.comm.size > 1 or compat.COMPLEX:
            return None
        own, mass, kept = shared(self.matrix), shared(self.mass), self._shared.inverted
        if own and mass and kept and isinstance(kept[1], Chain) and self.system.scene.units.ordinary:
            return self._refactored(kept[1], own, mass, target)
        inverse = self._inverse(*self.in_units(), target / self.system.scene.units.omega2)
        factors = None if inverse is None else inverse.factors
        return factors.elimination if isinstance(factors, Chain) and not factors.resorted else None

    def _refactored(self, factors: Chain, own: Shared, mass: Shared, target: float) -> Elimination | None:
        """The same by factors that know the pattern, of values that need no matrix of PETSc's."""
        if self._shared.places is None:
            self._shared.places = places_in(own.pattern, mass.pattern)
        values = own.values.copy()
        values[self._shared.places] -= target * mass.values
        try:
            factors.elimination.factor(values)
        except GaveUpError:
            return None
        factors.adopt(regular=factors.elimination.regular)
        if not factors.regular:
            raise ConvergenceError(_singular(target))
        return factors.elimination

    def _inverse(self, matrix: PETSc.Mat, mass: PETSc.Mat, target: complex) -> Inverse | None:
        """Inverse of ``matrix - target mass`` along the rod, piece by piece on several ranks; None: SLEPc's own.

        On one rank the pencil of twice the size that a complex shift makes is SLEPc's and MUMPS's.  On several MUMPS
        gives up on a long rod: the zero block of the multipliers delays more pivots than its analysis has room for.
        """
        rows, comm = matrix.size[0], matrix.comm.tompi4py()
        if comm.size == 1 and rows > self.matrix.size[0]:
            return None
        kept = self._shared.inverted
        if kept is None or kept[0].size != matrix.size:
            along = rows if self.system.fields.along else 0
            factors = factors_of("lu", comm, along, self.system.fields.dense_rows, {8: 0}, prefix=FACTORS)
            shifted = matrix.copy()
            self._shared.inverted = shifted, factors
        else:
            shifted, factors = kept
            matrix.copy(shifted, PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        shifted.axpy(-target, mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        factors(shifted)
        if not factors.regular:
            raise ConvergenceError(_singular(target))
        return Inverse(factors)


def _whole_pairs(found: list[_Pair], target: complex) -> list[_Pair]:
    """Eigenvalues near a real ``target`` without the last one where that is a half of a pair, cut in two."""
    if target.imag or len(found) < 2 or not found[-1].value.imag:
        return found
    value, others = found[-1].value.conjugate(), [p.value for p in found[:-1]]
    cut = min(abs(v - value) for v in others) > abs(value.imag)
    return found[:-1] if cut else found


def _singular(target: complex) -> str:
    return f"The pencil is singular at the shift {target:.6g}: choose another load, or another discretisation."


def dense(matrix: PETSc.Mat) -> np.ndarray:
    """A matrix on this rank as a dense array, real."""
    return np.array(matrix.copy().convert("dense").getDenseArray().real)

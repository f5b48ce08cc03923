r"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load
couples the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real
axis: flutter.

Which eigenvalues are finite, near which shift: :mod:`~rodfem.stability.finite_pairs`.

A motion ``g`` that nothing holds has ``S g = 0``.  The pencil is bordered by ``M g`` on both sides: an eigenvector
``x`` of ``mu`` becomes ``x - g (g.Mx)`` with the multiplier ``-mu (g.Mx)``, and all of the spectrum is left but a zero.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem import compat
from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain, Elimination, GaveUpError
from rodfem.linalg.factorization import PETSC_ERR_LIB, Factors
from rodfem.linalg.matrices import Shared, gathered, local_rows, petsc_matrix, places_in, shared
from rodfem.linalg.selection import factors_of
from rodfem.problem.local_state import floats
from rodfem.stability import mode_type
from rodfem.stability.finite_pairs import SHIFT, FinitePairs
from rodfem.stability.frequencies import REAL, Frequencies, named, orthonormal, product, squares
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
from rodfem.tolerances import NEGLIGIBLE

BEYOND = 6
"""Eigenvalues beside the shift that are sought beyond those nearest zero: a negative one may be nearer to it."""
PILE = 64
"""States after which what PETSc keeps of matrices that are not used any more is destroyed."""


class NonsymmetricSolver(PencilMatrices):
    """Matrices of the pencil, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`.

    ``slow`` says whether the rod has motions far slower than bending at its first state, whose round-off is asked for.
    """

    def __init__(self, system: System) -> None:
        """Allocate the matrices of the pencil once."""
        super().__init__(system)
        self.inverted: tuple[PETSc.Mat, Factors] | None = None
        self.places: np.ndarray | None = None
        self.turned, self.free = np.zeros((0, 0, 4)), dict[int, PETSc.Vec]()
        self._rows: sp.csr_matrix | None = None
        self.floating = system.scene.closed or floats(system.scene)
        self.slow = False

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
        self.turned, self._free, self._own, self.slow = shared.turned, shared.free, slice(None), shared.slow

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
        """The pencil; on several ranks all of it on each, which solves alone."""
        pencil = self.in_units()
        if self.system.comm.size == 1:
            return pencil
        self._own = slice(*self.matrix.getOwnershipRange())
        whole, mass = (petsc_matrix(MPI.COMM_SELF, gathered(matrix)) for matrix in pencil)
        return whole, mass

    def _near(
        self, number: int, target: complex, matrix: PETSc.Mat, mass: PETSc.Mat, *, left: bool = False
    ) -> Frequencies:
        target /= self.system.scene.units.omega2
        with self.system.clock("stability"):
            apart = (self.system.load_index, *self.system.drifts)
            found = FinitePairs(matrix, mass, self._solve, apart, self._own).near(number, target)
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
        Where ``mu`` is zero to round-off any part is as good, and none is taken.
        """
        begin, end = self.matrix.getOwnershipRange()
        drifts = [index - begin for index in self.system.drifts if begin <= index < end]
        moving = abs(values) > REAL * self.system.scene.units.omega2
        for mode in self._free.values():
            force = mode.duplicate()
            self.matrix.multTranspose(mode, force)
            force.array[drifts] = 0.0
            work = self.system.comm.allreduce(force.array_r.real @ vectors)
            shares = np.zeros_like(work)
            shares[moving] = work[moving] / values[moving]
            vectors += np.outer(mode.array_r.real, shares)

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
        """Inverse of ``matrix - target mass`` along the rod; None: SLEPc's own.

        The pencil of twice the size that a complex shift makes is SLEPc's and MUMPS's.
        """
        rows, comm = matrix.size[0], matrix.comm.tompi4py()
        if rows > self.matrix.size[0]:
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


def _singular(target: complex) -> str:
    return f"The pencil is singular at the shift {target:.6g}: choose another load, or another discretisation."

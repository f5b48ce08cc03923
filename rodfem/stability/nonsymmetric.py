r"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load
couples the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real
axis: flutter.

The finite eigenvalues are those of the pencil on its unknowns with mass: :mod:`~rodfem.stability.spectrum`.

A motion ``g`` that nothing holds has ``S g = 0``.  The pencil is bordered by ``M g`` on both sides: an eigenvector
``x`` of ``mu`` becomes ``x - g (g.Mx)`` with the multiplier ``-mu (g.Mx)``, and all of the spectrum is left but a zero.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc
from scipy.sparse.linalg import splu

from rodfem import compat
from rodfem.errors import ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.chain import Chain, Elimination, GaveUpError
from rodfem.linalg.factorization import Factors
from rodfem.linalg.matrices import Shared, gathered, local_rows, places_in, shared
from rodfem.linalg.selection import factors_of
from rodfem.problem.local_state import floats
from rodfem.stability import mode_type
from rodfem.stability.frequencies import REAL, Frequencies, in_order, named, orthonormal, product, squares
from rodfem.stability.pencil import (
    FACTORS,
    PencilMatrices,
    StatePencil,
    assemble_pencil,
    exclude_modes,
    symmetry_modes,
    weighed_modes,
)
from rodfem.stability.slow_motions import floor_of_slow
from rodfem.stability.spectrum import SHIFT, Condensed, Eigenpairs, Spectrum, inside
from rodfem.tolerances import NEGLIGIBLE

BEYOND = 6
"""Eigenvalues beside the shift that are sought beyond those nearest zero: a negative one may be nearer to it."""
SPARE = 2
"""Eigenvalues that are kept beyond those asked for: one of a pair, or of equal ones, may be the last."""
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
        if self.system.comm.size > 1:
            self._own = slice(*shared.matrix.getOwnershipRange())
        self.floating = shared.floating
        self._condensed = dict[float, Condensed]()

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

    def near(self, number: int, target: float, *, left: bool = False) -> Frequencies:
        """Return eigenvalues nearest to ``target``: ``number``, or more where they come.

        Fewer are returned only where the discretisation has no more finite ones.  ``vectors`` are ``left`` ones where
        these are asked for, ``z.S = mu z.M`` without conjugation.  They have no parts along free motions ``g``: of
        ``S g = 0`` follows ``z.Mg = 0``.
        """
        with self.system.clock("stability"):
            condensed = self.condensed(target)
            pairs = condensed.greatest(number + SPARE, left=left)
            pairs = pairs.at(slice(len(pairs.nu) - _half(pairs.nu)))
            found = self._found(condensed, condensed.values(pairs), pairs, left=left)
            return named(self.system, [(in_order(found), self.turned)])[0]

    def near_zero(self, number: int, *, left: bool = False) -> Frequencies:
        """Return more than the ``number`` eigenvalues nearest zero, in ascending order of their real parts."""
        return self.near(number + BEYOND, SHIFT * self.system.scene.units.omega2, left=left)

    @cached_property
    def spectrum(self) -> Spectrum:
        """All eigenvalues that the mesh has; of a mesh with many unknowns those nearest zero."""
        with self.system.clock("stability"):
            one = self.system.scene.units.omega2
            found = Spectrum(self.condensed(SHIFT * one), one)
            return replace(found, floor=floor_of_slow(self, found))

    def nearest(self, number: int) -> Frequencies:
        """Those of the spectrum nearest to its shift, ``number`` or one less, not to cut a pair, not named yet."""
        pairs, spectrum = self.spectrum.condensed.pairs, self.spectrum
        kept = min(number, len(pairs.nu))
        kept -= _half(pairs.nu[:kept])
        return self.of(spectrum, np.arange(kept))

    def of(self, spectrum: Spectrum, places: np.ndarray) -> Frequencies:
        """Frequencies of some eigenvalues of a ``spectrum`` of this state, in its order and not named yet."""
        pairs, values = spectrum.condensed.pairs, spectrum.values[places] / spectrum.one
        return replace(self._found(spectrum.condensed, values, pairs.at(places)), floor=spectrum.floor)

    def shares(self, basis: np.ndarray) -> np.ndarray:
        """Share (k,) of the vector of each eigenvalue of the spectrum in the span of a real ``basis`` (n, m)."""
        whole = np.concatenate(self.system.comm.allgather(basis / self.sizes.array_r.real[:, None]))
        condensed = self.spectrum.condensed
        return inside(condensed.dual.T @ whole[condensed.heavy], condensed.pairs.right)

    def condensed(self, target: float) -> Condensed:
        """The pencil on its unknowns with mass, about a shift; raises :class:`ConvergenceError` where it is singular.

        On several ranks each of them has all of it.
        """
        self._held()
        if target not in self._condensed:
            shift = target / self.system.scene.units.omega2
            factors = self.eliminated(target)
            if factors is not None:
                mass, solve, transposed = self.mass_in_units(), factors.solve, factors.solve_transposed
            else:
                stiffness, mass = (gathered(A) for A in self.in_units())
                try:
                    lu = splu((stiffness - shift * mass).real.tocsc())
                except RuntimeError as trouble:
                    raise ConvergenceError(_singular(target)) from trouble
                mass, solve, transposed = mass.real, lu.solve, partial(lu.solve, trans="T")
            self._condensed = {target: Condensed(mass, solve, transposed, shift)}  # factors are those of one shift
        return self._condensed[target]

    def _found(self, condensed: Condensed, values: np.ndarray, pairs: Eigenpairs, *, left: bool = False) -> Frequencies:
        """Frequencies of ``values`` (k,) in natural units, of ``pairs`` of ``T``."""
        units = self.system.scene.units
        vectors = condensed.vectors(pairs, left=left)[self._own]
        weighed = condensed.spread(pairs.right)[self._own] if units.ordinary and not (self._free or left) else None
        if not units.ordinary:
            values, vectors = values * units.omega2, vectors * self.sizes.array_r.real[:, None]
        if self._free and not left:
            vectors = vectors.astype(complex)
            self._complete(values, vectors)
        weighed = self.weighed(vectors) if weighed is None else weighed
        return Frequencies(values, pairs.error, (), vectors, weighed, units.omega2, self.floating)

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

    def eliminated(self, target: float) -> Elimination | None:
        """Factors of ``S - target M`` in units of natural sizes that solve for arrays; None where there are none.

        Raises :class:`~rodfem.errors.ConvergenceError` where it is singular.
        """
        if self.system.comm.size > 1 or compat.COMPLEX:
            return None
        own, mass, kept = shared(self.matrix), shared(self.mass), self._shared.inverted
        if own and mass and kept and isinstance(kept[1], Chain) and self.system.scene.units.ordinary:
            return self._refactored(kept[1], own, mass, target)
        matrix, mass = self.in_units()
        if kept is None:
            rows = matrix.size[0] if self.system.fields.along else 0
            factors = factors_of("lu", self.system.comm, rows, self.system.fields.dense_rows, {8: 0}, prefix=FACTORS)
            self._shared.inverted = kept = matrix.copy(), factors
        else:
            matrix.copy(kept[0], PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        shifted, factors = kept
        if not isinstance(factors, Chain):
            return None
        shifted.axpy(-target / self.system.scene.units.omega2, mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        factors(shifted)
        if not factors.regular:
            raise ConvergenceError(_singular(target))
        return None if factors.resorted else factors.elimination

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


def _half(nu: np.ndarray) -> int:
    """1 where the last of some eigenvalues (k,) is one of a pair that is cut in two, else 0."""
    if len(nu) < 2 or not nu[-1].imag:
        return 0
    return int(abs(nu[:-1] - nu[-1].conjugate()).min() > abs(nu[-1].imag))


def _singular(target: complex) -> str:
    return f"The pencil is singular at the shift {target:.6g}: choose another load, or another discretisation."

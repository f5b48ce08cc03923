"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load couples
the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real axis: flutter.
The finite eigenvalues are those of the pencil on its unknowns with mass: :mod:`~rodfem.stability.spectrum`.

What round-off makes of an eigenvalue that is zero is bounded by 1e-7 of the natural size of bending.  For a rod with
motions far slower than bending, as a stiff rod on soft supports, it is measured: independent relative errors of all
entries of the matrix, and what a state leaves open.

A motion ``g`` that nothing holds has ``S g = 0``.  The pencil is bordered by ``M g`` on both sides: an eigenvector
``x`` of ``mu`` becomes ``x - g (g.Mx)`` with the multiplier ``-mu (g.Mx)``, and all of the spectrum is left but a zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.system import System
from rodfem.linalg.matrices import gathered, local_rows, rounding_of, shared
from rodfem.problem.functions import floats
from rodfem.stability import motion_names
from rodfem.stability.inertia import NOISE
from rodfem.stability.pencil import (
    PencilMatrices,
    StatePencil,
    assemble_pencil,
    exclude_modes,
    symmetry_modes,
    weighed_modes,
)
from rodfem.stability.spectrum import REAL, SHIFT, Condensed, Eigenpairs, Spectrum, condensed, inside, times
from rodfem.tolerances import NEGLIGIBLE

MULTIPLE = 1e-8
"""Eigenvalues that differ by less than this, relative, are one that is multiple."""
ALIKE = 1e-6
"""Eigenvalues that differ by less than this, relative, have one name: where another is near the shift, digits go."""
STILL = 1e-10
"""Share of the farthest eigenvalue below which one is zero."""
EPS = float(np.finfo(float).eps)
BEYOND = 6
"""Eigenvalues next to the shift that are sought beyond those nearest zero: a negative one may be nearer to it."""
SPARE = 2
"""Eigenvalues that are kept beyond those asked for: one of a pair, or of equal ones, may be the last."""
FREQUENCIES = 6
"""Number of frequencies recorded at each load where nobody asks for another."""
SLOW, SOLVED, CLEAR = 1e-3, 1e-9, 10.0
"""Part of the natural size below which eigenvalues are slow, what a state leaves open of them, and times that."""
APART = 1e-3
"""Relative distance of two slow ones that are not one: one, or a multiple one, may be about to vanish in any rod."""
PILE = 64
"""States after which what PETSc keeps of matrices that are not used any more is destroyed."""


@dataclass(frozen=True)
class Frequencies:
    """Eigenvalues ``values`` (k,), ``mu = omega^2``, in ascending order of real parts, and their ``errors`` (k,).

    Errors are those of ``1 / (mu - shift)`` over the greatest.  ``kinds`` names the motions
    (:mod:`rodfem.stability.motion_names`).  ``vectors`` (n, k), n unknowns of this rank, are complex, or real if all
    eigenvalues are; ``weighed`` (n, k) are their products with the mass.  ``one`` is the natural size of the
    eigenvalues. A ``floating`` rod, which nothing holds, has zero ones.  Of a rod that is held and has slow motions
    ``floor`` is what round-off makes of zero; it is infinite otherwise.
    """

    values: np.ndarray
    errors: np.ndarray
    kinds: tuple[str, ...] = ()
    vectors: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    weighed: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=complex))
    one: float = 1.0
    floating: bool = False
    floor: float = np.inf

    @property
    def far(self) -> float:
        """Size of an eigenvalue relative to which others are zero: the greatest, but for a light rod with heavy bodies.

        That has a few slow motions, and others whose eigenvalues are 1e10 times as great.
        """
        sizes = np.sort(abs(self.values))
        greatest = float(sizes[-1]) if len(sizes) else 0.0
        return greatest if self.floating else min(greatest, 1e4 * self.natural)

    @property
    def natural(self) -> float:
        """Natural size of the slowest motions: that of the two slowest eigenvalues, and of bending at least."""
        slowest = float(np.sort(abs(self.values))[:2].max(initial=0.0))
        return max(slowest, self.one if np.isinf(self.floor) else self.floor)

    @property
    def noise(self) -> float:
        """Magnitude below which an eigenvalue counts as zero."""
        least = REAL * float(abs(self.values).min(initial=np.inf))
        return min(max(REAL * self.one, least), max(self.floor, least))

    def still(self) -> int:
        """Number of eigenvalues that are zero: of rigid motions, and their partners in Jordan blocks."""
        return int((abs(self.values) < STILL * self.far).sum())


def in_order(found: Frequencies) -> Frequencies:
    """Frequencies by their real parts."""
    values = found.values
    order = np.lexsort((values.imag, np.round(values.real / min(found.one, found.natural), 6)))
    kinds = tuple(found.kinds[i] for i in order) if found.kinds else ()
    vectors, weighed = found.vectors[:, order], found.weighed[:, order]
    return replace(
        found, values=values[order], errors=found.errors[order], kinds=kinds, vectors=vectors, weighed=weighed
    )


def named(system: System, found: Frequencies, turned: np.ndarray, number: int | None = None) -> Frequencies:
    """Frequencies ``found`` at a state of a ``system``, the first ``number`` named; ``turned`` is its rotation field.

    A multiple eigenvalue has one name, that of its invariant subspace: its vectors are any in it.
    """
    together = [g for g in groups(found.values, found.far, ALIKE) if number is None or g[0] < number]
    owner = np.repeat(np.arange(len(together)), list(map(len, together)))
    vectors = np.concatenate([_span(system, found, group) for group in together], axis=1)
    squares, moved = np.zeros((len(together), 3)), np.zeros(len(together))
    for part in (vectors.real, vectors.imag) if np.iscomplexobj(vectors) else (vectors,):
        np.add.at(squares, owner, motion_names.squares(system, turned, part))
        np.add.at(moved, owner, motion_names.displacements(system, part))
    names, floating = motion_names.names_of(motion_names.of_all(squares, moved)), floats(system.scene)
    kinds = dict.fromkeys(range(len(found.values)), "")
    for group, name in zip(together, names, strict=True):
        rigid = floating and abs(found.values[group]).max() < STILL * found.far
        kinds |= dict.fromkeys(group, motion_names.RIGID if rigid else name)
    return replace(found, kinds=tuple(kinds.values()))


def _span(system: System, found: Frequencies, group: list[int]) -> np.ndarray:
    vectors = found.vectors[:, group]
    return orthonormal(system.comm, vectors, found.weighed[:, group]) if len(group) > 1 else vectors


def groups(values: np.ndarray, far: float, tolerance: float = MULTIPLE) -> list[list[int]]:
    """Places of equal eigenvalues, which differ by less than a relative ``tolerance``, in order of the first of each.

    Those near zero are compared with what is ``far`` from it.
    """
    out: list[list[int]] = []
    least = min(abs(values).max(initial=0.0), far) / 100
    sizes = tolerance * np.maximum(abs(values), least)
    if (abs(values[:, None] - values) < sizes[:, None]).sum() <= len(values):  # no two of them
        return [[i] for i in range(len(values))]
    for i, value in enumerate(values):
        for group in out:
            if abs(value - values[group[0]]) < tolerance * max(abs(value), least):
                group.append(i)
                break
        else:
            out.append([i])
    return out


def product(comm: MPI.Comm, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """``a^* b`` of the rows of all ranks of ``comm``: (k, m) for (n, k) and (n, m)."""
    mine = a.conj().T @ b
    return np.asarray(mine if comm.size == 1 else comm.allreduce(mine))


def squares(comm: MPI.Comm, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products (k,) of each column of ``a`` (n, k) with the same of ``b``, real parts, of all ranks of ``comm``."""
    mine = np.sum(a.conj() * b, axis=0).real
    return np.asarray(mine if comm.size == 1 else comm.allreduce(mine))


def orthonormal(comm: MPI.Comm, vectors: np.ndarray, weighed: np.ndarray) -> np.ndarray:
    """Basis of the span of complex ``vectors`` (n, k), orthonormal in the mass; zero for what has no mass.

    ``weighed`` are their products with the mass; the ranks of ``comm`` share the rows.
    """
    parts, turn = np.linalg.eigh(product(comm, vectors, weighed))
    sizes = np.maximum(parts, EPS * parts[-1])
    return np.asarray(vectors @ (turn / np.sqrt(np.where(sizes > 0.0, sizes, np.inf))))


class NonsymmetricSolver(PencilMatrices):
    """Matrices of the pencil, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`.

    The rod is ``slow`` if it has motions far slower than bending at its first state: their round-off is measured.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.turned, self.free = np.zeros((0, 0, 4)), dict[int, PETSc.Vec]()
        self._rows: sp.csr_matrix | None = None
        self.floating = system.scene.closed or floats(system.scene)
        self.slow = False

    @property
    def rows(self) -> sp.csr_matrix:
        """The mass, real, rows of this rank; where compiled code assembles it, an array that is the matrix's own."""
        if (own := shared(self.mass)) is None:
            return local_rows(self.mass).real
        if self._rows is None:
            self._rows = own.matrix
        return self._rows

    def at(self, x: PETSc.Vec) -> NonsymmetricPencil:
        """Assemble the pencil at the state ``x``, without the motions of symmetries, which may make it singular."""
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
        """Return eigenvalues nearest to ``target``: ``number``, or more where they come; fewer if there are no more.

        ``left`` vectors have ``z.S = mu z.M`` without conjugation, and no parts along free motions ``g``, where ``z.Mg
        = 0``.
        """
        with self.system.clock("stability"):
            pencil = self.condensed(target)
            pairs = pencil.greatest(number + SPARE, left=left)
            pairs = pairs.at(slice(len(pairs.nu) - _half(pairs.nu)))
            found = self._found(pencil, pencil.values(pairs), pairs, left=left)
            return named(self.system, in_order(found), self.turned)

    def near_zero(self, number: int, *, left: bool = False) -> Frequencies:
        """Return more than the ``number`` eigenvalues nearest zero, in ascending order of their real parts."""
        return self.near(number + BEYOND, SHIFT * self.system.scene.units.omega2, left=left)

    @cached_property
    def spectrum(self) -> Spectrum:
        """All eigenvalues that the mesh has; of a mesh with many unknowns those nearest zero."""
        with self.system.clock("stability"):
            one = self.system.scene.units.omega2
            found = Spectrum(self.condensed(SHIFT * one), one)
            return replace(found, floor=self._floor(found))

    def _floor(self, spectrum: Spectrum) -> float:
        """Round-off of the slow eigenvalues in the ``spectrum``; infinite where the rod has none."""
        values, one = spectrum.values, spectrum.one
        slow = np.flatnonzero(abs(values) < SLOW * one)
        several = len(slow) and (abs(values[slow] - values[slow[0]]) > APART * abs(values[slow]).max()).any()
        if self.floating or not len(slow) or not (self.slow or several):
            return np.inf
        found = self.of(spectrum, slow)
        energy = abs(squares(self.system.comm, found.vectors, found.weighed))
        columns = zip(found.vectors.T, energy.tolist(), strict=True)
        rounded = [rounding_of(self.matrix, v, v) / e for v, e in columns if e > 0]
        return max(SOLVED * one, float(spectrum.noise[slow].max()), NOISE * max(rounded, default=0.0))

    def leftmost(self, number: int) -> Frequencies:
        """Left-most eigenvalues, ``number`` or more of those nearest the origin, whose motions have no names yet."""
        return in_order(self.nearest(max(number, FREQUENCIES) + BEYOND + SPARE))

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
        whole = np.concatenate(self.system.comm.allgather(basis / self.solver.sizes.array_r.real[:, None]))
        condensed = self.spectrum.condensed
        return inside(condensed.dual.T @ whole[condensed.heavy], condensed.pairs.right)

    def condensed(self, target: float) -> Condensed:
        """The pencil on its unknowns with mass, about a shift; :class:`ConvergenceError` if it is singular there."""
        shift = target / self.solver.system.scene.units.omega2  # of this state alone
        if target not in self._condensed:
            stiffness, mass = (gathered(A).real for A in self.in_units())
            self._condensed = {target: condensed(stiffness, mass, shift)}  # factors are those of one shift
        return self._condensed[target]

    def _found(self, condensed: Condensed, values: np.ndarray, pairs: Eigenpairs, *, left: bool = False) -> Frequencies:
        """Frequencies of ``values`` (k,) in natural units, of ``pairs`` of ``T``."""
        units = self.system.scene.units
        vectors = condensed.vectors(pairs, left=left)[self._own]
        weighed = condensed.spread(pairs.right)[self._own] if units.ordinary and not (self._free or left) else None
        if not units.ordinary:
            values, vectors = values * units.omega2, vectors * self.solver.sizes.array_r.real[:, None]
        if self._free and not left:
            vectors = vectors.astype(complex)
            self._complete(values, vectors)
        weighed = self.weighed(vectors) if weighed is None else weighed
        return Frequencies(values, pairs.error, (), vectors, weighed, units.omega2, self.floating)

    def motion(self, basis: np.ndarray) -> str:
        """Type of the motion spanned by a ``basis`` (n, k)."""
        return motion_names.name_of(
            motion_names.turning_shares(self.system, self.turned, [*basis.real.T, *basis.imag.T])
        )

    def weighed(self, vectors: np.ndarray) -> np.ndarray:
        """``M X`` for real or complex vectors (n, k)."""
        comm = self.system.comm
        return times(self.solver.rows, vectors if comm.size == 1 else np.concatenate(comm.allgather(vectors)))

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """``a^* b`` of all ranks' rows."""
        return product(self.system.comm, a, b)

    def _complete(self, values: np.ndarray, vectors: np.ndarray) -> None:
        """Add to vectors, in place, their parts along free motions ``g``: ``g . S x / mu``, of ``g . Mx = 0`` before.

        From ``S (x + c g) = mu M (x + c g)``, with ``S g = 0``.  Where ``mu`` is zero to round-off none is taken.
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


def begins_slowly(spectrum: Spectrum) -> bool:
    """Whether one of the eigenvalues of the first state is slow: it is about to vanish in no ordinary rod."""
    sizes = abs(spectrum.values) / spectrum.one
    return bool(((sizes > CLEAR * SOLVED) & (sizes < SLOW)).any())


def _half(nu: np.ndarray) -> int:
    """1 where the last of some eigenvalues (k,) is one of a pair that is cut in two, else 0."""
    if len(nu) < 2 or not nu[-1].imag:
        return 0
    return int(abs(nu[:-1] - nu[-1].conjugate()).min() > abs(nu[-1].imag))

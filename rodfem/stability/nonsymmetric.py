"""Eigenvalues ``mu = omega^2`` of a rod under loads without a potential: a non-symmetric pencil ``S x = mu M x``.

A follower load makes the tangent matrix ``S`` non-symmetric, by a matrix of low rank (the linearised end load couples
the rotation of the end to the forces there).  Two real eigenvalues may then collide and leave the real axis: flutter.

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
from rodfem.linalg.matrices import EPS, gathered, local_rows, rounding_of
from rodfem.problem.trials import floats
from rodfem.stability import motion_names
from rodfem.stability.inertia import NOISE
from rodfem.stability.pencil import PencilMatrices, assemble_pencil, exclude_modes, in_units, symmetry_modes
from rodfem.stability.spectrum import REAL, SHIFT, Eigenpairs, Spectrum, inside, size_of_zero, times

MULTIPLE, ALIKE = 1e-8, 1e-6
"""Eigenvalues that differ by less than this, relative, are one that is multiple; have one name, and one curve."""
STILL = 1e-10
"""Share of the farthest eigenvalue below which one is zero."""
SPARE = 2
"""Eigenvalues that are found beyond those asked for: one of a pair, or of equal ones, may be the last."""
BEYOND = 6
"""The same next to the shift, for those nearest zero: a negative one may be nearer to the shift."""
FREQUENCIES = 6
"""Number of frequencies recorded at each load where nobody asks for another."""
SLOW, SOLVED = 1e-3, 1e-9
"""Part of the natural size below which eigenvalues are slow, and what a state leaves open of them."""

ITERATIONS = 12
LITTLE = 1e-6
"""Inertia, relative to the mass, that makes all eigenvalues finite."""


@dataclass(frozen=True)
class Frequencies:
    """Eigenvalues of a state with their vectors."""

    values: np.ndarray  # (k,)
    errors: np.ndarray  # of 1 / (mu - shift) over the greatest (k,)
    kinds: tuple[str, ...] = ()  # names of the motions
    vectors: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # (n, k) of this rank, real if all values are
    weighed: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # their products with the mass
    one: float = 1.0  # natural size of the eigenvalues
    floating: bool = False  # whether nothing holds the rod: some are zero
    floor: float = np.inf  # what round-off makes of zero, of a rod that is held and has slow motions

    @property
    def far(self) -> float:
        """Size of an eigenvalue relative to which others are zero: the greatest, but for a light rod with heavy bodies.

        That has a few slow motions, and others whose eigenvalues are 1e10 times as great.
        """
        greatest = float(abs(self.values).max(initial=0.0))
        return greatest if self.floating else min(greatest, 1e4 * self.natural)

    @property
    def natural(self) -> float:
        """Natural size of the slowest motions: that of the two slowest eigenvalues, and of bending at least."""
        slowest = float(np.sort(abs(self.values))[:2].max(initial=0.0))
        return max(slowest, self.one if np.isinf(self.floor) else self.floor)

    @property
    def noise(self) -> float:
        """Magnitude below which an eigenvalue counts as zero."""
        return size_of_zero(self.values, self.one, self.floor)

    def zeros(self) -> int:
        """Number of eigenvalues that are zero: of rigid motions, and their partners in Jordan blocks."""
        return int((abs(self.values) < STILL * self.far).sum())

    def in_order(self) -> Frequencies:
        """The same in ascending order of real parts, without names."""
        scale = min(self.one, self.natural)
        order = np.lexsort((self.values.imag, np.round(self.values.real / scale, 6)))
        columns = {name: getattr(self, name)[:, order] for name in ("vectors", "weighed")}
        return replace(self, values=self.values[order], errors=self.errors[order], **columns)


def label(system: System, found: Frequencies, turned: np.ndarray, number: int | None = None) -> Frequencies:
    """Frequencies at a state with the rotation field ``turned``, the first ``number`` of them named."""
    together = [g for g in groups(found.values, found.far, ALIKE) if number is None or g[0] < number]
    owner = np.repeat(np.arange(len(together)), list(map(len, together)))
    vectors = np.concatenate([_span(system.comm, found, group) for group in together], axis=1)
    shares = np.zeros((len(together), 4))
    for part in (vectors.real, vectors.imag) if np.iscomplexobj(vectors) else (vectors,):
        np.add.at(shares, owner, motion_names.squares(system, turned, part))
    names, floating = motion_names.names_of(shares), floats(system.scene)
    kinds = dict.fromkeys(range(len(found.values)), "")
    for group, name in zip(together, names, strict=True):
        rigid = floating and abs(found.values[group]).max() < STILL * found.far
        kinds |= dict.fromkeys(group, motion_names.RIGID if rigid else name)
    return replace(found, kinds=tuple(kinds.values()))


def _span(comm: MPI.Comm, found: Frequencies, group: list[int]) -> np.ndarray:
    vectors = found.vectors[:, group]
    return orthonormal(comm, vectors, found.weighed[:, group]) if len(group) > 1 else vectors


def groups(values: np.ndarray, far: float, tolerance: float = MULTIPLE) -> list[list[int]]:
    """Places of eigenvalues that differ by less than a ``tolerance``, relative to them or to what is ``far``."""
    out: list[list[int]] = []
    sizes = tolerance * np.maximum(abs(values), min(abs(values).max(initial=0.0), far) / 100)
    if (abs(values[:, None] - values) < sizes[:, None]).sum() <= len(values):  # no two of them
        return [[i] for i in range(len(values))]
    for i, value in enumerate(values):
        group = next((g for g in out if abs(value - values[g[0]]) < sizes[i]), None)
        if group is None:
            out.append([i])
        else:
            group.append(i)
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
    """Basis of the span of ``vectors`` (n, k), orthonormal in the mass, by products with it; zero without mass."""
    parts, turn = np.linalg.eigh(product(comm, vectors, weighed))
    sizes = np.maximum(parts, EPS * parts[-1])
    return np.asarray(vectors @ (turn / np.sqrt(np.where(sizes > 0.0, sizes, np.inf))))


class NonsymmetricSolver(PencilMatrices):
    """Matrices of the pencil, which the states of one :class:`~rodfem.fem.system.System` share: see :meth:`at`.

    The rod is ``slow`` if it has motions far slower than bending at its first state: their round-off is measured.
    """

    def __init__(self, system: System) -> None:
        super().__init__(system)
        self.free = list[PETSc.Vec]()
        self.floating = system.scene.closed or floats(system.scene)
        self.slow, self.filled = False, 0

    def at(self, x: PETSc.Vec) -> NonsymmetricPencil:
        """Assemble the pencil at the state ``x``, without the motions of symmetries, which may make it singular."""
        self.filled += 1
        if self.filled % 64 == 0:  # PETSc keeps what is not used any more
            compat.destroy_garbage(self.system.comm)
        with self.system.clock("assembly"):
            state = assemble_pencil(self.system, x, self.matrix, self.mass)
            free = symmetry_modes(self.system, x)
            self.free = exclude_modes(self.system, free, self.matrix, self.mass) if free else []
        return NonsymmetricPencil(self, state.turned)


class NonsymmetricPencil:
    """The pencil of one state, whose rotation field is ``turned``: its eigenvalues, and products in its mass."""

    def __init__(self, shared: NonsymmetricSolver, turned: np.ndarray) -> None:
        self.system, self.turned, self._shared, self._filled = shared.system, turned, shared, shared.filled
        self._one, self._own = shared.system.scene.units.omega2, slice(*shared.matrix.getOwnershipRange())

    @property
    def solver(self) -> NonsymmetricSolver:
        """What made it; raises :class:`RuntimeError` where the matrices hold another state by now."""
        if self._shared.filled != self._filled:
            raise RuntimeError("The matrices hold another state by now: ask for this one again, by the solver's at().")
        return self._shared

    @property
    def matrix(self) -> PETSc.Mat:
        """Tangent matrix ``S``, and constraints against motions of symmetries."""
        return self.solver.matrix

    @property
    def mass(self) -> PETSc.Mat:
        """Kinetic metric ``M``."""
        return self.solver.mass

    def _in_units(self, mass: PETSc.Mat) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """All of matrix and a ``mass``, in units of natural sizes."""
        stiffness, mass = in_units(self.system, self.matrix, mass, self.solver.sizes)
        return gathered(stiffness).real, gathered(mass).real

    def inverse(self, target: float) -> Spectrum:
        """The pencil on its unknowns with mass, about a shift; :class:`ConvergenceError` if it is singular there."""
        out = Spectrum(*self._in_units(self.mass), target / self._one, self._one)
        out.order = self.system.scene.inertia.order
        return out

    @cached_property
    def spectrum(self) -> Spectrum:
        """All eigenvalues that the mesh has; of a mesh with many unknowns those nearest zero."""
        with self.system.clock("stability"):
            found = self.inverse(SHIFT * self._one)
            found.floor = self._floor(found)
            return found

    @property
    def massless(self) -> int:
        """Number of unstable motions without inertia: a little of it all along the rod makes all eigenvalues finite."""
        mass = self.mass.copy()
        mass.axpy(LITTLE * mass.norm() / self.system.metric.norm(), self.system.metric)
        found = Spectrum(*self._in_units(mass), SHIFT, self._one)
        found.order = self.spectrum.order
        return found.unstable - self.spectrum.unstable if found.complete else 0

    def _floor(self, spectrum: Spectrum) -> float:
        """Round-off of the slow eigenvalues in the ``spectrum``; infinite where the rod has none.

        Two distinct ones are slow: one, or a multiple one, may be about to vanish in any rod.
        """
        values, one = spectrum.values, spectrum.one
        slow = np.flatnonzero(abs(values) < SLOW * one)
        apart = 1e-3 * abs(values[slow]).max(initial=0.0)  # two that are not one
        several = (abs(values[slow] - values[slow[:1]]) > apart).any()
        if self.solver.floating or not len(slow) or not (self.solver.slow or several):
            return np.inf
        found = self.frequencies(spectrum, slow)
        energy = abs(squares(self.system.comm, found.vectors, found.weighed))
        columns = zip(found.vectors.T, energy.tolist(), strict=True)
        rounded = [rounding_of(self.matrix, v, v) / e for v, e in columns if e > 0]
        return max(SOLVED * one, float(spectrum.noise[slow].max()), NOISE * max(rounded, default=0.0))

    def nearest(self, number: int, target: float, *, left: bool = False) -> Frequencies:
        """Return the eigenvalues nearest to ``target``, ``number`` or more, or all there are, in ascending order.

        ``left`` vectors have ``z.S = mu z.M`` without conjugation, and no parts along free motions ``g``, where ``z.Mg
        = 0``.
        """
        with self.system.clock("stability"):
            pencil = self.inverse(target)
            pairs = pencil.greatest(number + SPARE, left=left)
            pairs = pairs.at(slice(len(pairs.nu) - _half(pairs.nu)))
            return self._frequencies(pencil, pencil.eigenvalues(pairs), pairs, left=left).in_order()

    def near_zero(self, number: int, *, left: bool = False) -> Frequencies:
        """Return more than the ``number`` eigenvalues nearest zero, with the names of their motions."""
        found = self.nearest(number + BEYOND, SHIFT * self._one, left=left)
        return label(self.system, found, self.turned)

    def leftmost(self, number: int) -> Frequencies:
        """Left-most eigenvalues, ``number`` or more of those nearest the origin, whose motions have no names yet."""
        nu = self.spectrum.pairs.nu[: max(number, FREQUENCIES) + BEYOND + SPARE]
        return self.frequencies(self.spectrum, np.arange(len(nu) - _half(nu))).in_order()

    def frequencies(self, spectrum: Spectrum, places: np.ndarray) -> Frequencies:
        """Frequencies of some eigenvalues of a ``spectrum`` of this state, in its order and not named yet."""
        found = self._frequencies(spectrum, spectrum.values[places] / self._one, spectrum.pairs.at(places))
        return replace(found, floor=spectrum.floor)

    def _frequencies(
        self, spectrum: Spectrum, values: np.ndarray, pairs: Eigenpairs, *, left: bool = False
    ) -> Frequencies:
        """Frequencies of ``values`` (k,) in natural units, of ``pairs`` of ``T``."""
        units, free = self.system.scene.units, self.solver.free
        vectors = spectrum.vectors(pairs, left=left)[self._own]
        weighed = spectrum.spread(pairs.right)[self._own] if units.ordinary and not (free or left) else None
        if not units.ordinary:
            values, vectors = values * units.omega2, vectors * self.solver.sizes.array_r.real[:, None]
        if free and not left:
            vectors = vectors.astype(complex)
            moving = abs(values) > REAL * self._one
            self.complete(vectors, np.diag(np.where(moving, 1.0 / np.where(moving, values, 1.0), 0.0)))
        weighed = self.weighed(vectors) if weighed is None else weighed
        return Frequencies(values, pairs.error, (), vectors, weighed, units.omega2, self.solver.floating)

    def complete(self, vectors: np.ndarray, inverse: np.ndarray) -> None:
        """Add to ``S X = M X A``, in place, parts along free motions ``g``, ``g . S X A^-1``; of ``g . MX = 0`` before.

        From ``S (X + g c) = M (X + g c) A``, with ``S g = 0``.  Where an eigenvalue is zero to round-off none is taken.
        """
        begin, end = self.matrix.getOwnershipRange()
        drifts = [index - begin for index in self.system.drifts if begin <= index < end]
        for mode in self.solver.free:
            force = mode.duplicate()
            self.matrix.multTranspose(mode, force)
            force.array[drifts] = 0.0
            work = self.system.comm.allreduce(force.array_r.real @ vectors)
            vectors += np.outer(mode.array_r.real, work @ inverse)

    def iterated(self, basis: np.ndarray, target: float, *, left: bool) -> np.ndarray:
        """Basis (n, k) of the right or ``left`` subspace of the eigenvalues nearest to ``target``, by one near it.

        Inverse iteration of all vectors at once does not mind that eigenvectors become one.
        """
        found, sizes = self.inverse(target), self.solver.sizes.array_r.real[:, None]
        first, last, solve = found.lower, found.dual, found.solve
        if left:
            first, last, solve = found.dual, found.lower, found.solve_transposed
        x = self.system.whole(basis / sizes)
        for _ in range(ITERATIONS):
            x = solve(found.spread(np.linalg.qr(last.T @ x[found.heavy])[0], first))
        return np.asarray(x[self._own] * sizes)

    def shares(self, basis: np.ndarray) -> np.ndarray:
        """Share (k,) of the vector of each eigenvalue of the spectrum in the span of a real ``basis`` (n, m)."""
        whole = self.system.whole(basis / self.solver.sizes.array_r[:, None])
        return inside(self.spectrum.dual.T @ whole[self.spectrum.heavy], self.spectrum.pairs.right)

    def motion(self, basis: np.ndarray) -> str:
        """Type of the motion spanned by a ``basis`` (n, k)."""
        return motion_names.name_of(self.system, self.turned, np.hstack([basis.real, basis.imag]))

    def weighed(self, vectors: np.ndarray) -> np.ndarray:
        """``M X`` for real or complex vectors (n, k)."""
        return times(local_rows(self.mass).real, self.system.whole(vectors))

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """``a^* b`` of all ranks' rows."""
        return product(self.system.comm, a, b)


def begins_slowly(spectrum: Spectrum) -> bool:
    """Whether one of the eigenvalues of the first state is slow: it is about to vanish in no ordinary rod."""
    sizes = abs(spectrum.values) / spectrum.one
    return bool(((sizes > 10.0 * SOLVED) & (sizes < SLOW)).any())


def _half(nu: np.ndarray) -> int:
    """1 where the last of some eigenvalues (k,) is one of a pair that is cut in two, else 0."""
    if len(nu) < 2 or not nu[-1].imag:
        return 0
    return int(abs(nu[:-1] - nu[-1].conjugate()).min() > abs(nu[-1].imag))

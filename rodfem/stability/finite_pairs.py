r"""Finite eigenvalues of a singular, non-symmetric pencil ``S x = mu M x`` near a shift, and which of them have digits.

Eigenvalues are found by shift-invert.  A complex PETSc takes a complex shift ``a + i b`` as it is, and is used where
it is what is installed.  A real one needs no more than twice the size: with vectors written as pairs of their real and
imaginary parts, ``S - (a + i b) M`` is the real matrix ::

    ( S - a M     b M   )
    (  -b M     S - a M )

whose pencil with ``diag(M, M)`` has the eigenvalues ``mu - (a + i b)`` and their conjugates; those with vectors
of the form ``(x, -i x)`` belong to the first kind.

``M`` is singular.  The infinite eigenvalues come in Jordan blocks, which round-off smears to large finite ones: those
are told by their distance from the shift and by the round-off of the stiffness over the kinetic energy of their
vectors, and in doubt by a second shift.

Those of a small pencil are found by orthogonal reductions of dense matrices.  The infinite ones are removed before any
eigenvalue is computed: with bases of the range and the null space of ``M`` ::

    S = ( S11  S10 )      M = ( M11  0 )
        ( S01  S00 ),         (  0   0 ),

the regular part of ``S00`` is eliminated (static condensation), and each null vector of it is a multiplier with its
constraint ``H x1 = 0``, on whose null space the pencil is projected.  What remains is such a pencil again, of smaller
size, until ``M`` is regular: the staircase of Van Dooren, Linear Algebra Appl. 27 (1979) 103-140, with rank decisions
by singular values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from rodfem import compat
from rodfem.errors import ConvergenceError
from rodfem.linalg.matrices import local_rows
from rodfem.stability import mode_type
from rodfem.stability.frequencies import EPS
from rodfem.tolerances import TINY

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
AGAIN = 1e-2
"""Relative difference of a finite eigenvalue from one shift and from another: 2e-3 and less, of others 0.2 and more."""
LOST = 1e-6
"""Relative round-off of the kinetic energy above which an eigenvalue has no digits: beside a body of 1e9 masses of the
rod."""
SHIFT = -10.0
"""Eigenvalues are sought next to this one, over their natural size: beside zero, where the matrix may be singular.

Far enough from it for a rod that floats, whose rigid motions are zero eigenvalues: what is nearest to the shift takes
its digits from all others.
"""
DENSE = 3
"""A pencil smaller than this many Krylov spaces is solved by dense reductions: it may have few finite eigenvalues."""
DRAWN = 3.0
"""Imaginary part of an eigenvalue that is round-off, over the distance of its real part from its Rayleigh quotient.

That is, beside a body of 1e6 times the rod's mass, what another shift changes it by: 1e-6 of the fourth, 1e-4 of the
last one of a dozen.
"""
NONE = 0.3
"""Distance of an eigenvalue from its Rayleigh quotient, relative, above which it has no digit: an infinite one.

It is 1 of those, which beside a body of 1e6 times the rod's mass lie among the finite ones, and 0.03 and less of these.
"""
SPARE = 2
"""Eigenvalues that are kept beyond those asked for: one of a pair, or of equal ones, may be the last."""
RANK = 1e-11
"""Singular values below this, relative to the norm of the pencil's matrices, are zero."""


@dataclass(frozen=True)
class EigenPair:
    """An eigenvalue, the real and imaginary ``parts`` of its vector on this rank, and its backward ``error``.

    A ``noisy`` one has more round-off than :data:`DOUBT`: far from the shift it is ``doubtful``, an infinite one maybe.
    The eigenvalue is the ``value``.
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


@dataclass(frozen=True)
class FinitePairs:
    """Finite eigenpairs of the pencil of ``matrix`` and ``mass``, both in units of natural sizes.

    ``solve(matrix, mass, number, shift)`` runs SLEPc near a shift.  Rows ``apart`` are those of the load and of drifts,
    which have no part in an eigenvalue and other units.  Of each vector the rows ``own`` are kept.
    """

    matrix: PETSc.Mat
    mass: PETSc.Mat
    solve: Callable[[PETSc.Mat, PETSc.Mat, int, complex], SLEPc.EPS]
    apart: tuple[int, ...]
    own: slice

    def near(self, number: int, target: complex) -> list[EigenPair]:
        """Return the ``number`` nearest to ``target``, nearest first, and up to :data:`SPARE` more.

        Fewer where there are no more finite ones, or where the last one is half of a pair.  Raises
        :class:`~rodfem.errors.ConvergenceError` where the pencil has no inertia, or SLEPc finds nothing.
        """
        if self.matrix.getSize()[0] < DENSE * (2 * number + 20):
            found = self._dense()
        elif target.imag == 0 or compat.COMPLEX:
            found = self._shifted(number, target)
        else:
            found = self._doubled(number, target)
        found = _whole_pairs(sorted(found, key=lambda p: abs(p.value - target))[: number + SPARE], target)
        third = abs(found[min(2, len(found) - 1)].value - target)
        return [p for p in found if abs(p.value - target) <= FAR * third]

    def _dense(self) -> list[EigenPair]:
        """All finite eigenvalues of a pencil that is small enough for dense matrices."""
        values, vectors = finite_eigenpairs(*(_dense(A) for A in (self.matrix, self.mass)))
        if len(values) == 0:
            raise ConvergenceError("The rod has no inertia: give it a mass, or a rotary inertia.")
        own = vectors[self.own]
        return [EigenPair(complex(w), [x.real.copy(), x.imag.copy()], EPS) for w, x in zip(values, own.T, strict=True)]

    def _shifted(self, number: int, target: complex) -> list[EigenPair]:
        """Solve with a shift that this PETSc's numbers can express.

        What may be infinite, for its round-off, is sought from another shift: finite eigenvalues are found again, each
        of them once.
        """
        found = self._pairs(number, target)
        if any(pair.doubtful for pair in found):
            others = self._pairs(number, target + SHIFT)
            for sure in (pair for pair in found if not pair.doubtful):
                _taken(others, sure)
            found = [pair for pair in found if not pair.doubtful or _taken(others, pair)]
        return found[: number + SPARE]

    def _pairs(self, number: int, target: complex) -> list[EigenPair]:
        """Eigenpairs that have digits, nearest to the shift first; ``number`` or more of them are finite."""
        solver = self.solve(self.matrix, self.mass, number, target if compat.COMPLEX else target.real)
        re, im = self.matrix.createVecRight(), self.matrix.createVecRight()
        values, out = [solver.getEigenvalue(i) for i in range(solver.getConverged())], list[EigenPair]()
        stiffness, inertia = EPS * self._stiffness(), EPS * self.mass.norm(PETSc.NormType.INFINITY)
        heavy = self.mass.getDiagonal()
        heavy.array[:] = abs(heavy.array_r) > 0
        nearest = min((abs(value - target) for value in values), default=0.0)
        far = min(FAR * nearest, NEAR * max(nearest, -SHIFT))  # rigid motions have no kinetic energy here
        for i in sorted(range(len(values)), key=lambda i: abs(values[i] - target)):
            value = solver.getEigenpair(i, re, im)
            size = max(abs(value), abs(value - target))
            kinetic = sum(abs(x.dot(self.mass * x)) for x in (re, im))
            moved = sum((x * heavy).norm() ** 2 for x in (re, im))
            noise = stiffness * (re.norm() ** 2 + im.norm() ** 2)
            beyond = abs(value - target) > far
            off = self._off(value, re, im) if beyond or value.imag else 0.0
            if beyond and (inertia * moved > LOST * kinetic or off > NONE * abs(value)):
                continue
            parts = mode_type.halves(re) if compat.COMPLEX else [re.array_r, im.array_r]
            error = solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)
            if value.imag and abs(value.imag) <= DRAWN * off:
                value = value.real
            noisy = bool(noise > DOUBT * size * kinetic)
            own = [part[self.own].copy() for part in parts]
            out.append(EigenPair(complex(value), own, error, noisy, beyond and noisy))
            if sum(not pair.doubtful for pair in out) == number + SPARE:
                break
        solver.destroy()
        return out

    def _off(self, value: complex, re: PETSc.Vec, im: PETSc.Vec) -> float:
        """Distance of an eigenvalue from the Rayleigh quotient of its vector, ``re + i im``: about its round-off.

        Where PETSc is complex ``re`` is all of it.  Rows apart are left out.
        """
        parts = [re] if compat.COMPLEX else [re, im]
        left, other = [x.copy() for x in parts], self._rows_apart()
        for x in left:
            x.array[other] = 0.0
        S, M = (np.array([[x.dot(A * y) for y in parts] for x in left]) for A in (self.matrix, self.mass))
        if compat.COMPLEX:
            stiffness, inertia = S[0, 0], M[0, 0]
        else:  # (re - i im) . A (re + i im)
            stiffness, inertia = (A[0, 0] + A[1, 1] + 1j * (A[0, 1] - A[1, 0]) for A in (S, M))
        return float(abs(stiffness - value * inertia) / max(abs(inertia), TINY))

    def _rows_apart(self) -> list[int]:
        """Those of the rows apart that this rank has, counted from its first one."""
        begin, end = self.matrix.getOwnershipRange()
        return [i - begin for i in self.apart if begin <= i < end]

    def _stiffness(self) -> float:
        """Largest sum of the absolute entries of a row of the matrix, but for rows apart.

        These have a one on the diagonal, which is no stiffness and has other units.
        """
        sums = np.asarray(abs(local_rows(self.matrix)).sum(axis=1)).ravel()
        sums[self._rows_apart()] = 0.0
        return float(self.matrix.comm.tompi4py().allreduce(float(sums.max(initial=0.0)), op=MPI.MAX))

    def _doubled(self, number: int, target: complex) -> list[EigenPair]:
        """Solve with a complex shift by the real matrix of twice the size."""
        a, b, comm = target.real, target.imag, self.matrix.comm
        shifted, upper = self.matrix.copy(), self.mass.copy()
        shifted.axpy(-a, self.mass, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        upper.scale(b)
        lower = upper.copy()
        lower.scale(-1.0)
        pencil = PETSc.Mat().createNest([[shifted, upper], [lower, shifted]], comm=comm).convert("aij")
        masses = PETSc.Mat().createNest([[self.mass, None], [None, self.mass]], comm=comm).convert("aij")
        solver = self.solve(pencil, masses, 2 * number, 0.0)
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
                vector = (x + 1j * y)[self.own]
                error = solver.computeError(i, SLEPc.EPS.ErrorType.BACKWARD)
                out.append(EigenPair(target + shift, [vector.real.copy(), vector.imag.copy()], error))
        solver.destroy()
        for made in (shifted, upper, lower, pencil, masses):
            made.destroy()
        return out[:number]


def split(matrix: np.ndarray, norm: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return ``U1, s, V1, U0, V0`` with ``matrix = U1 diag(s) V1^t`` and null spaces ``U0^t``, ``V0``.

    Singular values are measured against ``norm``.
    """
    u, s, vt = np.linalg.svd(matrix)
    rank = int((s > RANK * norm).sum())
    return u[:, :rank], s[:rank], vt[:rank].T, u[:, rank:], vt[rank:].T


def kernel(matrix: np.ndarray) -> np.ndarray:
    """Orthonormal basis (n, k) of the null space of a matrix (m, n), of which m may be zero: LAPACK refuses that."""
    return np.asarray(scipy.linalg.null_space(matrix, rcond=RANK)) if matrix.size else np.eye(matrix.shape[1])


def finite_eigenpairs(S: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all finite eigenvalues (complex, sorted by magnitude) and their vectors (n, number).

    Multipliers that drop out of the reduction are zero in the vectors.  Empty for a pencil without inertia.  Raises
    :class:`numpy.linalg.LinAlgError` for a pencil that is singular at every shift.
    """
    stiffness, inertia = (max(float(np.linalg.norm(A, ord=2)), TINY) for A in (S, M))
    back = np.eye(len(S))
    while len(M):
        u1, _, v1, u0, v0 = split(M, inertia)
        if u0.shape[1] == 0:
            break
        p, regular, q, p0, q0 = split(u0.T @ S @ v0, stiffness)
        s01, s10 = u0.T @ S @ v1, u1.T @ S @ v0
        condensed = q @ ((p.T @ s01) / regular[:, None])
        s11 = u1.T @ S @ v1 - s10 @ condensed
        z, w = kernel(p0.T @ s01), kernel((s10 @ q0).T)
        if w.shape != z.shape:  # dependent constraints on one side only: the pencil has no definite eigenvalues
            raise np.linalg.LinAlgError("the pencil is singular for every mu")
        back = back @ ((v1 - v0 @ condensed) @ z)
        S, M = w.T @ s11 @ z, w.T @ u1.T @ M @ v1 @ z
    values, vectors = scipy.linalg.eig(np.linalg.solve(M, S)) if len(M) else (np.zeros(0), np.zeros((0, 0)))
    order = np.argsort(abs(values))
    return np.asarray(values[order], dtype=complex), back @ vectors[:, order]


def _taken(others: list[EigenPair], pair: EigenPair) -> bool:
    """Whether one of the ``others`` is the same finite eigenvalue as that of a ``pair``; it is taken from them."""
    nearest = min(others, key=lambda other: abs(other.value - pair.value), default=None)
    if nearest is None or abs(nearest.value - pair.value) > AGAIN * abs(nearest.value):
        return False
    others.remove(nearest)
    return True


def _whole_pairs(found: list[EigenPair], target: complex) -> list[EigenPair]:
    """Eigenvalues near a real ``target`` without the last one where that is a half of a pair, cut in two."""
    if target.imag or len(found) < 2 or not found[-1].value.imag:
        return found
    value, others = found[-1].value.conjugate(), [p.value for p in found[:-1]]
    cut = min(abs(v - value) for v in others) > abs(value.imag)
    return found[:-1] if cut else found


def _dense(matrix: PETSc.Mat) -> np.ndarray:
    """A matrix on this rank as a dense array, real."""
    return np.array(matrix.copy().convert("dense").getDenseArray().real)

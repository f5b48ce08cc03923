r"""The reduced stiffness matrix H of a state: its second variation on a few amplitudes, with all else relaxed.

Of k vectors ``Phi`` (n, k), orthonormal in the metric ``M`` and near the modes nearest zero, ``B = M Phi`` is the
border of the saddle matrix ``S``.  With

    S W = B H,    B^t W = 1,    that is    H = W^t S W = (B^t S^-1 B)^-1,

H (k, k) is the Schur complement of S on the amplitudes ``B^t x``: static condensation.  S and H are singular together,
with null vectors ``W v``.  By Haynsworth's identity

    index(S) = far + negative(H),

where ``far`` is the index on ``B^t x = 0``: it changes only where the bordered matrix ``(S B; B^t 0)`` is singular.
Along a branch

    H' = W^t S' W,

and H is smooth whatever the eigenvalues near zero do, avoided crossings and double ones included.  A phase condition
``c . x``, a row and column of S with a drift scalar as its multiplier, moves with the state, and belongs to ``S'``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.fem.newton import TOLERANCE
from rodfem.fem.system import System
from rodfem.linalg.matrices import bordered, local_rows, matrix_of, times
from rodfem.stability.inertia import DOUBTFUL, Inertia, quotient_error

NEARLY_ZERO = 1e-6
"""Eigenvalue of H, over the lowest bending one, below which it may be round-off."""
DIFFERENCE, AHEAD = 1e-4, 1e-6
"""Distances of the states whose matrices are differenced, in the metric: on both sides, and ahead alone."""
ROTATED = 3.0
"""Size of ``W^t M W - 1`` above which a border has become that of other modes."""


class Bordered:
    """A square ``matrix`` of a system with a number of dense ``borders``, a column and a row each, and its factors.

    Those of a symmetric one count: ``constraints`` of its eigenvalues are negative whatever the state; else None.
    """

    def __init__(self, system: System, matrix: PETSc.Mat, borders: int, constraints: int | None) -> None:
        self.system, self.k, self.constraints = system, borders, constraints
        self.comm, self.n, fields = system.comm, system.fields.unknowns, system.fields
        self.extra = borders if system.has_scalars else 0  # rows of the borders on this rank, the last one
        pattern, self._border = bordered(local_rows(matrix), self.n + borders, borders, self.extra)
        self.own, self.matrix = len(self._border), matrix_of(self.comm, pattern, compiled=fields.compiled)
        self._rows = local_rows(self.matrix) if fields.compiled else pattern.astype(float)
        kind, natural = "lu" if constraints is None else "cholesky", system.natural_sizes and self._sizes
        self.factors = fields.factors(kind, natural, borders)

    def _sizes(self) -> PETSc.Vec:
        """Natural sizes of the unknowns; the multipliers of the borders have those of drifts."""
        out, own = self.matrix.createVecRight(), self.system.balanced.array_r
        out.set(self.system.scene.units.energy**0.5)
        out.array[: len(own)] = own
        return out

    def factor(self, matrix: PETSc.Mat, columns: list[PETSc.Vec], rows: list[PETSc.Vec] | None = None) -> int:
        """Factor with a matrix of the same pattern; its negative eigenvalues off the borders, -1 without a count."""
        values = self._rows.data
        values[: self.own][~self._border] = local_rows(matrix).data.real
        size, sides = (self.k, matrix.getLocalSize()[0]), (columns, rows or columns)
        local = [np.reshape([v.array_r.real for v in side], size).T for side in sides]
        values[: self.own][self._border] = local[0].ravel()
        parts = self.comm.gather(local[1], root=self.comm.size - 1)
        if parts is not None:
            below = np.zeros((self.k, self.n + self.k))
            below[:, : self.n] = np.concatenate(parts).T
            values[self.own :] = below.ravel()
        if not self.system.fields.compiled:
            self.matrix.setValuesCSR(self._rows.indptr, self._rows.indices, values)
            self.matrix.assemble()
        self.matrix.stateIncrease()
        with self.system.clock("stability"):
            self.factors(self.matrix)
            if self.constraints is None:
                rest, singular = -1, not self.factors.regular
            else:
                negative, zero = self.factors.inertia()
                rest = negative - self.constraints - self.system.phase.count - self.k
                singular = zero > 0 or rest < 0
        if singular:
            raise ConvergenceError("another eigenvalue vanishes")
        return int(rest)

    def solve(self, columns: Sequence[PETSc.Vec] = ()) -> tuple[list[PETSc.Vec], np.ndarray]:
        """Solutions for ``(column, 0)``, then for a unit on each border: vectors, and multipliers (k, number)."""
        right = np.zeros((self._rows.shape[0], len(columns) + self.k))
        inner = len(right) - self.extra
        for i, column in enumerate(columns):
            right[:inner, i] = column.array_r.real
        right[inner:, len(columns) :] = np.eye(self.extra, self.k)
        with self.system.clock("solve"):
            out = self.factors.solve_all(right)
            out = out + self.factors.solve_all(right - times(self._rows, self.system.whole(out)))
        return self.system.vectors(out[:inner]), self.comm.bcast(out[inner:], root=self.comm.size - 1)


def bordered_of(inertia: Inertia, borders: int) -> Bordered:
    """The second variation of an ``inertia`` with so many borders; what it factors last is what it solves with."""
    if borders not in inertia.bordered:
        inertia.bordered[borders] = Bordered(inertia.system, inertia.matrix, borders, inertia.constraints)
    made: Bordered = inertia.bordered[borders]
    return made


@dataclass(frozen=True, eq=False)
class ReducedStiffness:
    """Matrix ``H`` of a state with a border, and ``rate``, its derivative along the unit tangent, both (k, k)."""

    H: np.ndarray
    rate: np.ndarray
    far: int  # the index across the border
    W: np.ndarray  # (n, k)
    rotated: float  # how far the amplitudes are from those of the border's modes
    zero: int  # number of eigenvalues that are zero to working accuracy


class Condensation:
    """Reduced stiffness matrices of states on one mesh, by the saddle matrix of an ``inertia``."""

    def __init__(self, inertia: Inertia) -> None:
        self.system, self.inertia = inertia.system, inertia
        self._last: tuple[np.ndarray, np.ndarray] | None = None

    def border(self, x: PETSc.Vec) -> np.ndarray:
        """The six modes nearest zero at a state ``x``, (own rows, 6), fewer if there are no more; any basis near."""
        found = self.inertia.at(x)
        found.eigenvalue_count(self.inertia.tolerance)
        with self.inertia.afresh():
            return np.stack([v.array_r.real for v in found.nearest(6, 0.1)[1]], axis=1)

    def improved(self, reduced: ReducedStiffness) -> np.ndarray:
        """The border after a step of inverse iteration: ``W``, made orthonormal."""
        none = reduced.W[:, :0]
        return self.inertia.extension(reduced.W, none, none)[0]

    def at(self, x: PETSc.Vec, tangent: PETSc.Vec, phi: np.ndarray) -> ReducedStiffness:
        """Reduced stiffness matrix at an equilibrium ``x`` with its unit ``tangent``, for a border ``phi``."""
        inertia, found, B = self.inertia, self.inertia.at(x), self._weighed(phi)
        try:
            below, Z = found.eigenvalue_count(0.0), found.relaxed(B)
            H, (values, vectors) = self._condensed(B, Z)
            if abs(values).min() < DOUBTFUL * inertia.scale:  # it may touch zero
                Z = Z + found.factors.solve_all(B - inertia.times(Z))
                H, (values, vectors) = self._condensed(B, Z)
            near = not abs(values).min() > inertia.regular  # S is too nearly singular to be solved with
        except (ConvergenceError, np.linalg.LinAlgError):
            near = True
        if near:
            far, H, W = self._by_bordered_matrix(x, B)
            values, vectors = np.linalg.eigh(H)
        else:
            far, W = below - int((values < 0).sum()), Z @ H
        soft, doubt = int(abs(values).argmin()), TOLERANCE * inertia.scale
        if small := bool(abs(values[soft]) < NEARLY_ZERO * inertia.scale):
            doubt = max(doubt, quotient_error(inertia.at(x).matrix, self.system.new_vector(W @ vectors[:, soft])))
        rotated = float(abs(np.linalg.eigvalsh(inertia.sum(W.T @ inertia.weighed(W))) - 1.0).max())
        zero = int((abs(values) <= doubt).sum())
        return ReducedStiffness(H, self._rate(x, tangent, (H, W), central=small), far, W, rotated, zero)

    def _weighed(self, phi: np.ndarray) -> np.ndarray:
        """Metric times a border, which serves for many states."""
        if self._last is None or self._last[0] is not phi:
            self._last = phi, self.inertia.weighed(phi)
        self.inertia.edge = self._last[1]
        return self.inertia.edge

    def _condensed(self, B: np.ndarray, Z: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
        """H with its eigenvalues and vectors."""
        H = _symmetric(np.linalg.inv(_symmetric(self.inertia.sum(B.T @ Z))))
        return H, np.linalg.eigh(H)

    def _by_bordered_matrix(self, x: PETSc.Vec, B: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
        """``far``, H and W where S is nearly singular, or is."""
        matrix, bordered = self.inertia.at(x).matrix, bordered_of(self.inertia, B.shape[1])
        far = bordered.factor(matrix, self.system.vectors(B))
        modes, G = bordered.solve()
        return far, _symmetric(-G), np.stack([w.array_r for w in modes], axis=1)

    def _rate(
        self, x: PETSc.Vec, tangent: PETSc.Vec, pair: tuple[np.ndarray, np.ndarray], *, central: bool
    ) -> np.ndarray:
        """``W^t S' W`` along a tangent by a difference from ``W^t S W = H``, with the phase conditions of ``x``.

        A soft eigenvalue may change less than round-off of that: its difference is wider, and ``central``.
        """
        system, inertia, (H, W) = self.system, self.inertia, pair
        system.set_phase(x)
        behind, length = x, AHEAD
        if central:
            behind, length = x - tangent * DIFFERENCE, 2 * DIFFERENCE
            H = inertia.sum(W.T @ inertia.images(behind, W))
        ahead = behind + tangent * length
        out = (inertia.sum(W.T @ inertia.images(ahead, W)) - H) / length
        phase = system.phase
        if phase.rows:
            rates = (system.at(ahead).generators - system.at(behind).generators) / length
            for i, weights in phase.broken.items():
                rate = system.new_vector(weights @ rates).array_r
                own = np.arange(*inertia.metric.getOwnershipRange()) == system.drifts[i]
                term = np.outer(inertia.sum(W.T @ inertia.weighed(rate[:, None])[:, 0]), inertia.sum(own @ W))
                out += term + term.T
        return _symmetric(out)


def _symmetric(A: np.ndarray) -> np.ndarray:
    return np.asarray((A + A.T) / 2)

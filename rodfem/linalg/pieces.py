r"""Factors of a bordered matrix on several ranks, each of which eliminates its own piece of the chain.

Let ``x_r`` be the inner unknowns of rank r, which couple to none of another rank, and ``u`` the interface: unknowns at
the cuts, and all scalars.

    A_r x_r + B_r u = b_r,        sum_r C_r x_r + G u = c.

Each rank eliminates along its piece, front after front, a part ``E_r`` of ``A_r`` that it chooses pivot by pivot, such
that multipliers are bounded (``chain.c``).  What remains of ``x_r`` are the pivots ``d_r`` that it had to delay to the
end, and a small Schur complement of ``(d_r, u)``.  The ranks send these to each other and add them to the joint matrix
``J`` of ``(d_1, ..., d_p, u)``, which each of them eliminates densely.

*Inertia.*  It adds over the elimination of regular parts (Haynsworth, Linear Algebra Appl. 1 (1968) 73-81), so that

    negative(A) = sum_r negative(E_r) + negative(J),

and the determinants multiply.  ``A_r`` need not be regular, nor even nearly so: a piece between two clamps buckles at
loads of its own, where the rod does not.  The pivot that it has not is then delayed.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.errors import ConvergenceError
from rodfem.linalg.chain import Elimination, sequence
from rodfem.linalg.factorization import AlongRod, Mumps, Sizes
from rodfem.linalg.piece import Piece


class Pieces(AlongRod):
    """:class:`~rodfem.linalg.factorization.Factors` on several ranks of matrices whose pattern is symmetric and stays.

    ``kind`` is ``lu``, or ``cholesky`` (LDL^t with the inertia).  What round-off decides is the same on all ranks, also
    where their processors are not: inertia and determinant are rank 0's.
    """

    def __init__(self, kind: str, scalars: int, resort: Mumps | None = None, sizes: Sizes | None = None) -> None:
        """Share the last ``scalars`` unknowns of matrices of this ``kind``; keep the last ``resort``.

        ``sizes`` returns the natural sizes of the unknowns, None where they are one.
        """
        super().__init__(resort, sizes)
        self.kind, self.scalars = kind, scalars
        self._matrix: PETSc.Mat | None = None
        self._inertia, self._determinant = (0, 0), -inf

    def eliminate(self, matrix: PETSc.Mat) -> None:
        """Factor ``matrix``; raises what one of the ranks raises on all of them."""
        if self._matrix is None or matrix.handle != self._matrix.handle:
            self._matrix = matrix
            self._set_up(matrix)
        trouble: ConvergenceError | None = None
        elimination = self.elimination
        values = self.piece.values()
        try:
            elimination.factor(values)
        except ConvergenceError as error:
            trouble = error
        part = trouble, elimination.inertia()[0], elimination.determinant(), elimination.schur()
        troubles, negative, determinants, complements = zip(*self.comm.allgather(part), strict=True)
        for of_a_rank in filter(None, troubles):
            raise of_a_rank
        self._join(complements)
        own, zero = self.joint.inertia()
        found = self.joint.regular, (sum(negative) + own, zero), sum(determinants) + self.joint.determinant()
        self.regular, self._inertia, self._determinant = self.comm.bcast(found)

    def _set_up(self, matrix: PETSc.Mat) -> None:
        """Find this rank's piece, and the borders of all."""
        self.comm = matrix.comm.tompi4py()
        self.piece = piece = Piece(matrix, self.scalars, symmetric=self.kind == "cholesky")
        self._borders = self.comm.allgather(piece.interface)
        pattern = piece.starts, piece.columns
        order = sequence(*pattern, piece.border)
        self.elimination = Elimination(self.kind, *pattern, order, places=piece.places, is_open=True)
        self._shared_sizes = np.ones(piece.shared)
        if self.sizes is not None:
            own, self._shared_sizes = piece.sizes(self.sizes().array_r.real)
            self.elimination.measure(own)
        self.joint = dense_elimination(self.kind, piece.shared)

    def _join(self, complements: tuple[np.ndarray, ...]) -> None:
        """Add the Schur complements of all ranks, and eliminate their sum."""
        joint, places = added(complements, self._borders, self.piece.shared, symmetric=self.kind == "cholesky")
        self._mine = places[self.comm.rank]
        if self.joint.rows != len(joint):
            self.joint = dense_elimination(self.kind, len(joint))
        if self.sizes is not None:
            self.joint.measure(np.append(np.ones(len(joint) - self.piece.shared), self._shared_sizes))
        self.joint.factor(joint.ravel())

    def solve_columns(self, right: np.ndarray) -> np.ndarray:
        """Solve for the columns (n, k) of the n rows of this rank; collective."""
        local = np.zeros((self.elimination.rows, right.shape[1]), order="F")
        local[: len(right)] = right
        joint = np.zeros((self.joint.rows, right.shape[1]))
        joint[self._mine] = self.elimination.forward(local)
        self.comm.Allreduce(MPI.IN_PLACE, joint)
        solved = self.joint.solve(joint)
        return self.elimination.back(solved[self._mine])[: len(right)]

    def eliminated(self) -> tuple[tuple[int, int], float]:
        """Inertia and determinant by elimination."""
        return self._inertia, self._determinant


def added(
    complements: Sequence[np.ndarray], borders: Sequence[np.ndarray], shared: int, *, symmetric: bool
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Joint matrix of the Schur complements of all pieces, and the places there of what each of them leaves.

    ``complements`` are dense matrices; ``borders`` are the places of their unknowns on the interface, which has
    ``shared`` of them; delayed pivots are before these, and come first in the joint matrix.  Of ``symmetric`` ones the
    lower triangles are given.
    """
    delayed = [len(part) - len(border) for part, border in zip(complements, borders, strict=True)]
    begin = np.cumsum([0, *delayed])
    joint = np.zeros((begin[-1] + shared,) * 2)
    places = [np.append(np.arange(*begin[r : r + 2]), begin[-1] + border) for r, border in enumerate(borders)]
    for place, part in zip(places, complements, strict=True):
        joint[np.ix_(place, place)] += part
    return np.tril(joint) + np.tril(joint, -1).T if symmetric else joint, places


def dense_elimination(kind: str, size: int) -> Elimination:
    """Elimination of dense matrices (size, size), in one front."""
    pattern = np.arange(size + 1) * size, np.tile(np.arange(size), size)
    return Elimination(kind, *pattern, (np.arange(size), np.array([0, size, size])))

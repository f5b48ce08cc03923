"""Generators ``g(x) = A x + c`` of all symmetries of a scene at a state, by one sparse matrix."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.fields import LOAD
from rodfem.fem.values import NodalValues
from rodfem.linalg.matrices import times

if TYPE_CHECKING:
    from rodfem.fem.parameters import Line
    from rodfem.fem.state import State
    from rodfem.fem.symmetries import Symmetry
    from rodfem.fem.system import System


class Generators:
    """Changes of states of one :class:`~rodfem.fem.system.System` by its symmetries, in the order of those.

    Of any other motions where they are given.
    """

    def __init__(self, system: System, motions: Sequence[Symmetry] | None = None) -> None:
        """Make the matrices."""
        fields = system.fields
        self.motions = system.symmetries if motions is None else list(motions)
        self.system, self.count = system, len(self.motions)
        scalars = fields.copies[0] if system.has_scalars else np.zeros(0, int)
        self._rows, self._columns = np.concatenate([fields.free_owned, scalars]), np.flatnonzero(fields.number >= 0)
        self._linear = [symmetry.linear(fields) for symmetry in self.motions]
        self._forth = self._stacked(self._linear)
        self._line: Line | None = None

    def _stacked(self, every: list[sp.csr_matrix]) -> sp.csr_matrix:
        """Own rows and free columns of matrices between all local degrees of freedom, one below the other."""
        if not every:
            return sp.csr_matrix((0, len(self._columns)))
        size = every[0].shape[0]
        rows = (np.arange(len(every))[:, None] * size + self._rows).ravel()
        return sp.vstack(every, format="csr")[rows][:, self._columns]

    @cached_property
    def _back(self) -> sp.csr_matrix:
        """``A^t`` of all generators, one below the other."""
        return self._stacked([A.T.tocsr() for A in self._linear])

    def _constant(self, state: State) -> np.ndarray:
        """``c`` of all generators: with ends that are held, and forces that are known, they vary with the load."""
        fixed = self.fixed(state.line)
        return self._constant_at(state.line, state.load) if fixed is None else fixed

    def fixed(self, line: Line) -> np.ndarray | None:
        """``c`` of all generators along a ``line``, (count, own rows), unless it varies with the load."""
        if line is not self._line:
            low, high = self.system.scene.span
            found = [self._constant_at(line, load) for load in (low, 0.62 * low + 0.38 * high, high)]
            varies = any(np.any(c != found[0]) for c in found)
            self._varies = bool(self.system.comm.allreduce(varies, op=MPI.LOR))
            self._line, self._fixed = line, found[0]
        return None if self._varies else self._fixed

    def in_unknowns(self) -> sp.csr_matrix:
        """``A`` of all generators, one below the other, for vectors of the system on one rank."""
        fields, n = self.system.fields, self.system.fields.unknowns
        columns = fields.number[self._columns]
        place = sp.csr_matrix((np.ones(len(columns)), (np.arange(len(columns)), columns)), shape=(len(columns), n))
        return (self._forth @ place).tocsr()

    def _constant_at(self, line: Line, load: float) -> np.ndarray:
        fields = self.system.fields
        at_load = NodalValues(fields, fields.filled({LOAD: load}), line)
        return np.array([symmetry.change(at_load)[self._rows] for symmetry in self.motions])

    def at(self, state: State) -> np.ndarray:
        """All generators at a state, (count, own rows): see :meth:`vector`."""
        if not self.count:
            return np.zeros((0, len(self._rows)))
        return times(self._forth, state.local[self._columns]).reshape(self.count, -1) + self._constant(state)

    def linear(self, d: PETSc.Vec) -> np.ndarray:
        """``A d`` of all generators for a change of state, (count, own rows)."""
        return times(self._forth, self._gathered(d)).reshape(self.count, -1)

    def pulled_back(self, covector: PETSc.Vec) -> np.ndarray:
        """``A^t y`` of all generators, (count, own rows)."""
        return times(self._back, self._gathered(covector)).reshape(self.count, -1)

    def _gathered(self, vector: PETSc.Vec) -> np.ndarray:
        return self.system.gathered(vector)[: len(self._columns)]

    def vector(self, own: np.ndarray) -> PETSc.Vec:
        """Vector of the system with these own rows, without component along drifts."""
        out = self.system.new_vector()
        out.array[: len(own)] = own
        return out

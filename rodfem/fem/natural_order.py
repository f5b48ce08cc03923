"""Vectors of a system in an order along the rod that no number of ranks changes, without the loss of a bit."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.system import System


class NaturalOrder:
    """Unknowns of one :class:`~rodfem.fem.system.System` element by element from left to right, then the scalars.

    Attributes
    ----------
    order
        Global number of each unknown in that order, (unknowns,), on every rank.
    """

    def __init__(self, system: System) -> None:
        """Number the unknowns; collective."""
        self.system, fields, comm = system, system.fields, system.comm
        owned = slice(0, fields.owned_cells)
        dofs = [fields.dofs[b.name][owned][:, np.argsort(compat.nodes(b.degree))] for b in fields.blocks]
        tables = [fields.number[of_block].reshape(fields.owned_cells, -1) for of_block in dofs]
        starts = np.concatenate(comm.allgather(fields.vertices[owned, 0]))
        rows = np.concatenate(comm.allgather(np.concatenate(tables, axis=1)))
        numbers = rows[np.argsort(starts)].ravel()
        numbers = numbers[numbers >= 0]  # those of clamps are none
        first = np.sort(np.unique(numbers, return_index=True)[1])  # neighbouring elements share a node
        self.order = np.append(numbers[first], np.arange(fields.field_unknowns, fields.unknowns))

    def values(self, x: PETSc.Vec) -> np.ndarray:
        """Values of a vector in this order, on every rank, (unknowns,); collective."""
        own = np.array(x.array_r.real)
        every = own if self.system.comm.size == 1 else np.concatenate(self.system.comm.allgather(own))
        return np.asarray(every[self.order])

    def vector(self, values: np.ndarray) -> PETSc.Vec:
        """Vector with these values."""
        out, every = self.system.new_vector(), np.empty(len(self.order))
        every[self.order] = values
        out.array[:] = every[slice(*out.getOwnershipRange())]
        return out

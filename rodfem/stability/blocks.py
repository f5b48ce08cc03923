"""The pencil of a state as named blocks of its unknowns and constraints.

The eigenproblem of a state is the singular pencil ``(K C; C^t 0) x = mu (M 0; 0 0) x``.  ``K`` (m, m) is the second
derivative of the whole Lagrangian in rotation, strain and centreline, ``C`` (m, p) its derivative in those and the
multipliers (each column the gradient of one constraint), ``M`` (m, m) the kinetic metric.  Every rank has all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.linalg.matrices import gathered
from rodfem.stability.pencil import assemble_pencil, in_units


@dataclass(frozen=True)
class Pencil:
    """Blocks ``K`` (m, m), ``C`` (m, p), ``M`` (m, m) of a state.

    Attributes
    ----------
    where
        For each field its rows in ``K`` and ``C`` (``q``, ``v``, ``r``, ``ends``: positions of ends that move), or
        columns of ``C`` (``eta``, ``n``, and ``scalars``: components of a constant contact force, moments at ends,
        multipliers of integral constraints, in the order of the fields' scalars).
    place
        Arclength (the middle of a cell) by which the constraints are in order along the rod, (p,); nan for one that
        involves the whole rod.
    """

    K: sp.csr_matrix
    C: sp.csr_matrix
    M: sp.csr_matrix
    where: dict[str, np.ndarray]
    place: np.ndarray


class Blocks:
    """Makes the :class:`Pencil` of states of one :class:`~rodfem.fem.system.System`.

    Attributes
    ----------
    rows, columns
        Global numbers of the unknowns and multipliers that are rows and columns, ascending.
    numbers
        Those of each field.
    """

    def __init__(self, system: System, *, norms: bool = True) -> None:
        """Number rows and columns, with the multipliers of the norms of quaternions or without."""
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()
        self.numbers: dict[str, np.ndarray] = {}
        self.where: dict[str, np.ndarray] = {}
        self.rows = self._numbered("ends", multiplier=False)
        self.columns = self._numbered("scalars", multiplier=True, left_out="" if norms else "eta")
        self.place = self._places()

    def _numbered(self, last: str, *, multiplier: bool, left_out: str = "") -> np.ndarray:
        """Global numbers of the unknowns, or multipliers, ascending; scalars are those of the name ``last``.

        The field of the name ``left_out`` is none of them.
        """
        f = self.system.fields
        names = [b.name for b in f.blocks if b.multiplier == multiplier and b.name != left_out]
        numbers = {name: np.unique(self.gathered(f.number[f.dofs[name]].ravel())) for name in names}
        numbers = {name: n[n >= 0] for name, n in numbers.items()}
        scalars = [f.scalars[x.name] for x in f.unknown_scalars if x.multiplier == multiplier]
        numbers[last] = np.array(scalars, dtype=int)
        out = np.sort(np.concatenate(list(numbers.values()))).astype(int)
        self.numbers |= numbers
        self.where |= {name: np.searchsorted(out, n) for name, n in numbers.items()}
        return out

    def gathered(self, own: np.ndarray) -> np.ndarray:
        """Rows of all ranks."""
        comm = self.system.comm
        return own if comm.size == 1 else np.concatenate(comm.allgather(own))

    def own(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Which of some global ``numbers`` are rows of this rank, and their places in its part of a vector."""
        begin, end = self.matrix.getOwnershipRange()
        mine = (numbers >= begin) & (numbers < end)
        return mine, numbers[mine] - begin

    def _places(self) -> np.ndarray:
        """Arclength of the middle of the first cell of each constraint, nan for a scalar force, (p,)."""
        f = self.system.fields
        place = np.full(len(self.columns), np.inf)
        for name in (b.name for b in f.blocks if b.multiplier):
            numbers = f.number[f.dofs[name]]
            middle = np.broadcast_to(f.vertices.mean(axis=1)[:, None, None], numbers.shape)
            mine = np.isin(numbers, self.columns)
            np.minimum.at(place, np.searchsorted(self.columns, numbers[mine]), middle[mine])
        place = np.min(self.system.comm.allgather(place), axis=0)
        place[np.isinf(place)] = np.nan
        return np.asarray(place)

    def assemble(self, x: PETSc.Vec, sizes: PETSc.Vec | None = None) -> Pencil:
        """Blocks at the state ``x``, in units of natural ``sizes`` of the unknowns if these are given."""
        assemble_pencil(self.system, x, self.matrix, self.mass)
        matrix, mass = self.matrix, self.mass
        if sizes is not None:
            matrix, mass = in_units(self.system, matrix, mass, sizes)
        S, M = (gathered(A).real[self.rows] for A in (matrix, mass))
        return Pencil(S[:, self.rows], S[:, self.columns], M[:, self.rows], dict(self.where), self.place)

"""A richer discretisation of a rod, and the interpolation of states and directions on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem import compat
from rodfem.fem.equations import Equations
from rodfem.fem.fields import HIGHEST, Discretization, Fields
from rodfem.fem.system import System


def halved(degree: int) -> float:
    """Largest part of the error of a smooth state on elements of ``degree`` that remains on halved elements."""
    return float(0.5 ** (degree + 1))


def richer(system: System) -> Discretization:
    """Halves of the elements of a system, of one degree more (but of the highest one)."""
    d = system.fields.discretization
    halves = replace(d, vertices=tuple(map(float, system.fields.all_vertices())))
    return halves.finer(2, richer=int(d.degree < HIGHEST))


def richer_system(system: System) -> System:
    """Return the system of the same rod that is :func:`richer`."""
    return System(system.scene, richer(system), system.comm, system.clock, symmetries=system.symmetries)


def compile_richer(system: System) -> None:
    """Begin to compile the forms of that in the background."""
    Equations.compile_ahead(Fields(system.scene, richer(system), system.comm))


class Transfer:
    """Interpolates vectors of one system to another whose elements are those of the first, or parts of them."""

    def __init__(self, source: System, target: System) -> None:
        """Tabulate the bases of the source at the nodes of the target."""
        self.source, self.target = source, target
        old, new = source.fields, target.fields
        vertices = old.all_vertices()
        self._owned = slice(0, old.owned_cells)
        self._order = np.argsort(np.concatenate(source.comm.allgather(old.vertices[self._owned, 0])))
        self._parents = np.searchsorted(vertices, new.vertices.mean(axis=1)) - 1
        first, size = vertices[self._parents, None], np.diff(vertices)[self._parents, None]
        places, which = np.unique(np.round((new.vertices - first) / size, 9), axis=0, return_inverse=True)
        self._members = [np.flatnonzero(which.ravel() == i) for i in range(len(places))]
        degrees = {b.name: b.degree for b in old.blocks}
        self._bases = {
            b.name: [compat.lagrange_basis(degrees[b.name], a + (z - a) * compat.nodes(b.degree)) for a, z in places]
            for b in new.blocks
        }

    def __call__(self, vector: PETSc.Vec, *, state: bool) -> PETSc.Vec:
        """Interpolate a state, or (``state=False``) a direction, which is zero where a state is clamped."""
        old, new = self.source.fields, self.target.fields
        values = (self.source.at(vector) if state else self.source.change(vector)).local
        out = np.zeros(len(new.number))
        for name, bases in self._bases.items():
            every = np.concatenate(self.source.comm.allgather(values[old.dofs[name][self._owned]]))[self._order]
            for members, basis in zip(self._members, bases, strict=True):
                out[new.dofs[name][members]] = np.einsum("pn,cni->cpi", basis, every[self._parents[members]])
        out[new.copies] = values[old.copies[0]]
        return self.target.vector(out)

r"""The singular pencil of a state, Kumar & Healey (2010), (21), in given coordinates.

The pencil ``(K C; C^t 0) x = mu (M 0; 0 0) x`` of :mod:`rodfem.stability.pencil` in three sets of coordinates:

* ``full``: the unknowns as they are, four components of ``q`` at each node and the multiplier ``eta`` of its norm;
* ``tangent``: a spin ``theta`` in the space frame at each node, ``dq = 1/2 theta q``.  The sparse map ``T`` takes it to
  the full coordinates and fulfils the collocated norm conditions, ``C_eta^t T = 0``, so that ``eta`` goes with them.
  The blocks are ``T^t K T``, ``T^t C``, ``T^t M T``.  ``K`` contains ``eta`` times the second derivative of the norm
  condition: at an equilibrium ``T^t K T`` is then the second derivative of the energy along
  ``exp(eps theta / 2) q`` (see :mod:`rodfem.forms.paper`), without it, it is not;
* ``compatible``: tangent coordinates, and the free strains follow from the motion through the kinematics ``r' = R v``
  (pointwise formulation only).  In each cell the gradients of its constraints in its own strains are a block ``C_v`` of
  full column rank; ``dv = -(C_v^t)^+ C_u^t (theta, dr)`` and an orthonormal ``N`` with ``C_v N = 0`` leave ``C_u N``.

A ring is closed by ``q(l) = +-q(0)``.  The norms being fulfilled, three of these four equations are independent: in
tangent and compatible coordinates those across ``q(0)``, one in the plane.

Sizes for linear elements are those of ``docs/paper.md``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fem.state import State
from rodfem.fem.system import System
from rodfem.linalg.matrices import block_matrix
from rodfem.problem.ends import CLOSING_MOMENT
from rodfem.stability.pencil import Blocks, Pencil, symmetry_modes, weighed_modes


@dataclass(frozen=True)
class MappedPencil(Pencil):
    """A pencil in coordinates that ``T`` maps to the full ones; rows of spins are ``where["theta"]``."""

    T: sp.csr_matrix
    symmetric: bool

    def mapped(self, T: sp.csr_matrix, where: dict[str, np.ndarray]) -> MappedPencil:
        """The same in coordinates that ``T`` maps to these, with the fields at other rows."""
        K, M = ((T.T @ A @ T).tocsr() for A in (self.K, self.M))
        return replace(self, K=K, C=(T.T @ self.C).tocsr(), M=M, where=where, T=self.T @ T)


class Coordinates:
    """Makes the :class:`MappedPencil` of states of one system in one set of coordinates, and vectors of the system."""

    def __init__(self, system: System, coordinates: str = "tangent") -> None:
        """Number rows and columns; ``coordinates`` are ``full``, ``tangent`` or, with a centreline, ``compatible``."""
        self.system, self.coordinates = system, coordinates
        self.blocks = Blocks(system, norms=coordinates == "full")
        f = system.fields
        self._dofs = f.dofs["q"].reshape(-1, 4) if "q" in f.dofs else np.zeros((0, 4), dtype=int)
        every = self.system.whole(f.number[self._dofs])
        first, chosen = np.unique(every[:, 0], return_index=True)
        self._nodes = chosen[first >= 0]
        self.quaternions = every[self._nodes]  # global numbers of the components of q at each free node
        self._quads = np.searchsorted(self.blocks.rows, self.quaternions)
        self._map = sp.csr_matrix((0, 0))

    def assemble(self, x: PETSc.Vec, *, scaled: bool = False) -> MappedPencil:
        """Blocks at the state ``x``; ``scaled``: in units of natural sizes."""
        p, state = self.blocks.assemble(x, scaled=scaled), self.system.at(x)
        one = sp.identity(len(self.blocks.rows), format="csr")
        out = MappedPencil(p.K, p.C, p.M, p.where, p.place, one, self.system.scene.conservative)
        if self.coordinates != "full":
            out = self._tangent(out, state)
        if self.coordinates == "compatible" and "v" in out.where:
            out = self._compatible(out)
        self._map = out.T
        return out

    def without_modes(self, x: PETSc.Vec) -> MappedPencil:
        """The same in natural units, with a constraint ``g.Mx = 0`` more for each symmetry mode ``g``."""
        modes = symmetry_modes(self.system, x)
        pencil, images = self.assemble(x, scaled=True), []
        if not modes:
            return pencil
        for _, weighed in weighed_modes(self.system, modes, self.blocks.mass).values():
            if not self.system.scene.units.ordinary:
                weighed.pointwiseMult(weighed, self.blocks.sizes)
                weighed.scale(1.0 / weighed.norm())
            images.append(pencil.T.T @ self.system.whole(weighed.array_r.real)[self.blocks.rows])
        C = sp.hstack([pencil.C, np.stack(images, axis=1)]).tocsr()
        return replace(pencil, C=C, place=np.append(pencil.place, np.full(len(modes), np.nan)))

    def lift(self, vectors: np.ndarray) -> list[PETSc.Vec]:
        """Vectors of the system from columns in the coordinates of the last pencil, in natural units."""
        mine, places = self.blocks.own(self.blocks.rows)
        out = []
        for column in (self._map @ vectors)[mine].T:
            vector = self.system.new_vector()
            vector.array[places] = column
            if not self.system.scene.units.ordinary:
                vector.pointwiseMult(vector, self.blocks.sizes)
            out.append(vector)
        return out

    def _tangent(self, full: MappedPencil, state: State) -> MappedPencil:
        """A spin at each node in the place of its quaternion; that of a planar rod is one already."""
        where, count = dict(full.where), len(self.blocks.rows)
        if "angle" in where:
            where["theta"] = where.pop("angle")
            return replace(full, where=where)
        kept = np.delete(np.arange(count), self._quads[:, 0])
        where |= {name: np.searchsorted(kept, where[name]) for name in {"v", "r", "ends"} & set(where)}
        where["theta"] = np.searchsorted(kept, np.sort(self._quads[:, 1:].ravel()))
        del where["q"]
        pencil = full.mapped(self._spins(state)[:, kept], where)
        return self._closed(pencil, state) if self.system.scene.closed else pencil

    def _spins(self, state: State) -> sp.csr_matrix:
        """Square matrix with columns of a spin in the places of q1, q2, q3, and one for each other unknown."""
        quads, count = self._quads, len(self.blocks.rows)
        a, b, c, d = self.system.whole(state.local[self._dofs])[self._nodes].T / 2
        values = np.array([[-b, -c, -d], [a, d, -c], [-d, a, b], [c, -b, a]])  # of 1/2 (0, theta) q
        same = np.ones(count)
        same[quads.ravel()] = 0.0
        spins = block_matrix(np.moveaxis(values, 2, 0), quads, quads[:, 1:], (count, count))
        return (sp.diags(same) + spins).tocsr()

    def _closed(self, pencil: MappedPencil, state: State) -> MappedPencil:
        """Keep of the equations that close a ring's rotation the combinations across the quaternion at its end."""
        f, count = self.system.fields, len(self.blocks.columns)
        end = np.isclose(f.coordinates(f.discretization.degree), self.system.scene.interval[1])
        q = self.system.whole(state.values("q")[end])[0]
        closing = {f.scalars[x.name]: x.component for x in f.unknown_scalars if x.group == CLOSING_MOMENT}
        columns = np.searchsorted(self.blocks.columns, np.array(list(closing), dtype=int))
        across = np.linalg.svd(q[list(closing.values())][None])[2][1:].T
        kept = np.delete(np.arange(count), columns[-1:])
        chosen = sp.identity(count, format="lil")[:, kept]
        if len(columns):
            chosen[np.ix_(columns, np.searchsorted(kept, columns[:-1]))] = across
        where = dict(pencil.where)
        for name in {"scalars", *(b.name for b in f.blocks if b.multiplier)} & set(where):
            where[name] = np.searchsorted(kept, where[name][np.isin(where[name], kept)])
        return replace(pencil, C=(pencil.C @ chosen).tocsr(), where=where, place=pencil.place[kept])

    def _compatible(self, pencil: MappedPencil) -> MappedPencil:
        """Let the strains of ``pencil`` (tangent coordinates) follow from the motion."""
        f, blocks = self.system.fields, self.blocks
        cells = [f.number[f.dofs[name][: f.owned_cells]].reshape(f.owned_cells, -1) for name in ("v", "n")]
        rows, columns = (
            pencil.where[name][np.searchsorted(blocks.numbers[name], self.system.whole(own))]
            for name, own in zip(("v", "n"), cells, strict=True)
        )
        middle = self.system.whole(f.vertices[: f.owned_cells].mean(axis=1))
        (n, a), b, (m, p) = rows.shape, columns.shape[1], pencil.C.shape
        C_v = pencil.C[rows.ravel()][:, columns.ravel()]  # block diagonal
        C_v.eliminate_zeros()
        Q, R = np.linalg.qr(np.swapaxes(C_v.tobsr((a, b)).data, 1, 2), mode="complete")
        E = -np.linalg.solve(R[:, :a, :], np.swapaxes(Q[:, :, :a], 1, 2))
        kept = np.delete(np.arange(m), rows.ravel())
        rest = np.arange(n * (b - a)).reshape(n, b - a)
        select, N = sp.identity(m, format="csr")[:, kept], block_matrix(Q[:, :, a:], columns, rest, (p, rest.size))
        T = block_matrix(E, rows, columns, (m, p)) @ (pencil.C.T @ select) + select
        where = {name: np.searchsorted(kept, pencil.where[name]) for name in ("theta", "r", "ends")}
        out = pencil.mapped(T.tocsr(), where | {"n": rest.ravel()})
        return replace(out, C=(out.C @ N).tocsr(), place=np.repeat(middle, b - a))

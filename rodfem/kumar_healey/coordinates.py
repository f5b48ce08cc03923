r"""The singular pencil of a state, Kumar & Healey (2010), (21), in given coordinates.

The pencil ``(K C; C^t 0) x = mu (M 0; 0 0) x`` of :mod:`rodfem.stability.blocks` in three sets of coordinates:

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

Sizes for ``N`` elements of degree ``d``, ``f`` free strains, one end clamped (``e = 1``) or both (``e = 2``), ``h``
held components of the centreline's ends, ``g`` scalar contact forces (reduced formulation):

    coordinates              rows of K and C                                 columns of C
    full, pointwise          4 (dN + 1 - e) + f dN + 3 (dN + 1) - h          dN + 1 - e + 3 dN
    full, reduced            4 (dN + 1 - e) + f dN                           dN + 1 - e + g
    tangent, pointwise       3 (dN + 1 - e) + f dN + 3 (dN + 1) - h          3 dN
    tangent, reduced         3 (dN + 1 - e) + f dN                           g
    compatible, pointwise    3 (dN + 1 - e) + 3 (dN + 1) - h                 (3 - f) dN

For ``d = 1`` these are the sizes of the paper with ``n = N`` but for what discontinuous fields change.
Cord: ``(6n - 5) x (6n - 5)`` and ``3n`` columns.  A continuous multiplier has ``3n + 3`` components less the known
``n3`` at the end, ``3n + 2``; a discontinuous one has three in each cell, and dead forces enter the load instead.
Hemitropic, compatible: ``6 (n - 1)`` and ``2n`` columns.  Hemitropic, reduced: ``4n - 3`` rows and 3 columns, where a
continuous stretch would have one value more, ``4n - 2``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.errors import POINTWISE, InputError
from rodfem.fem.state import State
from rodfem.fem.system import System
from rodfem.linalg.matrices import block_matrix, first_of, gathered, local_rows, petsc_matrix
from rodfem.problem.ring import CLOSING_MOMENT
from rodfem.stability.blocks import Blocks, Pencil
from rodfem.stability.pencil import symmetry_modes, weighed_modes

COORDINATES = ("full", "tangent", "compatible")


@dataclass(frozen=True)
class MappedPencil(Pencil):
    """A pencil in coordinates that ``T`` (full m, m) maps to the full ones; None if they are these.

    It is ``symmetric`` but under a follower load.  The rows of spins are ``where["theta"]``.
    """

    T: PETSc.Mat | None
    symmetric: bool


class Coordinates:
    """Makes the :class:`MappedPencil` of states of one system in one set of coordinates, and vectors of the system.

    ``quaternions`` (nodes, 4) are the global numbers of the components of ``q`` at each of this rank's free nodes.
    """

    def __init__(self, system: System, coordinates: str = "tangent") -> None:
        """Number rows and columns; raises :class:`InputError` for coordinates that the formulation does not have."""
        if coordinates not in COORDINATES:
            raise InputError(f"Unknown coordinates {coordinates!r}: choose one of {', '.join(COORDINATES)}.")
        if coordinates == "compatible" and not system.fields.formulation.centreline:
            raise InputError("Compatible coordinates need the centreline", POINTWISE)
        self.system, self.coordinates = system, coordinates
        self.blocks = Blocks(system, norms=coordinates == "full")
        f = system.fields
        dofs = f.dofs["q"].reshape(-1, 4) if "q" in f.dofs else np.zeros((0, 4), dtype=int)
        first = f.number[dofs[:, 0]]
        mine = np.flatnonzero((first >= f.offset) & (first < f.offset + len(f.free_owned)))
        self._dofs = dofs[mine[np.unique(first[mine], return_index=True)[1]]]
        self.quaternions = f.number[self._dofs]
        self._quads = np.searchsorted(self.blocks.rows, self.quaternions)
        self._map: sp.csr_matrix | None = None

    def assemble(self, x: PETSc.Vec, sizes: PETSc.Vec | None = None) -> MappedPencil:
        """Blocks at the state ``x``, in units of natural ``sizes`` of the unknowns if these are given."""
        p, state = self.blocks.assemble(x, sizes), self.system.at(x)
        full = MappedPencil(p.K, p.C, p.M, p.where, p.place, None, self.system.scene.conservative)
        out = full if self.coordinates == "full" else self._tangent(full, state)
        if self.coordinates == "compatible" and "v" in out.where:
            out = self._compatible(out)
        self._map = gathered(out.T) if out.T is not None else None
        return out

    def without_modes(self, x: PETSc.Vec, sizes: PETSc.Vec) -> MappedPencil:
        """The same with a constraint ``g.Mx = 0`` more for each symmetry mode ``g``, in units of natural ``sizes``."""
        modes, comm = symmetry_modes(self.system, x), self.system.comm
        units = None if self.system.scene.units.ordinary else sizes
        pencil, images = self.assemble(x, units), []
        if not modes:
            return pencil
        for _, weighed in weighed_modes(self.system, modes, self.blocks.mass).values():
            if units is not None:
                weighed.pointwiseMult(weighed, units)
                weighed.scale(1.0 / weighed.norm())
            full = weighed.array_r[self.blocks.rows - self.system.fields.offset].copy()
            image = PETSc.Vec().createWithArray(full, comm=comm)
            if pencil.T is not None:
                image, product = pencil.T.createVecRight(), image
                pencil.T.multTranspose(product, image)
            images.append(image.array_r.copy())
        last = comm.rank == comm.size - 1
        local = sp.hstack([local_rows(pencil.C), np.stack(images, axis=1)]).tocsr()
        local.sort_indices()
        rows, columns = pencil.C.getLocalSize()
        size = ((rows, PETSc.DETERMINE), (columns + len(modes) * last, PETSc.DETERMINE))
        csr = (local.indptr.astype(PETSc.IntType), local.indices.astype(PETSc.IntType), local.data)
        C = PETSc.Mat().createAIJ(size, csr=csr, comm=comm)
        return replace(pencil, C=C, place=np.append(pencil.place, np.full(len(modes), np.nan)))

    def lift(self, vectors: np.ndarray, sizes: PETSc.Vec) -> list[PETSc.Vec]:
        """Vectors of the system from columns in the coordinates of the last pencil, in units of natural ``sizes``."""
        full: np.ndarray = vectors if self._map is None else self._map @ vectors
        rows, first, out = self.blocks.rows, first_of(self.system.comm, len(self.blocks.rows)), []
        for column in full.T:
            vector = self.system.new_vector()
            vector.array[rows - self.system.fields.offset] = column[first : first + len(rows)]
            vector.assemble()
            if not self.system.scene.units.ordinary:
                vector.pointwiseMult(vector, sizes)
            out.append(vector)
        return out

    # --- maps --------------------------------------------------------------------------------------------------

    def _tangent(self, full: MappedPencil, state: State) -> MappedPencil:
        """A spin at each node in the place of its quaternion; that of a planar rod is one already."""
        where = dict(full.where)
        if "angle" in where:
            where["theta"] = where.pop("angle")
            return replace(full, where=where)
        T, count = self._spins(state), len(self.blocks.rows)
        kept = np.delete(np.arange(count), self._quads[:, 0])
        before, after = (first_of(self.system.comm, n) for n in (count, len(kept)))
        spins = np.zeros(count, dtype=bool)
        spins[self._quads[:, 1:].ravel()] = True
        for name in {"v", "r", "ends"} & set(where):
            where[name] = np.searchsorted(kept, where[name] - before) + after
        where["theta"] = np.flatnonzero(spins[kept]) + after
        del where["q"]
        K, C, M = full.K.ptap(T), T.transposeMatMult(full.C), full.M.ptap(T)
        pencil = MappedPencil(K, C, M, where, full.place, T, full.symmetric)
        return self._closed(pencil, state) if self.system.scene.closed else pencil

    def _spins(self, state: State) -> PETSc.Mat:
        """``T``: columns of a spin in the places of q1, q2, q3, and one for each strain and centreline unknown."""
        quads, count = self._quads, len(self.blocks.rows)
        a, b, c, d = state.local[self._dofs].T / 2
        values = np.array([[-b, -c, -d], [a, d, -c], [-d, a, b], [c, -b, a]])  # of 1/2 (0, theta) q
        same = np.ones(count)
        same[quads.ravel()] = 0.0
        spins = block_matrix(np.moveaxis(values, 2, 0), quads, quads[:, 1:], (count, count))
        full = (sp.diags(same) + spins).tocsr()
        return petsc_matrix(self.system.comm, full[:, np.delete(np.arange(count), quads[:, 0])])

    def _closed(self, pencil: MappedPencil, state: State) -> MappedPencil:
        """Keep of the equations that close a ring's rotation the combinations across the quaternion at its start."""
        f, comm, count = self.system.fields, self.system.comm, len(self.blocks.columns)
        start = np.isclose(f.coordinates(f.discretization.degree), self.system.scene.interval[0])
        q = np.concatenate(comm.allgather(state.values("q")[start]))[0]
        closing = {f.scalars[x.name]: x.component for x in f.unknown_scalars if x.group == CLOSING_MOMENT}
        mine = list(closing) if self.system.has_scalars else []
        columns = np.searchsorted(self.blocks.columns, np.array(mine, dtype=int))
        across = np.linalg.svd(q[list(closing.values())][None])[2][1:].T
        kept = np.delete(np.arange(count), columns[-1:])
        chosen = sp.identity(count, format="lil")[:, kept]
        if len(columns):
            chosen[np.ix_(columns, np.searchsorted(kept, columns[:-1]))] = across
        first, begin = pencil.C.getOwnershipRangeColumn()[0], first_of(comm, len(kept))
        where = dict(pencil.where)
        for name in {"scalars", *(b.name for b in f.blocks if b.multiplier)} & set(where):
            own = where[name] - first
            where[name] = np.searchsorted(kept, own[np.isin(own, kept)]) + begin
        place = np.delete(pencil.place, np.concatenate(comm.allgather(columns[-1:] + first)))
        return replace(pencil, C=pencil.C.matMult(petsc_matrix(comm, chosen)), where=where, place=place)

    def _compatible(self, pencil: MappedPencil) -> MappedPencil:
        """Let the strains of ``pencil`` (tangent coordinates) follow from the motion."""
        f, comm = self.system.fields, self.system.comm
        first_row, first_column = pencil.C.getOwnershipRange()[0], pencil.C.getOwnershipRangeColumn()[0]
        rows, columns = (
            pencil.where[name][np.searchsorted(self.blocks.owned(name), f.number[f.dofs[name][: f.owned_cells]])]
            .reshape(f.owned_cells, -1) - first
            for name, first in (("v", first_row), ("n", first_column))
        )  # fmt: skip
        C_v = local_rows(pencil.C)[rows.ravel()][:, columns.ravel() + first_column]
        C_v.eliminate_zeros()
        (cells, a), b = rows.shape, columns.shape[1]
        blocks = C_v.tobsr((a, b)).data  # in the order of the cells: other blocks are zero
        Q, R = np.linalg.qr(np.swapaxes(blocks, 1, 2), mode="complete")
        E = -np.linalg.solve(R[:, :a, :], np.swapaxes(Q[:, :, :a], 1, 2))
        m, p = pencil.C.getLocalSize()
        kept = np.delete(np.arange(m), rows.ravel())
        rest = np.arange(cells * (b - a)).reshape(cells, b - a)
        follow = petsc_matrix(comm, block_matrix(E, rows, columns, (m, p)))
        select = petsc_matrix(comm, sp.identity(m, format="csr")[:, kept])
        N = petsc_matrix(comm, block_matrix(Q[:, :, a:], columns, rest, (p, rest.size)))
        T = follow.matMult(pencil.C.transposeMatMult(select))
        T.axpy(1.0, select, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        begin = first_of(comm, len(kept))
        where = {name: np.searchsorted(kept, pencil.where[name] - first_row) + begin for name in ("theta", "r", "ends")}
        where["n"] = rest.ravel() + first_of(comm, rest.size)
        place = np.concatenate(comm.allgather(np.repeat(f.vertices[:cells].mean(axis=1), b - a)))
        K, C, M = pencil.K.ptap(T), T.transposeMatMult(pencil.C).matMult(N), pencil.M.ptap(T)
        whole = pencil.T.matMult(T) if pencil.T is not None else T
        return MappedPencil(K, C, M, where, place, whole, pencil.symmetric)

r"""The pencil of a state as named blocks, in given coordinates.

The eigenproblem of a state is the singular pencil ``(K C; C^t 0) x = mu (M 0; 0 0) x``.  ``K`` (m, m) is the second
derivative of the whole Lagrangian in rotation, strain and centreline, ``C`` (m, p) its derivative in those and the
multipliers (each column the gradient of one constraint), ``M`` (m, m) the kinetic metric.  Three sets of coordinates:

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

For ``d = 1`` these are the sizes of Kumar & Healey (2010) with ``n = N`` but for what discontinuous fields change.
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
from rodfem.linalg.matrices import block_matrix, first_of, local_rows, petsc_matrix
from rodfem.problem.ring import CLOSING_MOMENT
from rodfem.stability.pencil import assemble_pencil, in_units

COORDINATES = ("full", "tangent", "compatible")


@dataclass(frozen=True)
class Pencil:
    """Blocks ``K`` (m, m), ``C`` (m, p), ``M`` (m, m) of a state.

    Attributes
    ----------
    T
        Map from these coordinates to the full ones, (full m, m); None if they are the full ones.
    where
        For each field this rank's global rows in ``K`` and ``C`` (``theta``, ``q``, ``v``, ``r``, ``ends``: positions
        of ends that move), or columns of ``C`` (``eta``, ``n``, ``p0``.. and ``scalars``: components of a constant
        contact force, moments at ends, multipliers of integral constraints, in the order of the fields' scalars).
    place
        Arclength (the middle of a cell) by which the constraints of all ranks are in order along the rod, (p,); nan for
        one that involves the whole rod.
    symmetric
        Whether ``K`` is: not under a follower load.
    """

    K: PETSc.Mat
    C: PETSc.Mat
    M: PETSc.Mat
    T: PETSc.Mat | None
    where: dict[str, np.ndarray]
    place: np.ndarray
    symmetric: bool

    def block(self, matrix: str, row: str, column: str) -> PETSc.Mat:
        """Part of ``K``, ``C`` or ``M`` that couples two fields, for example ``block("C", "theta", "n")``."""
        comm = self.K.comm
        sets = [PETSc.IS().createGeneral(self.where[name].astype(PETSc.IntType), comm=comm) for name in (row, column)]
        return getattr(self, matrix).createSubMatrix(*sets)


class Blocks:
    """Makes the :class:`Pencil` of states of one :class:`~rodfem.fem.system.System`, in one set of coordinates.

    Attributes
    ----------
    rows, columns
        Global numbers of this rank's unknowns and multipliers that are rows and columns in full coordinates, ascending.
    quaternions
        Global numbers of the four components of ``q`` at each of this rank's free nodes, (nodes, 4).
    """

    def __init__(self, system: System, coordinates: str = "tangent") -> None:
        """Number rows and columns; raises :class:`InputError` for coordinates that the formulation does not have."""
        if coordinates not in COORDINATES:
            raise InputError(f"Unknown coordinates {coordinates!r}: choose one of {', '.join(COORDINATES)}.")
        if coordinates == "compatible" and not system.fields.formulation.centreline:
            raise InputError("Compatible coordinates need the centreline", POINTWISE)
        self.system, self.coordinates = system, coordinates
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()
        fields = system.fields
        primal = {b.name: self._owned(b.name) for b in fields.blocks if not b.multiplier}
        dual = {b.name: self._owned(b.name) for b in fields.blocks if b.multiplier}
        for numbers, multiplier in ((primal, False), (dual, True)):
            scalars = [fields.scalars[x.name] for x in fields.unknown_scalars if x.multiplier == multiplier]
            numbers["scalars" if multiplier else "ends"] = np.array(scalars if system.has_scalars else [], dtype=int)
        if coordinates != "full" and "eta" in dual:
            del dual["eta"]
        self.rows, self.columns = (np.sort(np.concatenate(list(d.values()))) for d in (primal, dual))
        self._numbers = primal | dual
        self._first_row, self._first_column = (first_of(system.comm, len(x)) for x in (self.rows, self.columns))
        self._find_quaternions()
        self.place = self._places()

    def assemble(self, x: PETSc.Vec, sizes: PETSc.Vec | None = None) -> Pencil:
        """Blocks at the state ``x``, in units of natural ``sizes`` of the unknowns if these are given."""
        comm = self.system.comm
        state = assemble_pencil(self.system, x, self.matrix, self.mass)
        matrix, mass = self.matrix, self.mass
        if sizes is not None:
            matrix, mass = in_units(self.system, matrix, mass, sizes)
        rows, columns = (
            PETSc.IS().createGeneral(n.astype(PETSc.IntType), comm=comm) for n in (self.rows, self.columns)
        )
        K, C = matrix.createSubMatrix(rows, rows), matrix.createSubMatrix(rows, columns)
        M = mass.createSubMatrix(rows, rows)
        symmetric = self.system.scene.conservative
        where = {
            name: np.searchsorted(self.rows, n) + self._first_row
            if np.isin(n, self.rows).all()
            else np.searchsorted(self.columns, n) + self._first_column
            for name, n in self._numbers.items()
        }
        full = Pencil(K, C, M, None, where, self.place, symmetric)
        if self.coordinates == "full":
            return full
        if "angle" in where:  # a spin about the normal already
            where["theta"] = where.pop("angle")
            return full if self.coordinates == "tangent" or "v" not in where else self._compatible(full)
        T = self._tangent_map(state)
        spins = np.zeros(len(self.rows), dtype=bool)
        spins[self._quads[:, 1:].ravel()] = True
        kept = np.delete(np.arange(len(self.rows)), self._quads[:, 0])
        first = first_of(comm, len(kept))
        where |= {
            name: np.searchsorted(kept, where[name] - self._first_row) + first
            for name in ("v", "r", "ends")
            if name in where
        }
        where["theta"] = np.flatnonzero(spins[kept]) + first
        del where["q"]
        pencil = Pencil(K.ptap(T), T.transposeMatMult(C), M.ptap(T), T, where, self.place, symmetric)
        if self.system.scene.closed:
            pencil = self._closed(pencil, state)
        if self.coordinates == "tangent" or "v" not in where:
            return pencil
        return self._compatible(pencil)

    # --- numbering ---------------------------------------------------------------------------------------------

    def _owned(self, name: str) -> np.ndarray:
        """Global numbers of this rank's free unknowns of a field, ascending."""
        f = self.system.fields
        numbers = np.unique(f.number[f.dofs[name]])
        return numbers[(numbers >= f.offset) & (numbers < f.offset + len(f.free_owned))].astype(int)

    def _find_quaternions(self) -> None:
        """Positions in ``rows`` of the four components of each free quaternion (nodes, 4), and their local dofs."""
        f = self.system.fields
        dofs = f.dofs["q"].reshape(-1, 4) if "q" in f.dofs else np.zeros((0, 4), dtype=int)
        first = f.number[dofs[:, 0]]
        mine = np.flatnonzero((first >= f.offset) & (first < f.offset + len(f.free_owned)))
        mine = mine[np.unique(first[mine], return_index=True)[1]]
        self._dofs = dofs[mine]
        self.quaternions = f.number[self._dofs]
        self._quads = np.searchsorted(self.rows, self.quaternions)

    def _places(self) -> np.ndarray:
        """Arclength of the middle of the first cell of each constraint, nan for a scalar force; of all ranks, (p,)."""
        f = self.system.fields
        place = np.full(len(self.columns), np.inf)
        for name in (b.name for b in f.blocks if b.multiplier):
            numbers = f.number[f.dofs[name]]
            middle = np.broadcast_to(f.vertices.mean(axis=1)[:, None, None], numbers.shape)
            mine = np.isin(numbers, self.columns)
            np.minimum.at(place, np.searchsorted(self.columns, numbers[mine]), middle[mine])
        place[np.isinf(place)] = np.nan
        return np.concatenate(self.system.comm.allgather(place))

    # --- maps --------------------------------------------------------------------------------------------------

    def _tangent_map(self, state: State) -> PETSc.Mat:
        """``T``: columns of a spin in the places of q1, q2, q3, and one for each strain and centreline unknown."""
        quads = self._quads
        a, b, c, d = state.local[self._dofs].T / 2
        values = np.array([[-b, -c, -d], [a, d, -c], [-d, a, b], [c, -b, a]])  # of 1/2 (0, theta) q
        rows = np.broadcast_to(quads.T[:, None, :], values.shape)
        columns = np.broadcast_to(quads.T[None, 1:, :], values.shape)
        same = np.setdiff1d(np.arange(len(self.rows)), quads)
        full = sp.csr_matrix(
            (
                np.append(values.ravel(), np.ones(len(same))),
                (np.append(rows.ravel(), same), np.append(columns.ravel(), same)),
            ),
            shape=(len(self.rows),) * 2,
        )
        return petsc_matrix(self.system.comm, full[:, np.delete(np.arange(len(self.rows)), quads[:, 0])])

    def _closed(self, pencil: Pencil, state: State) -> Pencil:
        """Keep of the equations that close a ring's rotation the combinations across the quaternion at its start."""
        f, comm = self.system.fields, self.system.comm
        start = np.isclose(f.coordinates(self.system.fields.discretization.degree), self.system.scene.interval[0])
        here = state.values("q")[start]
        q = next(part[0] for part in comm.allgather(here) if len(part))
        closing = [x for x in f.unknown_scalars if x.group == CLOSING_MOMENT]
        scalars = np.array([f.scalars[x.name] for x in closing] if self.system.has_scalars else [], dtype=int)
        columns = np.searchsorted(self.columns, scalars)
        across = np.linalg.svd(q[[x.component for x in closing]][None])[2][1:].T if len(columns) else np.zeros((0, 0))
        kept = np.delete(np.arange(len(self.columns)), columns[-1:])
        chosen = sp.identity(len(self.columns), format="lil")[:, kept]
        if len(columns):
            chosen[np.ix_(columns, np.searchsorted(kept, columns[:-1]))] = across
        first, begin = pencil.C.getOwnershipRangeColumn()[0], first_of(comm, len(kept))
        where = dict(pencil.where)
        for name in ("scalars", *(b.name for b in f.blocks if b.multiplier)):
            if name in where:
                own = where[name] - first
                where[name] = np.searchsorted(kept, own[np.isin(own, kept)]) + begin
        every = np.concatenate(comm.allgather(columns[-1:] + first))
        place = np.delete(self.place, every)
        return replace(pencil, C=pencil.C.matMult(petsc_matrix(comm, chosen)), where=where, place=place)

    def _compatible(self, pencil: Pencil) -> Pencil:
        """Let the strains of ``pencil`` (tangent coordinates) follow from the motion."""
        f, comm = self.system.fields, self.system.comm
        first_row, first_column = pencil.C.getOwnershipRange()[0], pencil.C.getOwnershipRangeColumn()[0]
        strain, force = (
            np.searchsorted(np.sort(self._numbers[name]), f.number[f.dofs[name][: f.owned_cells]])
            for name in ("v", "n")
        )
        rows = pencil.where["v"][strain.reshape(f.owned_cells, -1)] - first_row
        columns = pencil.where["n"][force.reshape(f.owned_cells, -1)] - first_column
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
        middle = np.repeat(f.vertices[:cells].mean(axis=1), b - a)
        return Pencil(
            pencil.K.ptap(T),
            T.transposeMatMult(pencil.C).matMult(N),
            pencil.M.ptap(T),
            pencil.T.matMult(T) if pencil.T is not None else T,
            where,
            np.concatenate(comm.allgather(middle)),
            pencil.symmetric,
        )

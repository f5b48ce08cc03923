"""Assembly on one rank: element tensors by FFCx's kernels, added up by compiled code (``assembly.c``).

dolfinx looks up the place of each entry in the matrix anew, and packs constants and coefficients, at every call.  A rod
is assembled thousands of times with one mesh: here all places are known beforehand.  Several ranks assemble vectors in
the same way, and matrices by dolfinx.  Matrices are made here, with the sparsity of the bordered system.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem import compat
from rodfem.linalg.compiled import Memory, addresses, buffer, module
from rodfem.linalg.matrices import bordered, matrix_of

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields
    from rodfem.fem.known import TableFunctions


FUNCTIONS = ("unknown", "y", "w", "v", "m")
"""Names of functions that compiled forms read: the unknown, and changes of it."""
ONE_CELL = "A term at a point inside the rod must be evaluated in one of the two cells there."


class Places:
    """Where the entries of element tensors are in a vector, or among the values of a sparse matrix; -1 for none."""

    def __init__(self, rows: np.ndarray, kinds: np.ndarray | None = None, columns: np.ndarray | None = None) -> None:
        ffi = module("fem/assembly").ffi
        self._memory = Memory(ffi)
        self.pointer = ffi.new("Places *", {"kinds": 0 if columns is None else columns.shape[1]})
        given = {"row": rows, "kind": kinds, "column": columns}
        arrays = {name: np.ascontiguousarray(x, dtype=np.int32) for name, x in given.items() if x is not None}
        self._memory.point(self.pointer, **arrays)


def matrix_places(dofs: np.ndarray, rows: np.ndarray, columns: np.ndarray, pattern: sp.csr_matrix) -> Places:
    """Places of a matrix with a ``pattern``, whose indices are sorted.

    ``rows`` and ``columns`` (local size,) are the numbers of its rows and columns at the degrees of freedom, -1 for
    none; ``dofs`` (cells, n) are those of each cell.  Entries that the pattern does not have are left out: they are 0.
    """
    code = module("fem/assembly")
    row, free = rows[dofs], rows[dofs] >= 0
    # rows with the same pattern have the same sum of random numbers, which differ
    sums = np.where(free, (pattern @ np.random.default_rng(1).random(pattern.shape[1]))[row], -1.0)
    order = np.argsort(sums, axis=1)
    changes = np.diff(np.take_along_axis(sums, order, axis=1), axis=1, prepend=-2.0) != 0
    ranked = np.cumsum(changes, axis=1) - 1
    kinds = np.empty_like(ranked)
    np.put_along_axis(kinds, order, ranked, axis=1)
    of_kind = np.full((len(dofs), int(ranked.max(initial=0)) + 1), -1, dtype=np.int32)
    np.put_along_axis(of_kind, kinds, row, axis=1)
    found = np.empty((*of_kind.shape, dofs.shape[1]), dtype=np.int32)
    given = (np.ascontiguousarray(x, dtype=np.int32) for x in (of_kind, columns[dofs], pattern.indptr, pattern.indices))
    code.lib.offsets(*found.shape, *(buffer(code.ffi, x) for x in (*given, found)))
    return Places(np.where(free, pattern.indptr[row], -1), kinds, found)


@dataclass(frozen=True)
class Cells:
    """Cells of a mesh: coordinates of their vertices (cells, 2, 3), and local degrees of freedom (cells, n)."""

    x: np.ndarray
    dofs: np.ndarray

    @classmethod
    def of(cls, fields: Fields) -> Cells:
        """Those of ``fields`` on this rank, ghosts last."""
        count = len(fields.vertices)
        x, dofs = compat.cell_coordinates(fields.mesh, count), compat.cell_dofs(fields.space, count)
        return cls(np.ascontiguousarray(x, dtype=float), np.ascontiguousarray(dofs, dtype=np.int32))


class Assembler:
    """A compiled ``form`` whose coefficients, where it has some, are the unknown and what is ``known`` otherwise.

    It is assembled on the ``cells`` of this rank, or with ``inside`` its integrals over any ``cells``; ``load`` is the
    local degree of freedom of the load.  ``constants`` are those of the form, as :meth:`pack_constants` found them;
    ``pointer`` and ``functions`` are the form, and the addresses of what assembles it and multiplies with it, for other
    compiled code.
    """

    def __init__(self, form: Any, cells: Cells, known: TableFunctions, load: int, *, inside: bool = False) -> None:
        self.form, self._code = form, module("fem/assembly")
        ffi, size = self._code.ffi, cells.dofs.shape[1]
        integrals = compat.integrals(form)
        if inside:
            every = np.arange(len(cells.dofs), dtype=np.int32)[:, None]
            integrals = [x._replace(entities=every) for x in integrals if x.kind == compat.CELL]
        memory = self._memory = Memory(ffi)
        held = memory.keep("integrals", ffi.new("Integral[]", len(integrals)))
        for i, (c, x) in enumerate(zip(held, integrals, strict=True)):
            # since release 0.10 a kernel takes custom data as well
            c.kernel, c.custom = int(ffi.cast("uintptr_t", x.kernel)), len(ffi.typeof(x.kernel).args) > 6
            c.kind, c.count, c.entities = x.kind, len(x.entities), memory.array(i, x.entities)
        sides = 1 + any(x.kind == compat.INTERIOR for x in integrals)
        pieces = sum(rows.shape[1] for rows in known.rows)
        tables, names = known.along.shape[1], compat.coefficients(form)
        functions = np.flatnonzero(np.isin(FUNCTIONS, names)).astype(np.int32)
        arrays = {
            "x": cells.x,
            "dofs": cells.dofs,
            "tensor": np.zeros((sides * size) ** form.rank),
            "w": np.zeros(sides * (len(functions) * size + tables + pieces)),
            "function": functions,
            "table": known.along,
            "piece": np.zeros(pieces),
        }
        pointers = {name: memory.array(name, array) for name, array in arrays.items()}
        paths = memory.keep("paths", ffi.new("Path[]", len(known.rows)))
        for c, rows, line in zip(paths, known.rows, known.lines, strict=True):
            c.dof, (c.pieces, c.size) = load, rows.shape
            memory.point(c, line=line, rows=rows)
        numbers = {"rank": form.rank, "size": size, "functions": len(functions), "integrals": len(integrals)}
        numbers |= {"integral": held, "tables": tables, "paths": len(known.rows), "pieces": pieces, "path": paths}
        self.pointer = ffi.new("Form *", numbers | pointers)
        self.functions = addresses(self._code, "assemble", "multiply")
        self.constants = np.zeros(0)

    def pack_constants(self) -> None:
        """Take the values that the constants of the form have now."""
        self.constants = np.ascontiguousarray(compat.pack_constants(self.form), dtype=float)

    def add(self, values: np.ndarray, places: Places | None, out: np.ndarray) -> None:
        """Add the form at the local ``values`` of the unknown to ``out``, where ``places`` say (None: a scalar).

        Of a form that reads other :data:`FUNCTIONS` the ``values`` have a row for each of them.
        """
        ffi, self.pointer.locals = self._code.ffi, values.shape[-1]
        target = ffi.NULL if places is None else places.pointer
        given = (buffer(ffi, x) for x in (values, self.constants, out))
        failed = self._code.lib.assemble(self.pointer, target, *given)
        assert not failed, ONE_CELL


def bordered_pattern(fields: Fields) -> sp.csr_matrix:
    """Nonzero pattern, with the diagonal, of this rank's rows: couplings inside cells; rows and columns of scalars."""
    rows, scalars = _own_rows(fields, list(fields.dofs)), len(fields.scalars)  # the last columns of each row
    return bordered(rows, fields.unknowns, scalars, fields.local_unknowns - rows.shape[0])[0]


def metric_pattern(fields: Fields) -> sp.csr_matrix:
    """The part of it for a metric: rotations couple to rotations, centreline or strains to themselves; the diagonal."""
    names = [name for name in (fields.turning.name, "r" if "r" in fields.dofs else "v") if name in fields.dofs]
    rows = sum(_own_rows(fields, [name]) for name in names)
    size = (fields.local_unknowns, fields.unknowns)
    diagonal = sp.eye(*size, k=fields.offset, dtype=np.int8, format="csr")
    pattern = sp.csr_matrix((rows.data, rows.indices, np.pad(rows.indptr, (0, size[0] - rows.shape[0]), "edge")), size)
    pattern = (pattern + diagonal).tocsr()
    pattern.sort_indices()
    return pattern


def _own_rows(fields: Fields, names: list[str]) -> sp.csr_matrix:
    """Couplings (free_owned, unknowns) of this rank's unknowns of some fields inside all their cells, sorted."""
    comm, n = fields.comm, fields.unknowns
    first, own, cells = fields.offset, len(fields.free_owned), fields.owned_cells
    numbers = np.hstack([fields.number[fields.dofs[name][:cells]].reshape(cells, -1) for name in names])
    keep = numbers >= 0
    indptr = np.append(0, np.cumsum(keep.sum(axis=1)))
    incidence = sp.csr_matrix((np.ones(indptr[-1], dtype=np.int8), numbers[keep], indptr), shape=(cells, n))
    coupling = incidence.T.tocsr() @ incidence
    rows = coupling[first : first + own]
    if comm.size > 1:
        starts = np.array(comm.allgather(first))
        outside = sp.vstack([coupling[:first], sp.csr_matrix((own, n), dtype=np.int8), coupling[first + own :]]).tocoo()
        owner = np.searchsorted(starts, outside.row, side="right") - 1
        sent = comm.alltoall([(outside.row[owner == rank], outside.col[owner == rank]) for rank in range(comm.size)])
        row, column = (np.concatenate(parts) for parts in zip(*sent, strict=True))
        rows = rows + sp.csr_matrix((np.ones(len(row), dtype=np.int8), (row - first, column)), shape=rows.shape)
    rows.sort_indices()
    return rows


def new_matrix(fields: Fields, pattern: sp.csr_matrix, rows: PETSc.LGMap, columns: PETSc.LGMap) -> PETSc.Mat:
    """Zero PETSc AIJ matrix with a pattern; its values are shared with numpy where compiled code assembles it."""
    matrix = matrix_of(fields.comm, pattern, compiled=fields.compiled)
    matrix.setLGMap(rows, columns)
    matrix.setOption(PETSc.Mat.Option.NEW_NONZERO_LOCATION_ERR, True)
    matrix.setOption(PETSc.Mat.Option.IGNORE_ZERO_ENTRIES, True)  # a point between two cells couples all of both, by 0
    return matrix

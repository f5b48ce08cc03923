"""Shared by the methods for stability on one system: matrices, symbolic factorisations, coordinates."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.linalg.matrices import first_of, gathered, local_rows
from rodfem.stability.blocks import Blocks, Pencil
from rodfem.stability.inertia import Inertia
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.pencil import symmetry_modes, weighed_modes
from rodfem.stability.symmetric import SymmetricPencil, SymmetricSolver


class Workspace:
    """Matrices and factorisations, made when they are asked for and kept for the next state."""

    def __init__(self, source: Any) -> None:
        """Keep a :class:`~rodfem.fem.system.System`, given itself or by its solver."""
        self.system: System = source if isinstance(source, System) else source.system
        self.conservative = self.system.scene.conservative
        given = getattr(source, "inertia", None)
        self.inertia: Inertia | None = (given or Inertia(self.system)) if self.conservative else None
        self._blocks: Blocks | None = None
        self._map: sp.csr_matrix | None = None

    @cached_property
    def symmetric(self) -> SymmetricSolver:
        """Left-most eigenvalues of conservative states."""
        assert self.inertia is not None
        return SymmetricSolver(self.inertia)

    @cached_property
    def nonsymmetric(self) -> NonsymmetricSolver:
        """Eigenvalues of states under loads without a potential."""
        assert not self.conservative
        return NonsymmetricSolver(self.system)

    def factorisations(self) -> int:
        """Number of those of the symmetric pencil, so far."""
        return self.symmetric.factorisations if "symmetric" in vars(self) else 0

    def below(self, x: PETSc.Vec) -> SymmetricPencil:
        """Symmetric pencil at ``x``, its shift below all eigenvalues."""
        pencil = self.symmetric.at(x)
        pencil.go_below()
        return pencil

    @property
    def one(self) -> float:
        """Natural size of eigenvalues."""
        return self.system.scene.units.omega2

    @property
    def sizes(self) -> PETSc.Vec:
        """Natural size of each unknown."""
        return (self.symmetric if self.conservative else self.nonsymmetric).sizes

    def pencil(self, x: PETSc.Vec, coordinates: str = "tangent") -> Pencil:
        """Blocks at ``x``, with a constraint ``g.Mx = 0`` more for each symmetry mode ``g``.

        They are in units of natural sizes, but for ``full`` coordinates.
        """
        if self._blocks is None or self._blocks.coordinates != coordinates:
            self._blocks = Blocks(self.system, coordinates)
        blocks = self._blocks
        modes = symmetry_modes(self.system, x)
        sizes = None if coordinates == "full" or self.system.scene.units.ordinary else self.sizes
        pencil = blocks.assemble(x, sizes)
        self._map = gathered(pencil.T) if pencil.T is not None else None
        if not modes:
            return pencil
        comm = self.system.comm
        images = []
        for _, weighed in weighed_modes(self.system, modes, blocks.mass).values():
            if sizes is not None:
                weighed.pointwiseMult(weighed, sizes)
                weighed.scale(1.0 / weighed.norm())
            full = weighed.array_r[blocks.rows - self.system.fields.offset].copy()
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

    def lift(self, vectors: np.ndarray) -> list[PETSc.Vec]:
        """Vectors of the system from columns in the pencil's coordinates and units."""
        blocks = self._blocks
        assert blocks is not None
        full: Any = vectors if self._map is None else self._map @ vectors
        first = first_of(self.system.comm, len(blocks.rows))
        out = []
        for column in full.T:
            vector = self.system.new_vector()
            vector.array[blocks.rows - self.system.fields.offset] = column[first : first + len(blocks.rows)]
            vector.assemble()
            if not self.system.scene.units.ordinary:
                vector.pointwiseMult(vector, self.sizes)
            out.append(vector)
        return out

"""Unknowns of a discretised rod: mesh, mixed space, scalars, clamps, and one global numbering of what is free.

The fields live in one mixed finite element space.  A *scalar* unknown (a component of a constant contact force, the
load) is a field that is constant over the rod: it enters the mixed space as one value in each cell, and all cells share
one global number, so that UFL differentiates and dolfinx assembles it like any field.  Clamped degrees of freedom have
no number at all: PETSc drops what is added to number -1, and no Dirichlet row ever disturbs an eigenproblem.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from rodfem import compat
from rodfem.errors import SceneError
from rodfem.scene import Scene

FORMULATIONS = ("reduced", "pointwise")
LOAD = "load"


@dataclass(frozen=True)
class Block:
    """One field: its name, number of components, degree, continuity, and whether it is a multiplier."""

    name: str
    size: int
    degree: int
    continuous: bool
    multiplier: bool


@dataclass(frozen=True)
class Discretization:
    """How a scene is discretised: ``formulation``, number of ``elements`` and polynomial ``degree``."""

    formulation: str = "reduced"
    elements: int = 8
    degree: int = 6

    def __post_init__(self) -> None:
        """Check the values; raises :class:`SceneError`."""
        if self.formulation not in FORMULATIONS:
            raise SceneError(f"Unknown formulation {self.formulation!r}: choose one of {', '.join(FORMULATIONS)}.")
        if self.elements < 1:
            raise SceneError(f"A mesh of {self.elements} elements cannot hold a rod: give at least 1.")
        if not 1 <= self.degree <= 12:
            raise SceneError(f"Degree {self.degree} is not available: choose 1 to 12.")


def blocks_of(scene: Scene, discretization: Discretization) -> list[Block]:
    """Fields of a scene: ``q`` and ``mu`` always, ``v`` where strains are free, ``r`` and ``n`` if pointwise."""
    k = discretization.degree
    blocks = [Block("q", 4, k, True, False), Block("mu", 1, k, True, True)]
    if scene.free_strains:
        blocks.append(Block("v", len(scene.free_strains), k - 1, False, False))
    if discretization.formulation == "pointwise":
        blocks += [Block("r", 3, k, True, False), Block("n", 3, k - 1, False, True)]
    return blocks


class Fields:
    """Mesh, mixed space, the unknown ``u`` as a dolfinx Function, and the numbering of free unknowns.

    Attributes
    ----------
    dofs
        For each field the local degrees of freedom, (cells incl. ghosts, nodes per cell, components).
    number
        Global number of each local degree of freedom, -1 where clamped; (local size,) int32.
    forces
        Components of the contact force that are scalar unknowns (reduced formulation).
    scalars
        Global number of each scalar: ``n1``.. for ``forces``, ``load``, and ``drift0``.. one for each symmetry.
    """

    def __init__(
        self, scene: Scene, discretization: Discretization, comm: MPI.Comm = MPI.COMM_WORLD, mesh: Any = None
    ) -> None:
        """Make the mesh (unless given), number the unknowns; :class:`SceneError` for more ranks than elements."""
        if comm.size > discretization.elements:
            raise SceneError(
                f"{discretization.elements} elements cannot be shared by {comm.size} ranks: "
                "use more elements or fewer ranks."
            )
        self.scene, self.discretization, self.comm = scene, discretization, comm
        self.blocks = blocks_of(scene, discretization)
        reduced = discretization.formulation == "reduced"
        if reduced and not scene.conservative:
            raise SceneError(
                "The reduced formulation has no centreline, which the mass of a rod under a follower force needs: "
                "use --formulation pointwise."
            )
        c = scene.constants()
        self.forces = [i for i in range(3) if reduced and scene.known_force(i, c) is None]
        names = [f"n{i + 1}" for i in self.forces] + [LOAD]
        self.mesh = mesh or compat.interval_mesh(comm, discretization.elements, *scene.interval)
        parts = [(b.continuous, b.degree, b.size) for b in self.blocks] + [(False, 0, len(names))]
        self.space = compat.mixed_space(self.mesh, parts)
        self.u = fem.Function(self.space, dtype=compat.REAL)
        cells = self.mesh.topology.index_map(1)
        self.owned_cells, local_cells = cells.size_local, cells.size_local + cells.num_ghosts
        self.vertices = compat.cell_vertices(self.mesh, local_cells)
        self.dofs = {b.name: self._block_dofs(i, b.size, local_cells) for i, b in enumerate(self.blocks)}
        copies = self._block_dofs(len(self.blocks), len(names), local_cells)[:, 0, :]
        self._number(copies, names)

    def _block_dofs(self, part: int, size: int, cells: int) -> np.ndarray:
        sub = self.space.sub(part)
        components = [sub.sub(i) for i in range(size)] if size > 1 else [sub]
        return np.stack([compat.cell_dofs(component, cells) for component in components], axis=-1)

    def _clamped(self) -> np.ndarray:
        """Local degrees of freedom that an end holds: ``q`` and ``mu`` at clamped directors, ``r`` where held."""
        found = []
        for end, s in zip(self.scene.ends, self.scene.interval, strict=True):
            for block in self.blocks:
                if not block.continuous:
                    continue
                x = self.coordinates(block.degree)
                at_end = self.dofs[block.name][np.isclose(x, s, rtol=0, atol=1e-9 * self.scene.length)]
                if block.name == "r":
                    held = [x is not None for x in end.held(self.scene.constants())]
                    found.append(at_end[:, held].ravel())
                elif end.rotation is not None:
                    found.append(at_end.ravel())
        return np.unique(np.concatenate(found)) if found else np.array([], dtype=int)

    def _number(self, copies: np.ndarray, names: list[str]) -> None:
        """Number free unknowns rank by rank; scalars come last and belong to the last rank."""
        index_map = self.space.dofmap.index_map
        owned, local = index_map.size_local, index_map.size_local + index_map.num_ghosts
        free = np.ones(local, dtype=bool)
        free[self._clamped()] = False
        free[copies.ravel()] = False
        self.free_owned = np.flatnonzero(free[:owned])
        count = len(self.free_owned)
        self.offset = sum(self.comm.allgather(count)[: self.comm.rank])
        self.field_unknowns = self.comm.allreduce(count)
        numbers = fem.Function(self.space, dtype=compat.REAL)
        numbers.x.array[:] = -1.0
        numbers.x.array[self.free_owned] = self.offset + np.arange(count)
        numbers.x.scatter_forward()
        self.number = np.rint(numbers.x.array).astype(np.int32)
        all_names = names + [f"drift{i}" for i in range(len(self.scene.symmetries))]
        self.scalars = {name: self.field_unknowns + i for i, name in enumerate(all_names)}
        for i, name in enumerate(names):
            self.number[copies[:, i]] = self.scalars[name]
        self.unknowns = self.field_unknowns + len(all_names)
        self.local_unknowns = count + (len(all_names) if self.comm.rank == self.comm.size - 1 else 0)
        self.copies = copies

    def coordinates(self, degree: int) -> np.ndarray:
        """Arclengths of the nodes of a field of that degree in each local cell, (cells, degree + 1)."""
        a, b = self.vertices[:, :1], self.vertices[:, 1:]
        return a + (b - a) * compat.nodes(degree)

    def constraints(self) -> int:
        """Number of constraint equations: free multipliers and scalar contact forces (drift scalars not counted)."""
        multipliers = [self.dofs[b.name].ravel() for b in self.blocks if b.multiplier]
        mine = np.unique(np.concatenate(multipliers))
        owned = mine[(mine < self.space.dofmap.index_map.size_local) & (self.number[mine] >= 0)]
        return self.comm.allreduce(len(owned)) + len(self.forces)

    def describe(self) -> str:
        """Fields and scalars in words, for the terminal."""
        names = {
            "q": "rotation q",
            "mu": "unit-norm multiplier mu",
            "v": "strain v",
            "r": "centreline r",
            "n": "contact force n",
        }
        words = [f"{names[b.name]} (P{b.degree})" for b in self.blocks]
        words += ["n" + ", n".join(str(i + 1) for i in self.forces) + " (scalar)"] if self.forces else []
        return ", ".join(words)

    def left_out(self) -> list[str]:
        """Unknowns that this scene does without, and why."""
        scene, c = self.scene, self.scene.constants()
        fixed = [i for i in range(3) if i not in scene.free_strains]
        lines = []
        if fixed:
            lines.append(f"strain {', '.join(f'v{i + 1}' for i in fixed)}: the rod is {scene.rod}")
        if self.discretization.formulation == "reduced":
            lines.append(
                "centreline r and the field of contact force: no force acts along the rod, "
                "so that the contact force is constant"
            )
            known = [f"n{i + 1}" for i in range(3) if scene.known_force(i, c) is not None]
            if known:
                lines.append(f"contact force {', '.join(known)}: a dead force at an end that is free to move there")
        return lines

"""Unknowns of a discretised rod: mesh, mixed space, scalars, clamps, and one global numbering of what is free.

The fields live in one mixed finite element space.  A *scalar* unknown (a component of a constant contact force, the
load) is a field that is constant over the rod: it enters the mixed space as one value in each cell, and all cells share
one global number, so that UFL differentiates and dolfinx assembles it like any field.  Clamped degrees of freedom have
no number at all: PETSc drops what is added to number -1, and no Dirichlet row ever disturbs an eigenproblem.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI

from rodfem import compat
from rodfem.errors import InputError
from rodfem.fem import formulations
from rodfem.fem.assembly import FUNCTIONS
from rodfem.fem.formulations import CONTACT_FORCE, Formulation, turning_of
from rodfem.fem.state import LOAD
from rodfem.linalg.chain import Chain, Factors
from rodfem.linalg.factorization import Mumps, Sizes
from rodfem.linalg.matrices import block_matrix
from rodfem.problem.arguments import convert, optional, reals, whole
from rodfem.problem.functions import Constants
from rodfem.problem.units import Units
from rodfem.problem.unknowns import Block, Group, Unknown
from rodfem.tolerances import SAME_PLACE, same_place

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

FACTORS = CHAIN, PETSC = "chain", "petsc"
"""What assembles and factors the matrices of a discretisation."""
HIGHEST = 12
"""Highest degree of elements."""
FEW = 4000
"""Number of unknowns up to which symmetries are sought on the mesh itself, and forms and states are kept for others."""


@dataclass(frozen=True)
class Discretization:
    """How a scene is discretised: ``formulation``, number of ``elements`` and polynomial ``degree``.

    The formulation is one of :mod:`rodfem.fem.formulations`, or ``auto``: the first that the scene allows.
    ``vertices`` are the arclengths at which elements meet, both ends included; without them all elements are of nearly
    equal size.  ``factors`` are ``chain``, compiled assembly and elimination along the rod, or ``petsc``, the same
    matrices assembled by dolfinx and factored by MUMPS: the reference, with the same numbers, and slower.
    """

    formulation: str = "auto"
    elements: int = 8
    degree: int = 6
    vertices: tuple[float, ...] | None = None
    factors: str = CHAIN

    def __post_init__(self) -> None:
        """Check the values; raises :class:`InputError`."""
        along = optional(lambda name, value: reals(name, value, (0.0, 0.5, 1.0)))
        convert(self, elements=whole(8), degree=whole(6), vertices=along)
        names, elements = formulations.NAMES, self.elements
        most = 1_000_000  # of which 100000 of degree 2 take 4 GB
        if self.formulation not in names:
            raise InputError(
                f"Unknown formulation {self.formulation!r}: choose one of {', '.join(names)}, and give numbers by "
                "name, as in elements=8, degree=6."
            )
        if self.factors not in FACTORS:
            raise InputError(f"Nothing factors matrices by the name {self.factors!r}: choose {' or '.join(FACTORS)}.")
        if not 1 <= elements <= most:
            raise InputError(f"A mesh of {elements} elements holds no rod, or is too large: give 1 to {most}.")
        if not 1 <= self.degree <= HIGHEST:
            raise InputError(f"Degree {self.degree} is not available: choose 1 to {HIGHEST}.")
        if given := self.vertices:
            if len(given) != elements + 1:
                raise InputError(f"{len(given)} vertices do not bound {elements} elements: give {elements + 1}.")
            if np.diff(given).min() <= SAME_PLACE * (given[-1] - given[0]):
                raise InputError("The vertices of a mesh must ascend along the rod: sort them, each once.")

    def finer(self, factor: int, richer: int = 0) -> Discretization:
        """Each element cut into ``factor`` equal ones, of a degree higher by ``richer``."""
        vertices = self.vertices
        if vertices is not None:
            at = np.arange(factor * self.elements + 1) / factor
            vertices = tuple(float(s) for s in np.interp(at, np.arange(self.elements + 1), vertices))
        return replace(self, elements=factor * self.elements, degree=self.degree + richer, vertices=vertices)


def blocks_of(scene: Scene, formulation: Formulation, k: int) -> list[Block]:
    """Fields: rotation with its multiplier, free strains, those of the formulation and of the parts of the scene."""
    turning = turning_of(scene)
    blocks = [Block(turning.name, turning.size, k, True, False)]
    if turning.name == "q":
        blocks.append(Block("eta", 1, k, True, True))
    if scene.free_strains:
        blocks.append(Block("v", len(scene.free_strains), k - 1, False, False))
    return blocks + formulation.blocks(k) + [block for part in scene.parts for block in part.of.blocks(part.number, k)]


def scalars_of(scene: Scene, formulation: Formulation) -> list[Unknown]:
    """Scalar unknowns of the formulation and of the parts of a scene, without the load."""
    parts = [x for part in scene.parts for x in part.of.unknowns(part.number, scene.normal, formulation.centreline)]
    return list(dict.fromkeys(formulation.unknowns(scene) + parts))


def check_mesh(scene: Scene, discretization: Discretization, ranks: int = 1) -> None:
    """Raise :class:`InputError` where a scene or a number of ranks does not allow a discretisation."""
    formulations.chosen(discretization.formulation, scene)
    elements, given, pieces = discretization.elements, discretization.vertices, len(scene.joints) + 1
    if ranks > elements:
        raise InputError(f"{elements} elements cannot be shared by {ranks} ranks: use more elements or fewer ranks.")
    if given is None and elements < pieces:
        raise InputError(
            f"The rod has {pieces} pieces between joints, and needs an element for each: use more than {elements} "
            "elements."
        )
    if given is not None and not (
        (given[0], given[-1]) == tuple(scene.interval)
        and all(same_place(given, s, scene.length).any() for s in scene.joints)
    ):
        raise InputError(
            f"The vertices of the mesh must begin and end at {scene.interval[0]:g} and {scene.interval[1]:g} "
            "and hold every joint of the scene: add what is missing."
        )


def most_eigenvalues(scene: Scene, discretization: Discretization) -> int:
    """Bound of the number of finite eigenvalues of the discrete rod: what can turn, and what moves with a mass."""
    turning, moving = (3, 3) if scene.normal is None else (1, 2)
    at_a_node = turning + (moving if scene.has_inertia or not scene.conservative else 0)
    return at_a_node * (discretization.elements * discretization.degree + 1)


def check_number(scene: Scene, discretization: Discretization, number: int) -> None:
    """Raise :class:`InputError` where a ``scene`` has fewer than so many eigenvalues on a ``discretization``."""
    if number > (most := most_eigenvalues(scene, discretization)):
        raise InputError(
            f"The mesh has no more than {most} eigenvalues, not {number}: give number={most} or less, or use more "
            "elements."
        )


class Fields:
    """Mesh, mixed space, the unknown ``u`` of all forms as a dolfinx Function, and the numbering of free unknowns.

    ``dofs`` are the local degrees of freedom of each field, (cells incl. ghosts, nodes per cell, components),
    ``copies`` those of the scalars but for drifts, one in each cell, (cells, scalars).  ``number`` (local size,) is the
    global number of each, -1 where clamped, and ``clamps`` the value there, zero for all others; ``scalars`` has the
    numbers of the scalars, ``n1``.. for a constant contact force, ``load``, and ``drift0``.. one for each symmetry.
    """

    def __init__(self, scene: Scene, discretization: Discretization, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        check_mesh(scene, discretization, comm.size)
        self.asked, self.scene, self.comm = discretization, scene, comm
        self.formulation = formulations.chosen(discretization.formulation, scene)
        least = 1 if discretization.vertices else len(scene.vertices) + 1
        elements = max(discretization.elements, least)
        self.discretization = replace(discretization, formulation=self.formulation.name, elements=elements)
        self.turning = turning_of(scene)
        self.blocks = blocks_of(scene, self.formulation, discretization.degree)
        self.unknown_scalars = scalars_of(scene, self.formulation)
        self.forces = [x.component for x in self.unknown_scalars if x.group.name == CONTACT_FORCE]
        names = [x.name for x in self.unknown_scalars] + [LOAD]
        self.mesh = self._mesh()
        parts = [(b.continuous, b.degree, b.size) for b in self.blocks] + [(False, 0, len(names))]
        self.space = compat.mixed_space(self.mesh, parts)
        self.u, *self.changes = (compat.fem.Function(self.space, name=x, dtype=compat.REAL) for x in FUNCTIONS)
        cells = self.mesh.topology.index_map(1)
        self.owned_cells, local_cells = cells.size_local, cells.size_local + cells.num_ghosts
        self.vertices = compat.cell_vertices(self.mesh, local_cells)
        self.dofs = {b.name: self._block_dofs(i, b.size, local_cells) for i, b in enumerate(self.blocks)}
        self.copies = self._block_dofs(len(self.blocks), len(names), local_cells)[:, 0, :]
        self.clamped = self._clamped()
        self._number(names)
        self.clamps = self._clamps()

    def bound(self, scene: Scene) -> Fields | None:
        """The same, without drifts, for a scene with other constants; None where its unknowns are others."""
        out = copy(self)
        out.scene, out.scalars = scene, dict(self.scalars)
        out.formulation = formulations.chosen(self.asked.formulation, scene)
        out.unknown_scalars = scalars_of(scene, out.formulation)
        alike = (out.formulation, out.unknown_scalars) == (self.formulation, self.unknown_scalars)
        if not all(self.comm.allgather(alike and np.array_equal(out._clamped(), self.clamped))):
            return None
        out.clamps = out._clamps()
        return out

    def _mesh(self) -> Any:
        """Mesh with the vertices that the discretisation gives, or of elements of nearly equal size; each at joints."""
        scene, elements, given = self.scene, self.discretization.elements, self.discretization.vertices
        pieces = np.array([scene.interval[0], *scene.vertices, scene.interval[1]])
        mesh = compat.interval_mesh(self.comm, elements, *scene.interval)
        if given is None and len(pieces) > 2:
            shares = np.diff(pieces) / scene.length * elements
            counts = np.maximum(np.floor(shares).astype(int), 1)
            while counts.sum() > elements:
                counts[np.argmax(np.where(counts > 1, counts / shares, 0))] -= 1
            while counts.sum() < elements:
                counts[np.argmax(shares / counts)] += 1
            ends = zip(pieces, pieces[1:], counts, strict=False)
            given = (*np.concatenate([np.linspace(a, b, n + 1)[:-1] for a, b, n in ends]), pieces[-1])
        if given is not None:
            compat.move_vertices(mesh, np.linspace(*scene.interval, elements + 1), np.array(given))
        return mesh

    def _block_dofs(self, part: int, size: int, cells: int) -> np.ndarray:
        sub = self.space.sub(part)
        components = [sub.sub(i) for i in range(size)] if size > 1 else [sub]
        return np.stack([compat.cell_dofs(component, cells) for component in components], axis=-1)

    def _clamped(self) -> np.ndarray:
        """Local degrees of freedom that an end clamps, and of a planar rod all that would leave the plane."""
        found = [np.array([], dtype=int), *(dofs.ravel() for dofs in self.out_of_plane(self.scene.normal).values())]
        c = self.scene.constants()
        for side, (end, s) in enumerate(zip(self.scene.sides, self.scene.interval, strict=True)):
            for block in (b for b in self.blocks if b.continuous):
                at_end = self.dofs[block.name][same_place(self.coordinates(block.degree), s, self.scene.length)]
                given = end.clamps(block, c) if block.tangent is None else block.tangent[side]
                found.append(at_end[:, np.broadcast_to(given, block.size)].ravel())
        for block in (b for b in self.blocks if b.spare):
            ends, x = self.all_vertices, self.coordinates(block.degree)
            a, b = ends[len(ends) // 2 - 1 :][:2]
            middle = a + (b - a) * np.sort(compat.nodes(block.degree))[1]
            found.append(self.dofs[block.name][same_place(x, middle, self.scene.length)].ravel())
        return np.unique(np.concatenate(found))

    def out_of_plane(self, normal: int | None) -> dict[str, np.ndarray]:
        """Degrees of freedom of each field that vanish for a rod in the plane across ``normal``; None: in space."""
        if normal is None:
            return {}
        strains = [place for place, i in enumerate(self.scene.free_strains) if i == normal]
        components = {"r": [normal], "n": [normal], "v": strains}
        return {name: self.dofs[name][..., chosen] for name, chosen in components.items() if name in self.dofs}

    def _number(self, names: list[str]) -> None:
        """Number free unknowns rank by rank; scalars come last and belong to the last rank."""
        index_map = self.space.dofmap.index_map
        free = np.ones(index_map.size_local + index_map.num_ghosts, dtype=bool)
        free[self.clamped] = False
        free[self.copies.ravel()] = False
        self.free_owned = np.flatnonzero(free[: index_map.size_local])
        count = len(self.free_owned)
        self.offset = sum(self.comm.allgather(count)[: self.comm.rank])
        self.field_unknowns = self.comm.allreduce(count)
        numbers = np.full(len(free), -1.0)
        numbers[self.free_owned] = self.offset + np.arange(count)
        self.number = np.rint(self.scattered(numbers)).astype(np.int32)
        self.scalars: dict[str, int] = {}
        self.unknowns, self.local_unknowns = self.field_unknowns, count
        self._append(names)
        self.number[self.copies] = [self.scalars[name] for name in names]

    def _append(self, names: list[str]) -> None:
        """Give scalars the next numbers; all are on the last rank."""
        self.scalars |= {name: self.unknowns + i for i, name in enumerate(names)}
        self.unknowns += len(names)
        self.local_unknowns += len(names) if self.comm.rank == self.comm.size - 1 else 0

    def _clamps(self) -> np.ndarray:
        out, scene = np.zeros(len(self.number)), self.scene
        x = self.coordinates(self.discretization.degree)
        for end, s in zip(scene.sides, scene.interval, strict=True):
            if end.fixed_rotation is not None:
                here = self.dofs[self.turning.name][same_place(x, s, scene.length)]
                out[here] = self.turning.clamp(end.fixed_rotation, scene.start, s, scene.interval)
        return out

    def filled(self, named: Mapping[str, Any]) -> np.ndarray:
        """Local values of nodal values of fields and of scalars by name, zero without one; clamps have their own."""
        out = np.zeros(len(self.number))
        for name, dofs in self.dofs.items():
            out[dofs] = named.get(name, 0.0)
        for name, copies in zip(self.scalars, self.copies.T, strict=False):
            out[copies] = named.get(name, 0.0)
        return np.where(self.number < 0, self.clamps, out)

    def wave(self, i: int = 1) -> np.ndarray:
        """A smooth wave in each component of each field, over natural sizes, zero where it is clamped: local values."""
        named = {}
        for block in self.blocks:
            x, number = self.coordinates(block.degree) - self.scene.interval[0], i * np.arange(1, block.size + 1)
            named[block.name] = np.sin(number + np.multiply.outer(x / self.scene.length, number))
        named |= {name: np.sin(i * number) for number, name in enumerate(self.scalars, start=1) if name != "load"}
        return np.where(self.number < 0, 0.0, self.filled(named))

    @cached_property
    def sizes(self) -> np.ndarray:
        """Natural size of each local value."""
        return self.sizes_in(self.scene.units)

    def sizes_in(self, units: Units) -> np.ndarray:
        """Size of each local value in some ``units``: rotations are of order one, the others have units."""
        out = np.ones(len(self.number))
        for block in self.blocks:
            out[self.dofs[block.name]] = units.of_field(block)
        out[self.copies] = [*map(units.of_scalar, self.unknown_scalars), units.load]
        return out

    def scattered(self, local: np.ndarray) -> np.ndarray:
        """Local values with those of ghosts from the ranks that own them."""
        if self.comm.size == 1:
            return local
        function = compat.fem.Function(self.space, dtype=compat.REAL)
        function.x.array[:] = local
        function.x.scatter_forward()
        return np.array(function.x.array)

    @cached_property
    def all_vertices(self) -> np.ndarray:
        """Arclengths at which elements meet, of all ranks in ascending order, (E + 1,)."""
        mine = self.vertices[: self.owned_cells, 0]
        return np.append(np.sort(np.concatenate(self.comm.allgather(mine))), self.scene.interval[1])

    @property
    def compiled(self) -> bool:
        """Whether compiled code assembles and factors matrices: on one rank, unless PETSc is asked for."""
        return self.comm.size == 1 and self.discretization.factors == CHAIN

    def factors(self, kind: str, sizes: Sizes | None = None, borders: int = 0) -> Factors:
        """Factors ``lu``, or ``cholesky``, of matrices of a system, which may have dense ``borders`` as well."""
        return Chain(kind, self.dense_rows + borders, sizes) if self.compiled else Mumps(kind, sizes)

    @property
    def dense_rows(self) -> int:
        """Number of scalars: the last rows of a system couple to all others."""
        return self.unknowns - self.field_unknowns

    def add_drifts(self, count: int) -> None:
        """Add a drift scalar for each symmetry; before any matrix is made."""
        self._append([f"drift{i}" for i in range(count)])

    def lift(self, s: np.ndarray, c: Constants) -> np.ndarray:
        """Linear function of the ends' positions that the centreline field is measured from, (..., 3) for (...,)."""
        start, stop = self.scene.interval
        x = ((np.asarray(s) - start) / (stop - start))[..., None]
        a, b = np.array([[float(p) for p in pair] for pair in self.scene.end_positions(c)]).T
        return np.asarray((1 - x) * a + x * b)

    def coordinates(self, degree: int) -> np.ndarray:
        """Arclengths of the nodes of a field of that degree in each local cell, (cells, degree + 1)."""
        a, b = self.vertices[:, :1], self.vertices[:, 1:]
        return a + (b - a) * compat.nodes(degree)

    @property
    def surfaces(self) -> list[str]:
        """Names of the multipliers of surfaces."""
        return [b.name for b in self.blocks if b.tangent is not None]

    def constraints(self) -> int:
        """Number of constraint equations: free multipliers, fields and scalars (drift scalars not counted)."""
        mine = int(self.multipliers[self.free_owned].sum())
        return self.comm.allreduce(mine) + sum(x.multiplier for x in self.unknown_scalars)

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Whether each local degree of freedom is that of a multiplier, (local size,)."""
        out = np.zeros(len(self.number), dtype=bool)
        for block in self.blocks:
            out[self.dofs[block.name]] = block.multiplier
        out[self.copies[:, :-1]] = [x.multiplier for x in self.unknown_scalars]
        return out

    @cached_property
    def groups(self) -> dict[Group, list[Unknown]]:
        """Scalar unknowns by the groups that they belong to."""
        out: dict[Group, list[Unknown]] = {}
        for unknown in self.unknown_scalars:
            out.setdefault(unknown.group, []).append(unknown)
        return out

    # --- derivatives in arclength ------------------------------------------------------------------------------

    @cached_property
    def derivative(self) -> sp.csr_matrix:
        """Matrix (local size,) * 2 of the derivative in arclength at free nodes, the mean of cells that share one."""
        slopes, dofs = self._slopes(self.blocks)
        sums = sp.csr_matrix((np.ones(len(dofs)), (dofs, np.arange(len(dofs)))), shape=(len(self.number), len(dofs)))
        shared = np.maximum(np.asarray(sums.sum(axis=1)).ravel(), 1.0)
        return (sp.diags(np.where(self.number < 0, 0.0, 1.0 / shared)) @ sums @ slopes).tocsr()

    @cached_property
    def derivative_jumps(self) -> sp.csr_matrix:
        """Matrix (shared nodes, local size) of its jumps between cells, of rotation and centreline."""
        slopes, dofs = self._slopes([b for b in self.blocks if b.name in (self.turning.name, "r")])
        order = np.argsort(dofs, kind="stable")
        twins = np.flatnonzero(np.diff(dofs[order]) == 0)
        return slopes[order[twins + 1]] - slopes[order[twins]]

    def _slopes(self, blocks: list[Block]) -> tuple[sp.csr_matrix, np.ndarray]:
        """Matrix of the derivative of fields at the nodes of each cell, and the degrees of freedom of its rows."""
        found, sizes = [], np.diff(self.vertices, axis=1)[:, 0] / self.scene.units.length
        for block in blocks:
            dofs, weights = self.dofs[block.name], _differentiation(block.degree) / sizes[:, None, None]
            numbers = np.arange(dofs.size).reshape(dofs.shape), dofs
            rows, columns = (x.transpose(0, 2, 1).reshape(-1, dofs.shape[1]) for x in numbers)
            each = np.repeat(weights, block.size, axis=0)  # component by component of a cell
            found.append(block_matrix(each, rows, columns, (dofs.size, len(self.number))))
        return sp.vstack(found, format="csr"), np.concatenate([self.dofs[b.name].ravel() for b in blocks])


@cache
def _differentiation(degree: int) -> np.ndarray:
    """Matrix (m, m) of the derivative of a polynomial at the nodes of an element."""
    nodes = compat.nodes(degree)
    powers = np.vander(2 * nodes - 1, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = 2 * powers[:, :-1] * np.arange(1, len(nodes))
    return np.asarray(slopes @ np.linalg.inv(powers))

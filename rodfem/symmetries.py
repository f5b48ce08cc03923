r"""The continuous symmetries of a scene, found from its equations.

A rigid motion of space or of the cross-sections changes each field and group of scalars by one of a few elementary
generators ``g_j`` (:mod:`forms.symmetry`).  A combination of them is a symmetry where it leaves the functional ``L`` as
it is, at every state and load, and moves nothing that an end holds:

    sum_j a_j dL(x)[g_j(x)] = 0   for all x,      sum_j a_j g_j(x) = 0  on what is held.

The space of such ``a`` is the null space of a matrix with one row for each of a number of random states.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from forms.symmetry import AXES, Matrix, cross, left, right
from rodfem import compat
from rodfem.ends import Ring
from rodfem.equations import Equations
from rodfem.fields import Block, Fields
from rodfem.scene import Scene

EXACT = 1e-9
"""A combination of generators that changes the functional by less than this, relative, does not change it."""


@dataclass(frozen=True)
class Elementary:
    """A generator of one target (a field or a group of scalars): ``change = matrix value + constant``."""

    target: str
    matrix: Matrix
    constant: tuple[float, ...]


@dataclass(frozen=True)
class Symmetry:
    """A combination of elementary generators."""

    weights: np.ndarray
    parts: tuple[Elementary, ...]

    def change(self, fields: Fields) -> np.ndarray:
        """Change of the state that ``fields.u`` holds: local values, consistent on all ranks; zero for the load."""
        out = np.zeros(len(fields.u.x.array))
        for target, (matrix, constant) in self._targets.items():
            add_change(fields, target, matrix, constant, out)
        return out

    @cached_property
    def _targets(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Sum of all parts with a weight, for each target."""
        out: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for weight, part in zip(self.weights, self.parts, strict=True):
            if weight:
                matrix, constant = out.get(part.target, (0.0, 0.0))
                out[part.target] = (
                    matrix + weight * np.array(part.matrix),
                    constant + weight * np.array(part.constant),
                )
        return out


@dataclass(frozen=True)
class Shift:
    """The motion of a uniform ring along itself: every field's derivative in arclength.

    A mesh has this symmetry only up to its error: what is a zero eigenvalue of the rod is a very small one of the mesh.
    """

    def change(self, fields: Fields) -> np.ndarray:
        """Derivative of the state that ``fields.u`` holds: local values, consistent on all ranks; zero for scalars."""
        u, kept = fields.u, fields.u.x.array.copy()
        out, count = np.zeros(len(kept)), np.zeros(len(kept))
        for block in fields.blocks:
            dofs = fields.dofs[block.name]
            np.add.at(out, dofs.ravel(), self._slopes(fields, block).ravel())
            np.add.at(count, dofs.ravel(), 1.0)
        u.x.array[:] = out / np.maximum(count, 1.0)
        u.x.scatter_forward()
        change = u.x.array.copy()
        u.x.array[:] = kept
        change[fields.number < 0] = 0.0
        return change

    def mismatch(self, fields: Fields) -> float:
        """Greatest jump between elements of the rotation's derivative: how far the mesh is from the symmetry."""
        block = next(b for b in fields.blocks if b.name == fields.turning.name)
        dofs, slopes = fields.dofs[block.name].ravel(), self._slopes(fields, block).ravel()
        low, high = np.full(len(fields.number), np.inf), np.full(len(fields.number), -np.inf)
        np.minimum.at(low, dofs, slopes)
        np.maximum.at(high, dofs, slopes)
        return float(fields.comm.allreduce((high - low)[dofs].max(), op=MPI.MAX))

    @staticmethod
    def _slopes(fields: Fields, block: Block) -> np.ndarray:
        """Derivative in arclength of a field at the nodes of each cell, (cells, nodes, components)."""
        size = (fields.vertices[:, 1] - fields.vertices[:, 0])[:, None, None]
        values = fields.u.x.array[fields.dofs[block.name]].real
        return np.asarray(np.einsum("pn,cni->cpi", differentiation(compat.nodes(block.degree)), values) / size)


def differentiation(nodes: np.ndarray) -> np.ndarray:
    """Matrix of the derivative of the polynomial through values at ``nodes``, at the nodes: (m, m)."""
    powers = np.vander(2 * nodes - 1, increasing=True)
    slopes = np.zeros_like(powers)
    slopes[:, 1:] = 2 * powers[:, :-1] * np.arange(1, len(nodes))
    return np.asarray(slopes @ np.linalg.inv(powers))


def is_uniform_ring(scene: Scene) -> bool:
    """Whether a scene is a closed rod that is the same all along, so that it may move along itself."""
    return isinstance(scene.ends, Ring) and not scene.depends_on_s() and not scene.joints and not scene.constraints


def elementary_generators(fields: Fields) -> tuple[Elementary, ...]:
    """All elementary generators of the fields and groups of scalars that a scene has."""
    vectors = {"n", "a", "b", "ma", "mb"} & {x.group for x in fields.unknown_scalars}
    blocks = {b.name for b in fields.blocks}
    out = []
    sizes = {g: sum(x.group == g for x in fields.unknown_scalars) for g in vectors}
    for axis in AXES:
        if fields.scene.normal is None:
            out += [Elementary("q", m(axis), (0.0,) * 4) for m in (left, right)]
        elif axis == AXES[fields.scene.normal]:
            out.append(Elementary("angle", ((0.0,),), (1.0,)))
        for target in sorted(vectors | ({"r", "n"} & blocks)):
            if target in ("ma", "mb") and sizes[target] == 2:
                continue
            out.append(Elementary(target, cross(axis), (0.0,) * 3))
            if target in ("r", "a", "b"):
                out.append(Elementary(target, ((0.0,) * 3,) * 3, axis))
    count = sum(x.group == "g" for x in fields.unknown_scalars)
    for i in range(count):  # multipliers of constraints may turn into each other
        for j in range(i):
            turn = np.zeros((count, count))
            turn[i, j], turn[j, i] = 1.0, -1.0
            out.append(Elementary("g", tuple(map(tuple, turn)), (0.0,) * count))
    for target in sorted(g for g in vectors if g in ("ma", "mb") and sizes[g] == 2):
        out.append(Elementary(target, ((0.0, -1.0), (1.0, 0.0)), (0.0, 0.0)))
    return tuple(out)


def add_change(fields: Fields, target: str, matrix: np.ndarray, constant: np.ndarray, out: np.ndarray) -> None:
    """Add the change ``matrix value + constant`` of one target, at the state that ``fields.u`` holds."""
    u = fields.u.x.array
    load = float(u[fields.copies[0, -1]])
    if target in fields.dofs:
        dofs = fields.dofs[target]
        values = u[dofs]
        if target == "r":
            values = values + fields.lift(fields.coordinates(fields.discretization.degree), load)
        out[dofs] = values @ matrix.T + constant
        return
    members = [(i, x.component) for i, x in enumerate(fields.unknown_scalars) if x.group == target]
    values = np.zeros(len(constant)) if len(members) == len(constant) else _known(fields, target, load, len(constant))
    for i, component in members:
        values[component] = u[fields.copies[0, i]]
    change = matrix @ values + constant
    for i, component in members:
        out[fields.copies[:, i]] += change[component]


def _known(fields: Fields, group: str, load: float, size: int) -> np.ndarray:
    """Values of the components of a group that are no unknowns: known forces, held positions; else zero."""
    scene, values = fields.scene, np.zeros(size)
    c = scene.constants(load)
    if group == "n":
        known = [scene.known_force(i, c) for i in range(3)]
    elif group in ("a", "b"):
        known = scene.sides["ab".index(group)].held(c)
    else:
        return values
    return np.array([0.0 if x is None else float(x) for x in known])


def find_symmetries(fields: Fields, equations: Equations) -> list[Symmetry]:
    """Find a basis of all continuous symmetries; leaves the state that ``fields.u`` holds as it was."""
    parts = elementary_generators(fields)
    u, kept = fields.u.x.array, fields.u.x.array.copy()
    count = len(parts)
    one = np.eye(count)
    moved = np.zeros((count, count))
    rows, held = [], [np.zeros((1, count))]
    residual = np.zeros(len(u))
    for seed in range(count + 6):
        _random_state(fields, kept, seed)
        residual[:] = 0.0
        fem.assemble_vector(residual, equations.residual)
        changes = np.array([Symmetry(row, parts).change(fields) for row in one])
        row = fields.comm.allreduce(changes @ residual, op=MPI.SUM)
        rows.append(row / max(abs(row).max(), 1e-300))
        held.append(changes[:, _held(fields)].T)
        free = changes[:, fields.number >= 0]
        moved += fields.comm.allreduce(free @ free.T, op=MPI.SUM)
    u[:] = kept
    scale = np.sqrt(np.maximum(np.diag(moved), 1e-300))
    local = np.linalg.qr(np.vstack(held), mode="r")
    _, singular, vectors = np.linalg.svd(np.vstack([*rows, *fields.comm.allgather(local)]))
    null = vectors[singular < EXACT * max(singular[0], 1.0)].T
    sizes, combinations = np.linalg.eigh(null.T @ (moved / scale.max() ** 2) @ null)
    basis = simplest(null @ combinations[:, sizes > EXACT])
    return [Symmetry(w, parts) for w in basis.T]


def simplest(basis: np.ndarray) -> np.ndarray:
    """Basis of the same space, columns with a one where all others have a zero: plain rotations and translations."""
    rows = basis.T.copy()
    for i in range(len(rows)):
        column = int(np.argmax(abs(rows[i:]).max(axis=0) > 0.5 * abs(rows[i:]).max()))
        pivot = i + int(np.argmax(abs(rows[i:, column])))
        rows[[i, pivot]] = rows[[pivot, i]]
        rows[i] /= rows[i, column]
        others = np.arange(len(rows)) != i
        rows[others] -= np.outer(rows[others, column], rows[i])
    return np.where(abs(rows) > 1e-9, rows, 0.0).T


def _held(fields: Fields) -> np.ndarray:
    """Local degrees of freedom that an end holds, or that a planar rod does without."""
    dofs = [d.ravel() for d in fields.dofs.values()]
    used = np.unique(np.concatenate(dofs))
    return used[fields.number[used] < 0]


def _random_state(fields: Fields, kept: np.ndarray, seed: int) -> None:
    """Put a random state with a random load into ``fields.u``: the same on any number of ranks, ends held.

    Values are functions of the place along the rod, not of the numbering.  Those of a ring are closed: whether a
    pressure is felt by a translation, say, only shows there; multipliers that close it have no generators of their own.
    """
    rng = np.random.default_rng(seed)
    u = fields.u.x.array
    scene = fields.scene
    for block in fields.blocks:
        x = (fields.coordinates(block.degree) - scene.interval[0]) / scene.length
        a, b, p = rng.normal(size=(3, block.size))
        values = 0.5 * a + 0.5 * b * np.cos(2.1 * x[..., None] + 6.0 * p) + 0.3 * p * x[..., None] ** 2
        if isinstance(scene.ends, Ring) and block.continuous:
            turns = np.pi * (1 if scene.ends.odd and block.name == "q" else 2)
            values = a * np.cos(turns * x[..., None]) + b * np.sin(3 * turns * x[..., None] + 6.0 * p)
            if block.name == "angle":
                first, last = fields.turning.start(scene.start, np.array(scene.interval), scene.interval)
                values = values + (last - first) * x[..., None]
        if block.name == "v":
            values = 0.1 * values + [1.0 if i == 2 else 0.0 for i in scene.free_strains]
        u[fields.dofs[block.name]] = values
    u[fields.number < 0] = kept[fields.number < 0]
    for i in range(len(fields.unknown_scalars)):
        u[fields.copies[:, i]] = rng.normal()
    low, high = sorted(scene.span)
    u[fields.copies[:, -1]] = low + (high - low) * rng.uniform(0.1, 0.9)

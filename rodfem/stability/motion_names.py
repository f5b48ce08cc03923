"""Names of modes of vibration and of soft modes.

A mode of vibration is named after the directors about which the rod turns: bending about one or the other, torsion,
mixed, or without rotation.

A soft mode costs the rod little energy.  Its vector ``v`` of metric norm 1 is named after the first group of generators
``g_j`` of the state in whose span it lies, nearly: its share there is ``b . G^+ b`` with ``G_ij = g_i . M g_j`` and
``b_j = g_j . M v``.  Groups are the rigid motions, turning of the cross-sections about one director, both at once, and
the motion along the rod, the derivative of the state in arclength; a twisted rod, or a helix, turns as it slides.  Any
other vector is named as a mode of vibration.  Symmetries of the state are no part of any generator here.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.state import State
from rodfem.fem.symmetries import Generators, Symmetry, elementary_generators, rigid_motions, summed
from rodfem.fem.system import System
from rodfem.tolerances import TINY

SHARE = 0.9
"""Share of a vector in the span of a group above which it is named after it."""
DEPENDENT = 1e-8
"""Eigenvalue of a Gram matrix of unit vectors below which they are dependent; square of a negligible generator."""
PURE = 0.99
"""Share of the mean square rotation above which a mode is named after one kind of motion."""
RIGID = "rigid motion"
"""Name of what a rod that nothing holds does at no frequency: translations have no rotation to be named after."""
STRAIGHT = "without rotation"
"""Name of a vibration along the rod, or of one in which it moves as a whole."""
LEAST = 1e-5
"""Mean square rotation over that of displacements, by the length, below which there is none but for round-off."""
KINDS = ("bending about d1", "bending about d2", "torsion")

Group = list[tuple[str, PETSc.Vec]]


class MotionNames:
    """Names vectors of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks."""

    def __init__(self, system: System, metric: PETSc.Mat) -> None:
        """Take the elementary generators together that are one motion of space; the load has no part in ``metric``."""
        self.system, self.metric = system, metric
        parts = elementary_generators(system.fields)
        self._turning = {p.name: summed(parts, [p is q for q in parts]) for p in parts if p.name.startswith("turning")}
        self._rigid = rigid_motions(parts)
        self._along = Symmetry(np.zeros(len(parts)), parts, along=1.0)
        sliding = "slipping along itself" if system.scene.closed else "sliding along the rod"
        self._groups = [list(self._turning), list(self._rigid), [sliding]]

    def __call__(self, x: PETSc.Vec, vectors: list[PETSc.Vec]) -> list[str]:
        """Name each of some ``vectors`` of metric norm 1 at the state ``x``."""
        if not vectors:
            return []
        state = self.system.at(x)
        groups = self.generators(x, state)
        return [self._name(state, v, groups) for v in vectors]

    def generators(self, x: PETSc.Vec, state: State) -> tuple[Group, Group, Group]:
        """Turning of the cross-sections, rigid motions, and the motion along the rod at a ``state``, which is ``x``.

        They are of metric norm 1 and across the symmetries of the state, without those that vanish.
        """
        vector = self.system.generators.vector
        turning, rigid, along = (
            [(name, vector(row)) for name, row in zip(group, rows, strict=True)] for group, rows in self.rows(x, state)
        )
        return turning, rigid, along

    def rows(self, x: PETSc.Vec, state: State) -> list[tuple[list[str], np.ndarray]]:
        """The same as names and own rows (number, own rows) of each of the three groups."""
        system, motions = self.system, self._motions.at(state)
        before = self.sum(np.einsum("ij,ij->i", motions, system.weighed(motions)))
        system.set_phase(x)
        for weights in system.phase.broken.values():
            g = weights @ state.generators
            image = system.weighed(g[None])[0]
            motions = motions - np.outer(self.sum(motions @ image) / self.sum(g @ image), g)
        after = self.sum(np.einsum("ij,ij->i", motions, system.weighed(motions)))
        kept = after > DEPENDENT * np.maximum(before, DEPENDENT)
        out, first = [], 0
        for names in self._groups:
            chosen = [first + i for i in range(len(names)) if kept[first + i]]
            rows = motions[chosen] / np.sqrt(after[chosen])[:, None]
            out.append(([names[i - first] for i in chosen], rows))
            first += len(names)
        return out

    def sum(self, own: np.ndarray) -> np.ndarray:
        """Sum over the ranks."""
        return own if self.system.comm.size == 1 else np.asarray(self.system.comm.allreduce(own, op=MPI.SUM))

    @cached_property
    def _motions(self) -> Generators:
        return Generators(self.system, [*self._turning.values(), *self._rigid.values(), self._along])

    def _name(self, state: State, v: PETSc.Vec, groups: tuple[Group, Group, Group]) -> str:
        turning, rigid, along = groups
        for group in (rigid, *([motion] for motion in turning), [*rigid, *turning]):
            share, weights = self.share(v, group)
            if share > SHARE:
                named = abs(weights) > abs(weights).max() / 2
                return " with ".join(name for (name, _), chosen in zip(group, named, strict=True) if chosen)
        if along and self.share(v, [*along, *turning, *rigid])[0] > SHARE:
            return along[0][0]
        return name_of(turning_shares(self.system, state.turned, [v.array_r.real]))

    def share(self, v: PETSc.Vec, group: Group) -> tuple[float, np.ndarray]:
        """Share of ``v`` (metric norm 1) in the span of a group, and the weights of the members in its projection."""
        if not group:
            return 0.0, np.zeros(0)
        images = [self.metric * g for _, g in group]
        gram = np.array([[g.dot(image).real for image in images] for _, g in group])
        b = np.array([v.dot(image).real for image in images])
        return share(gram, b)


def share(gram: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray]:
    """Share of a vector (metric norm 1) in the span of others, and their weights in its projection.

    ``gram`` and ``b`` are the products of those in the metric, with each other and with it.
    """
    weights = np.linalg.pinv(gram, rcond=DEPENDENT, hermitian=True) @ b
    return float(weights @ b), weights


def turning_shares(system: System, turned: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """Shares of the rotations about the three directors in a mode, (3,), summing to one, or to zero without rotation.

    ``turned`` and ``parts``, the real and the imaginary part of the mode, as in :func:`squares`.  Collective.
    """
    columns = np.stack(parts, axis=1)
    square, moved = squares(system, turned, columns).sum(axis=0), displacements(system, columns).sum()
    return of_all(square[None, :], np.array([moved]))[0]


def of_all(squares: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Shares (k, 3) of rotations with these ``squares`` (k, 3), zero if displacements (k,) hide them."""
    every = squares.sum(axis=1)
    return np.asarray(np.where(every > LEAST * moved, 1.0 / np.maximum(every, TINY), 0.0)[:, None] * squares)


def squares(system: System, turned: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Integrals of the squared rotations about the three directors in perturbations, (k, 3); collective.

    ``turned`` (cells, nodes, components) is the rotation field of the state, ``columns`` (n, k) are values of this
    rank's unknowns.  The rotation is the spin ``w = 2 vec(conj(q) dq)`` at the nodes.
    """
    f = system.fields
    cells = slice(0, f.owned_cells)
    size = (f.vertices[cells, 1] - f.vertices[cells, 0])[:, None, None]
    change = system.changes(columns)[:, f.dofs[f.turning.name][cells]]
    turned = turned[cells]
    q, dq = f.turning.quaternion(turned), f.turning.change(turned, change)
    scalar, v, dv = q[..., :1], q[..., 1:], dq[..., 1:]
    across = v[..., [1, 2, 0]] * dv[..., [2, 0, 1]] - v[..., [2, 0, 1]] * dv[..., [1, 2, 0]]  # v x dv
    w = scalar * dv - dq[..., :1] * v - across
    mine = (w**2 * size).sum(axis=(1, 2))
    return np.asarray(mine if system.comm.size == 1 else system.comm.allreduce(mine))


def displacements(system: System, columns: np.ndarray) -> np.ndarray:
    """Integrals of the squared displacements, over the rod's length, in perturbations (k,); collective."""
    f = system.fields
    if "r" not in f.dofs:
        return np.zeros(columns.shape[1])
    cells = slice(0, f.owned_cells)
    size = (f.vertices[cells, 1] - f.vertices[cells, 0])[:, None, None] / system.scene.length**2
    mine = (system.changes(columns)[:, f.dofs["r"][cells]] ** 2 * size).sum(axis=(1, 2, 3))
    return np.asarray(mine if system.comm.size == 1 else system.comm.allreduce(mine))


def name_of(share: np.ndarray) -> str:
    """Name of a motion by its shares: of :data:`KINDS`, ``bending`` (about both), ``mixed``, or :data:`STRAIGHT`."""
    return names_of(share[None, :])[0]


def names_of(shares: np.ndarray) -> list[str]:
    """The same of several motions, (k, 3)."""
    kinds = (*KINDS, "bending", "mixed")
    mixed = np.where(shares[:, 0] + shares[:, 1] > PURE, len(KINDS), len(KINDS) + 1)
    found = [kinds[i] for i in np.where(shares.max(axis=1) > PURE, shares.argmax(axis=1), mixed).tolist()]
    return [STRAIGHT if not share.any() else kind for share, kind in zip(shares, found, strict=True)]

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
from typing import TYPE_CHECKING

import numpy as np
from petsc4py import PETSc

from rodfem.fem.symmetries import Generators, Symmetry, elementary_generators, rigid_motions, summed
from rodfem.problem.functions import derived
from rodfem.tolerances import TINY

if TYPE_CHECKING:
    from rodfem.fem.state import State
    from rodfem.fem.system import System

SHARE = 0.9
"""Share of a vector in the span of a group above which it is named after it."""
DEPENDENT = 1e-8
"""Eigenvalue of a Gram matrix of unit vectors below which they are dependent; square of a negligible generator."""
PURE = 0.99
"""Share of the mean square rotation above which a mode is named after one kind of motion."""
LEAST = 1e-5
"""Mean square rotation over that of displacements, by the length, below which there is none but for round-off."""
RIGID = "rigid motion"
"""Name of what a rod that nothing holds does at no frequency: translations have no rotation to be named after."""
STRAIGHT = "without rotation"
"""Name of a vibration along the rod, or of one in which it moves as a whole."""
KINDS = ("bending about d1", "bending about d2", "torsion")


class MotionNames:
    """Names vectors of the states of one :class:`~rodfem.fem.system.System`; collective over its ranks."""

    def __init__(self, system: System) -> None:
        """Take the elementary generators together that are one motion of space."""
        self.system = system
        parts = elementary_generators(system.fields)
        turning = {p.name: summed(parts, [p is q for q in parts]) for p in parts if p.name.startswith("turning")}
        rigid = rigid_motions(parts)
        sliding = "slipping along itself" if system.scene.closed else "sliding along the rod"
        self.motions = turning | rigid | {sliding: Symmetry(np.zeros(len(parts)), parts, along=1.0)}
        self._turning, self._rigid, self._sliding = list(turning), list(rigid), sliding

    def __call__(self, x: PETSc.Vec, vectors: list[PETSc.Vec]) -> list[str]:
        """Name each of some ``vectors`` of metric norm 1 at the state ``x``."""
        if not vectors:
            return []
        state = self.system.at(x)
        found = self.generators(x, state)
        rows = np.reshape(list(found.values()), (len(found), state.generators.shape[1]))
        gram = self.system.sum(rows @ self.system.weighed(rows).T)
        own = np.array([v.array_r[: rows.shape[1]].real for v in vectors])
        shares = self.system.sum(rows @ self.system.weighed(own).T)
        return [self._name(state, v, list(found), gram, b) for v, b in zip(vectors, shares.T, strict=True)]

    def generators(self, x: PETSc.Vec, state: State) -> dict[str, np.ndarray]:
        """Own rows of each motion at a ``state``, which is ``x``, by name.

        They are of metric norm 1 and across the symmetries of the state, without those that vanish.
        """
        system, motions = self.system, self._generators.at(state)
        before = self.system.sum(np.einsum("ij,ij->i", motions, system.weighed(motions)))
        system.set_phase(x)
        for weights in system.phase.broken.values():
            g = weights @ state.generators
            image = system.weighed(g[None])[0]
            motions = motions - np.outer(self.system.sum(motions @ image) / self.system.sum(g @ image), g)
        after = self.system.sum(np.einsum("ij,ij->i", motions, system.weighed(motions)))
        kept = after > DEPENDENT * np.maximum(before, DEPENDENT)
        return {name: motions[i] / np.sqrt(after[i]) for i, name in enumerate(self.motions) if kept[i]}

    @cached_property
    def _generators(self) -> Generators:
        return Generators(self.system, list(self.motions.values()))

    def _name(self, state: State, v: PETSc.Vec, names: list[str], gram: np.ndarray, b: np.ndarray) -> str:
        """Name of a vector by its products ``b`` with the motions of these ``names``, whose own are ``gram``."""
        for group in (self._rigid, *([name] for name in self._turning), [*self._rigid, *self._turning]):
            places = [names.index(name) for name in group if name in names]
            part, weights = share(gram[np.ix_(places, places)], b[places])
            if part > SHARE:
                chosen = abs(weights) > abs(weights).max() / 2
                return " with ".join(names[i] for i, named in zip(places, chosen, strict=True) if named)
        if self._sliding in names and share(gram, b)[0] > SHARE:
            return self._sliding
        return name_of(self.system, state.turned, v.array_r.real[:, None])


def names_for(system: System) -> MotionNames:
    """The one of a system, whose generators are made once."""
    return derived(system, MotionNames, lambda: MotionNames(system))


def share(gram: np.ndarray, b: np.ndarray) -> tuple[float, np.ndarray]:
    """Share of a vector in the span of others, and weights in its projection, by products in the metric."""
    weights = np.linalg.pinv(gram, rcond=DEPENDENT, hermitian=True) @ b
    return float(weights @ b), weights


def squares(system: System, turned: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Integrals of the squared rotations about the three directors, and displacements, in perturbations, (k, 4).

    ``turned`` (cells, nodes, components) is the rotation field of the state of a ``system``, ``columns`` (n, k) are
    values of this rank's unknowns.  The rotation is the spin ``w = 2 vec(conj(q) dq)`` at the nodes; displacements are
    over the rod's length.  Collective.
    """
    f = system.fields
    cells = slice(0, f.owned_cells)
    size = (f.vertices[cells, 1] - f.vertices[cells, 0])[:, None, None]
    changes, turned = system.changes(columns), turned[cells]
    q, dq = f.turning.quaternion(turned), f.turning.change(turned, changes[:, f.dofs[f.turning.name][cells]])
    scalar, v, dv = q[..., :1], q[..., 1:], dq[..., 1:]
    across = v[..., [1, 2, 0]] * dv[..., [2, 0, 1]] - v[..., [2, 0, 1]] * dv[..., [1, 2, 0]]  # v x dv
    w = scalar * dv - dq[..., :1] * v - across
    moved = np.zeros((columns.shape[1], 1))
    if "r" in f.dofs:
        moved = (changes[:, f.dofs["r"][cells]] ** 2 * size / system.scene.length**2).sum(axis=(1, 2, 3))[:, None]
    mine = np.hstack([(w**2 * size).sum(axis=(1, 2)), moved])
    return system.sum(mine)


def name_of(system: System, turned: np.ndarray, columns: np.ndarray) -> str:
    """Name of one motion by the perturbations (n, k) that span it: see :func:`squares`."""
    return names_of(squares(system, turned, columns).sum(axis=0)[None])[0]


def names_of(squares: np.ndarray) -> list[str]:
    """Names of motions by their ``squares`` (k, 4): of :data:`KINDS`, ``bending``, ``mixed``, or :data:`STRAIGHT`."""
    rotation, moved = squares[:, :3], squares[:, 3]
    every = rotation.sum(axis=1)
    shares = rotation / np.maximum(every, TINY)[:, None]
    mixed = np.where(shares[:, 0] + shares[:, 1] > PURE, "bending", "mixed")
    kinds = np.where(shares.max(axis=1) > PURE, np.array(KINDS)[shares.argmax(axis=1)], mixed)
    return [str(name) for name in np.where(every > LEAST * moved, kinds, STRAIGHT)]

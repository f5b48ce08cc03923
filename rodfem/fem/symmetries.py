r"""The continuous symmetries of a scene: infinitesimal motions of its state.

A rigid motion of space or of the cross-sections changes each field and group of scalars by one of a few elementary
generators ``g_j`` (:mod:`rodfem.forms.symmetry`), linear or constant in its values; the motion of a closed rod along
itself changes each field by its derivative in arclength.  A symmetry is a combination of them that carries equilibria
into equilibria (:mod:`rodfem.fem.invariance` finds those of a scene, :mod:`rodfem.fem.verification` verifies them at
each state).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI

from rodfem.fem.values import NodalValues
from rodfem.forms.symmetry import AXES, Matrix, cross, left, right
from rodfem.linalg.matrices import times
from rodfem.problem.contribution import Motion
from rodfem.problem.scene import Scene

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields

SYMMETRIC_STATE = 1e-4
"""A generator smaller than this (in the metric) is zero: the state has the symmetry itself.

Where symmetries are found an imperfection is round-off that is 1e-12 of the stiffest strain's terms: 1e-8 beside a
twist 1e4 times as stiff as bending.  At a state that it moves by 1e-8/mu, the eigenvalue mu of that motion is not zero:
it is counted as it is down to 1e-8/SYMMETRIC_STATE.  At states that it moves farther the symmetry is verified
(:mod:`rodfem.fem.verification`) to the round-off of its eigenvalue, and dropped.
"""
NAMED = 1e-3
"""Weight of a part, relative to the greatest, above which it is named."""


@dataclass(frozen=True)
class Elementary:
    """A generator of one ``target`` (a field or a group of scalars): ``change = matrix value + constant``.

    ``name`` is that of the motion, in words.
    """

    target: str
    matrix: Matrix
    constant: tuple[float, ...]
    name: str


@dataclass(frozen=True)
class Symmetry:
    """A combination of elementary generators, and ``along`` times the motion of a closed rod along itself.

    A mesh has a symmetry with the latter only up to its error: what is a zero eigenvalue of the rod is a very small one
    of the mesh.
    """

    weights: np.ndarray
    parts: tuple[Elementary, ...]
    along: float = 0.0

    def change(self, state: NodalValues) -> np.ndarray:
        """Change of a state: local values, consistent on all ranks; zero for the load."""
        out = self.along * derivative(state) if self.along else np.zeros(len(state.local))
        for target, (matrix, constant) in self._targets.items():
            add_change(state, target, matrix, constant, out)
        return out

    def linear(self, fields: Fields) -> sp.csr_matrix:
        """``A`` of the change ``A x + c`` between local degrees of freedom, scalars once."""
        rows, columns, values = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros(0)]
        for target, (matrix, _) in self._targets.items():
            if target in fields.dofs:
                dofs = np.unique(fields.dofs[target].reshape(-1, len(matrix)), axis=0)
                places = list(enumerate(dofs.T))
            else:
                members = [(i, x.component) for i, x in enumerate(fields.unknown_scalars) if x.group.name == target]
                places = [(component, fields.copies[:1, i]) for i, component in members]
            for i, row in places:
                for j, column in places:
                    if matrix[i, j]:
                        rows.append(row)
                        columns.append(column)
                        values.append(np.full(len(row), matrix[i, j]))
        where = (np.concatenate(rows), np.concatenate(columns))
        linear = sp.csr_matrix((np.concatenate(values), where), shape=(len(fields.number),) * 2)
        return linear + self.along * fields.arclength.derivative if self.along else linear

    def __str__(self) -> str:
        """In words what moves: the names of the parts, the rotations and translations of other fields left out."""
        parts = [p for p, w in zip(self.parts, self.weights, strict=True) if abs(w) > NAMED * abs(self.weights).max()]
        names = list(dict.fromkeys(p.name for p in parts if p.name))
        if self.along:
            names.insert(0, "motion along itself")
        return " with ".join(names) or "change of multipliers"

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


# --- the motion of a closed rod along itself ------------------------------------------------------------------------


def derivative(state: NodalValues) -> np.ndarray:
    """Derivative in arclength of a state, local values, the mean of elements at nodes; zero for scalars."""
    return np.asarray(state.fields.scattered(state.fields.arclength.derivative @ state.local))


def mismatch(state: NodalValues) -> float:
    """Greatest jump between elements of the derivative of rotation or centreline.

    It measures how far the mesh is from the invariance under the motion along itself.
    """
    worst = float(abs(times(state.fields.arclength.jumps, state.local)).max(initial=0.0))
    comm = state.fields.comm
    return worst if comm.size == 1 else float(comm.allreduce(worst, op=MPI.MAX))


def may_slide(scene: Scene) -> bool:
    """Whether nothing but functions of the arclength can keep a closed rod from moving along itself."""
    at_points = scene.attachments or any(x.s is not None for x in scene.constraints)
    return scene.closed and not at_points


# --- elementary generators ------------------------------------------------------------------------------------------


def elementary_generators(fields: Fields) -> tuple[Elementary, ...]:
    """All elementary generators of a scene's fields and groups of scalars; translations are by its natural length."""
    groups = {group.name: group for group in fields.groups}
    vectors = [name for name, group in groups.items() if group.motion in (Motion.VECTOR, Motion.POSITION)]
    moved = ["r", *(name for name, group in groups.items() if group.motion is Motion.POSITION)]
    out, length = [], fields.scene.units.length
    for i, axis in enumerate(AXES, start=1):
        turn = f"rotation about e{i}"
        if fields.scene.normal is None:
            out.append(Elementary("q", left(axis), (0.0,) * 4, turn))
            out.append(Elementary("q", right(axis), (0.0,) * 4, f"turning of the cross-sections about d{i}"))
        elif axis == AXES[fields.scene.normal]:
            out.append(Elementary("angle", ((0.0,),), (1.0,), turn))
        for target in sorted([*vectors, *(b.name for b in fields.blocks if b.name in ("r", "n"))]):
            out.append(Elementary(target, cross(axis), (0.0,) * 3, ""))
            if target in moved:
                out.append(
                    Elementary(target, ((0.0,) * 3,) * 3, tuple(x * length for x in axis), f"translation along e{i}")
                )
    out += _of_strains(fields)
    for name in sorted(name for name, group in groups.items() if group.motion is Motion.MIXED):
        count = len(fields.groups[groups[name]])
        for i in range(count):
            for j in range(i):
                turned = np.zeros((count, count))
                turned[i, j], turned[j, i] = 1.0, -1.0
                out.append(Elementary(name, tuple(map(tuple, turned)), (0.0,) * count, ""))
    return tuple(out)


def _of_strains(fields: Fields) -> list[Elementary]:
    """Changes of the strains that are unknowns by turnings of the cross-sections of a rod in space, about each axis.

    A strain that the rod constrains is zero, a stretch one.
    """
    free = list(fields.scene.free_strains)
    if not free or fields.scene.normal is not None:
        return []
    turned, constrained = np.array([cross(axis) for axis in AXES])[:, free], np.array([0.0, 0.0, 1.0])
    constrained[free] = 0.0
    changed = [(x[:, free], x @ constrained) for x in turned]
    return [Elementary("v", tuple(map(tuple, A)), tuple(c), "") for A, c in changed if A.any() or c.any()]


def rigid_motions(parts: tuple[Elementary, ...]) -> dict[str, Symmetry]:
    """Rotation about, and translation along, each axis of space, by name: sums of elementary generators of all fields.

    Those of which the rod of a plane is not capable are without any part.
    """
    out = {}
    for i, axis in enumerate(AXES, start=1):
        turn, move = f"rotation about e{i}", f"translation along e{i}"
        out[turn] = summed(parts, [p.matrix in (left(axis), cross(axis)) or p.name == turn for p in parts])
        out[move] = summed(parts, [p.name == move for p in parts])
    return out


def capable(fields: Fields) -> list[Symmetry]:
    """Rigid motions of space of which the rod is capable: rotations by radian, translations by its natural length."""
    motions = rigid_motions(elementary_generators(fields)).values()
    return [motion for motion in motions if motion.weights.any()]


def summed(parts: tuple[Elementary, ...], chosen: list[bool]) -> Symmetry:
    """Sum of the ``chosen`` of some elementary generators."""
    return Symmetry(np.array(chosen, dtype=float), parts)


def add_change(state: NodalValues, target: str, matrix: np.ndarray, constant: np.ndarray, out: np.ndarray) -> None:
    """Add ``matrix value + constant`` to ``out`` for one ``target`` of a ``state``, a field or a group of scalars."""
    fields = state.fields
    if target in fields.dofs:
        dofs, values = fields.dofs[target], state.values(target)
        if target == "r":
            values = values + fields.lift(fields.coordinates(fields.discretization.degree), state.constants())
        out[dofs] += values @ matrix.T + constant  # of dofs that cells share, once: the sum is buffered
        return
    members = [(i, x) for i, x in enumerate(fields.unknown_scalars) if x.group.name == target]
    values = np.zeros(len(constant))
    if len(members) != len(constant) and (known := members[0][1].group.known):
        values[:] = [0.0 if x is None else float(x) for x in known(state.constants())]
    for i, x in members:
        values[x.component] = state.local[fields.copies[0, i]]
    change = matrix @ values + constant
    for i, x in members:
        out[fields.copies[:, i]] += change[x.component]

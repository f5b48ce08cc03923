r"""The continuous symmetries of a scene: infinitesimal motions of its state, and phase conditions.

A rigid motion of space or of the cross-sections changes each field and group of scalars by one of a few elementary
generators ``g_j`` (:mod:`rodfem.forms.symmetry`), linear or constant in its values; the motion of a closed rod along
itself changes each field by its derivative in arclength.  A symmetry is a combination of them that carries equilibria
into equilibria (:mod:`rodfem.fem.invariance` finds those of a scene).

The symmetries form a linear space.  Those combinations ``g`` of their generators that vanish at a reference state
``x0`` are its own symmetries and have no phase condition.  The others, orthonormal in the metric ``M``, have one each,

    g . M (x - x0) = 0,

and a drift scalar as its multiplier (Doedel, in: Numerical Continuation Methods for Dynamical Systems, 2007, ch. 1).

Its force is ``M g``, but for a rod that nothing holds under loads without a potential.  There ``S`` is not symmetric,
its left null vectors are others than the generators, and the bordered matrix is singular where ``M g`` is in the range
of ``S``: under a thrust that follows its end, against dead loads, a tilted rod is at rest but for a force across it,
``S v = -d M g``.  Forces of drifts are ``M (g + sum_j w_j m_j)`` there, with generic weights ``w`` of all rigid
motions ``m``, of metric norm one: the drifts vanish at an equilibrium, whatever the forces are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.state import LOAD, NodalValues
from rodfem.forms.symmetry import AXES, Matrix, cross, left, right
from rodfem.linalg.matrices import block_matrix, times
from rodfem.problem.unknowns import Motion

if TYPE_CHECKING:
    from rodfem.fem.fields import Fields
    from rodfem.fem.state import Line, State
    from rodfem.fem.system import System
    from rodfem.problem.scene import Scene

SYMMETRIC_STATE = 1e-4
"""A generator smaller than this (in the metric) is zero: the state has the symmetry itself.

Where symmetries are found an imperfection is round-off that is 1e-12 of the stiffest strain's terms: 1e-8 relative to a
twist 1e4 times as stiff as bending.  At a state that it moves by 1e-8/mu, the eigenvalue mu of that motion is not zero:
it is counted as it is down to 1e-8/SYMMETRIC_STATE.
"""


@dataclass(frozen=True)
class Elementary:
    """A generator, with its name in words, of a field or a group of scalars: ``change = matrix value + constant``."""

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
        size = len(fields.number), len(fields.number)
        out = self.along * fields.derivative if self.along else sp.csr_matrix(size)
        for target, (matrix, _) in self._targets.items():
            if target in fields.dofs:
                dofs = np.unique(fields.dofs[target].reshape(-1, len(matrix)), axis=0)
            else:
                members = _members(fields, target)
                dofs, matrix = fields.copies[:1, [*members.values()]], matrix[np.ix_([*members], [*members])]
            out = out + block_matrix(np.broadcast_to(matrix, (len(dofs), *matrix.shape)), dofs, dofs, size)
        out.eliminate_zeros()
        return out

    def __str__(self) -> str:
        least = 1e-3 * abs(self.weights).max()  # less of a part is not named
        parts = [p for p, w in zip(self.parts, self.weights, strict=True) if abs(w) > least]
        names = list(dict.fromkeys(p.name for p in parts if p.name))
        return " with ".join(["motion along itself"] * bool(self.along) + names) or "change of multipliers"

    @cached_property
    def _targets(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Sum of all parts with a weight, for each target."""
        out: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for weight, part in zip(self.weights, self.parts, strict=True):
            if weight:
                matrix, constant = out.get(part.target, (0.0, 0.0))
                matrix = matrix + weight * np.array(part.matrix)
                out[part.target] = matrix, constant + weight * np.array(part.constant)
        return out


def elementary_generators(fields: Fields) -> tuple[Elementary, ...]:
    """All elementary generators of a scene's fields and groups of scalars; translations are by its natural length."""

    def counts(motion: Motion) -> dict[str, int]:
        return {group.name: len(members) for group, members in fields.groups.items() if group.motion is motion}

    positions = {"r", *counts(Motion.POSITION)}
    vectors = [*({"r", "n"} & {*fields.dofs}), *counts(Motion.VECTOR), *counts(Motion.POSITION)]
    normal, length, out = fields.scene.normal, fields.scene.units.length, list[Elementary]()
    for i, axis in enumerate(AXES, start=1):
        out += _turning(normal, i)
        for target in sorted(vectors):
            out.append(Elementary(target, cross(axis), (0.0,) * 3, ""))
            if target in positions:
                along = tuple(x * length for x in axis)
                out.append(Elementary(target, ((0.0,) * 3,) * 3, along, f"translation along e{i}"))
    if normal is None:
        out += _of_strains(list(fields.scene.free_strains))
    return (*out, *(x for group in sorted(counts(Motion.MIXED).items()) for x in _mixing(*group)))


def _mixing(name: str, count: int) -> list[Elementary]:
    """Rotations in all planes of a group of ``count`` scalars."""
    out = []
    for i, j in zip(*np.tril_indices(count, -1), strict=True):
        turned = np.zeros((count, count))
        turned[i, j], turned[j, i] = 1.0, -1.0
        out.append(Elementary(name, tuple(map(tuple, turned)), (0.0,) * count, ""))
    return out


def _turning(normal: int | None, i: int) -> list[Elementary]:
    """Changes of the rotation by turning about axis ``i`` = 1, 2, 3 of space and of the cross-sections."""
    axis, turn = AXES[i - 1], f"rotation about e{i}"
    if normal is None:
        own = Elementary("q", right(axis), (0.0,) * 4, f"turning of the cross-sections about d{i}")
        return [Elementary("q", left(axis), (0.0,) * 4, turn), own]
    return [Elementary("angle", ((0.0,),), (1.0,), turn)] if normal == i - 1 else []


def _of_strains(free: list[int]) -> list[Elementary]:
    """Changes of the ``free`` strains by turnings of the cross-sections about each axis."""
    turned, constrained = np.array([cross(axis) for axis in AXES])[:, free], np.array([0.0, 0.0, 1.0])
    constrained[free] = 0.0
    changed = [(x[:, free], x @ constrained) for x in turned]
    return [Elementary("v", tuple(map(tuple, A)), tuple(c), "") for A, c in changed if A.any() or c.any()]


def rigid_motions(parts: tuple[Elementary, ...]) -> dict[str, Symmetry]:
    """Rotation about, and translation along, each axis of space, by name; without parts where a planar rod has none."""
    out = {}
    for i, axis in enumerate(AXES, start=1):
        turn, move = f"rotation about e{i}", f"translation along e{i}"
        out[turn] = summed(parts, [p.matrix in (left(axis), cross(axis)) or p.name == turn for p in parts])
        out[move] = summed(parts, [p.name == move for p in parts])
    return out


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
    members, values = _members(fields, target), np.zeros(len(constant))
    known = fields.unknown_scalars[next(iter(members.values()))].group.known
    if len(members) != len(constant) and known:
        values[:] = [0.0 if x is None else float(x) for x in known(state.constants())]
    for component, i in members.items():
        values[component] = state.local[fields.copies[0, i]]
    change = matrix @ values + constant
    for component, i in members.items():
        out[fields.copies[:, i]] += change[component]


def _members(fields: Fields, group: str) -> dict[int, int]:
    """Number of each unknown scalar of a group, by its component."""
    return {x.component: i for i, x in enumerate(fields.unknown_scalars) if x.group.name == group}


def derivative(state: NodalValues) -> np.ndarray:
    """Derivative in arclength of a state, local values, the mean of elements at nodes; zero for scalars."""
    return np.asarray(state.fields.scattered(state.fields.derivative @ state.local))


def may_slide(scene: Scene) -> bool:
    """Whether nothing but functions of the arclength can keep a closed rod from moving along itself."""
    at_points = scene.attachments or any(x.s is not None for x in scene.constraints)
    return scene.closed and not at_points


class Generators:
    """Changes ``g(x) = A x + c`` of the states of a ``system`` by ``motions``, or by its symmetries."""

    def __init__(self, system: System, motions: Sequence[Symmetry] | None = None) -> None:
        fields = system.fields
        self.system, self.motions = system, system.symmetries if motions is None else list(motions)
        scalars = fields.copies[0] if system.has_scalars else np.zeros(0, int)
        self._rows, self._columns = np.concatenate([fields.free_owned, scalars]), np.flatnonzero(fields.number >= 0)
        self._linear = self._stacked([motion.linear(fields) for motion in self.motions])
        self._line: Line | None = None

    def _stacked(self, every: list[sp.csr_matrix]) -> sp.csr_matrix:
        """Own rows and free columns of matrices between all local degrees of freedom, one below the other."""
        if not every:
            return sp.csr_matrix((0, len(self._columns)))
        size = every[0].shape[0]
        rows = (np.arange(len(every))[:, None] * size + self._rows).ravel()
        return sp.vstack(every, format="csr")[rows][:, self._columns]

    def _constant(self, state: State) -> np.ndarray:
        """``c`` of all generators, (count, own rows): with held ends and known forces it may vary with the load."""
        fields, line = self.system.fields, state.line

        def at(load: float) -> np.ndarray:
            values = NodalValues(self.system.equations, fields.filled({LOAD: load}), line)
            return np.array([motion.change(values)[self._rows] for motion in self.motions])

        if line is not self._line:
            low, high = self.system.scene.span
            found = [at(load) for load in (low, 0.62 * low + 0.38 * high, high)]
            varies = any(np.any(c != found[0]) for c in found)
            self._varies = bool(self.system.comm.allreduce(varies, op=MPI.LOR))
            self._line, self._fixed = line, found[0]
        return at(state.load) if self._varies else self._fixed

    def at(self, state: State) -> np.ndarray:
        """All generators at a state, (count, own rows)."""
        if not self.motions:
            return np.zeros((0, len(self._rows)))
        linear = times(self._linear, state.local[self._columns])
        return linear.reshape(len(self.motions), -1) + self._constant(state)


@dataclass(frozen=True)
class Phase:
    """Phase conditions of one reference state, by the number of their drift scalars.

    ``rows`` are ``M g`` of each active condition, and ``forces`` what one of its drift scalar adds to the equations,
    this rank's rows; ``offsets`` are ``g . M x0``.  ``broken`` has the weights of the generators in each ``g``,
    ``kept`` those of combinations that the ``reference`` has itself.  ``vector`` makes a vector of own rows.
    """

    rows: dict[int, np.ndarray]
    forces: dict[int, np.ndarray]
    offsets: np.ndarray
    broken: dict[int, np.ndarray]
    kept: np.ndarray
    reference: PETSc.Vec | None
    vector: Callable[[np.ndarray], PETSc.Vec]

    @cached_property
    def conditions(self) -> dict[int, PETSc.Vec]:
        """``M g`` of each active condition as a vector."""
        return {i: self.vector(row) for i, row in self.rows.items()}

    @cached_property
    def pushes(self) -> dict[int, PETSc.Vec]:
        """Forces of their drift scalars as vectors."""
        return self.conditions if self.forces is self.rows else {i: self.vector(x) for i, x in self.forces.items()}

    @property
    def count(self) -> int:
        """Number of symmetries that the reference state breaks: as many zero eigenvalues belong to it."""
        return len(self.broken)


def no_phase(system: System) -> Phase:
    """No active condition for any drift scalar of the ``system``."""
    count = len(system.drifts)
    return Phase({}, {}, np.zeros(count), {}, np.eye(count), None, system.new_vector)


def phase_at(system: System, reference: PETSc.Vec) -> Phase:
    """Phase conditions at ``reference`` for the symmetries of the ``system``, which has some."""
    count = len(system.symmetries)
    state: State = system.at(reference)
    images = system.weighed(state.generators)
    combinations, sizes, least = _orthogonal(system, state, system.sum(state.generators @ images.T))
    numbers = [i for i, (size, bound) in enumerate(zip(sizes, least, strict=True)) if size >= bound]
    kept = combinations[[i for i in range(len(sizes)) if i not in numbers]]
    if not numbers:  # a straight rod has all of them itself
        return Phase({}, {}, np.zeros(count), {}, kept, reference.copy(), system.new_vector)
    weights = combinations[numbers] / np.array([sizes[i] for i in numbers])[:, None]
    rows, offsets, own = weights @ images, np.zeros(count), system.fields.free_owned
    offsets[numbers] = rows[:, : len(own)] @ state.local[own]
    conditions = forces = dict(zip(numbers, rows, strict=True))
    if system.rigid is not None:
        forces = dict(zip(numbers, rows + _generic_forces(system, system.rigid, state, numbers), strict=True))
    broken = dict(zip(numbers, weights, strict=True))
    return Phase(conditions, forces, system.sum(offsets), broken, kept, reference.copy(), system.new_vector)


def _generic_forces(system: System, rigid: Generators, state: State, numbers: list[int]) -> np.ndarray:
    """``M sum_j w_j m_j`` at a ``state`` for the drift scalars of these ``numbers``, (count, own rows)."""
    motions = rigid.at(state)
    images = system.weighed(motions)
    sizes = np.sqrt(np.maximum(system.sum(np.einsum("ij,ij->i", motions, images)), 0.0))
    moving = sizes > 0.0
    generic = np.random.default_rng(0).uniform(-0.3, 0.3, (len(system.drifts), len(sizes)))
    return np.asarray((generic[numbers][:, moving] / sizes[moving]) @ images[moving])


def _orthogonal(system: System, state: State, gram: np.ndarray) -> tuple[np.ndarray, list[float], list[float]]:
    """Weights of combinations of the generators at a ``state`` that are orthogonal in the metric, sizes, and bounds."""
    symmetries, count = system.symmetries, len(system.symmetries)
    exact = [i for i, s in enumerate(symmetries) if not s.along]
    squares, combinations = gram.diagonal()[exact], np.eye(count)[exact]
    if len(exact) > 1:
        squares, turn = np.linalg.eigh(gram[np.ix_(exact, exact)])
        combinations[:, exact] = turn.T
    sizes, least = [sqrt(max(x, 0.0)) for x in squares.tolist()], [SYMMETRIC_STATE] * len(exact)
    if symmetries[-1].along:
        # of the motion along itself only what the exact symmetries do not do as well
        rest = np.eye(count)[-1]
        for weights, size in zip(combinations, sizes, strict=True):
            if size >= SYMMETRIC_STATE:
                rest = rest - weights / size**2 * (weights @ gram[:, -1])
        rest = rest / np.linalg.norm(rest)
        # by the difference of the vectors: in the Gram matrix half of the digits cancel
        sizes.append(system.norm(system.new_vector(rest @ state.generators)))
        combinations = np.vstack([combinations, rest])
        # the greatest jump of the derivative between elements: how far the mesh is from the motion along itself
        worst = float(abs(times(state.fields.derivative_jumps, state.local)).max(initial=0.0))
        worst = float(state.fields.comm.allreduce(worst, op=MPI.MAX))
        least.append(max(10.0 * worst, 1e-5))  # as SYMMETRIC_STATE, of what is left over
    return combinations, sizes, least

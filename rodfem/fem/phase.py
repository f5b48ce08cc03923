"""Phase conditions at one state: one for each symmetry of the scene that the state breaks.

The symmetries form a linear space.  Those combinations ``g`` of their generators that vanish at the reference state
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
from functools import cache, cached_property
from math import sqrt
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.symmetries import SYMMETRIC_STATE, Symmetry, mismatch

if TYPE_CHECKING:
    from rodfem.fem.generators import Generators
    from rodfem.fem.state import State
    from rodfem.fem.system import System

ALONG = 1e-5
"""As :data:`SYMMETRIC_STATE`, of the part of a ring's motion along itself that exact symmetries leave over."""
MESH = 10.0
"""Times the mismatch of a mesh with the motion of a ring along itself, below which a generator is the mesh's error."""
SHARE = 0.3
"""Largest weight of a rigid motion of metric norm one in a drift's force, beside the symmetry of the same norm."""


@dataclass(frozen=True)
class Phase:
    """Phase conditions of one reference state, by the number of their drift scalars.

    Attributes
    ----------
    rows
        ``M g`` of each active condition by its drift scalar, this rank's rows.
    forces
        What one of each drift scalar of an active condition adds to the equations, this rank's rows.
    offsets
        ``g . M x0`` for each drift scalar.
    broken
        Weights of the generators in each ``g``.
    kept
        Weights of those combinations that the reference has itself, a row each.
    reference
        ``x0``, None where no condition is active.
    vector
        Makes a vector of own rows.
    """

    rows: dict[int, np.ndarray]
    forces: dict[int, np.ndarray]
    offsets: np.ndarray
    broken: dict[int, np.ndarray]
    kept: np.ndarray
    reference: PETSc.Vec | None
    vector: Callable[[np.ndarray], PETSc.Vec]

    @cached_property
    def conditions(self) -> tuple[PETSc.Vec | None, ...]:
        """``M g`` for each drift scalar as vectors, None where none is active."""
        return tuple(self.vector(self.rows[i]) if i in self.rows else None for i in range(len(self.offsets)))

    @cached_property
    def pushes(self) -> tuple[PETSc.Vec | None, ...]:
        """Forces of the drift scalars as vectors, None where no condition is active."""
        if self.forces is self.rows:
            return self.conditions
        return tuple(self.vector(self.forces[i]) if i in self.rows else None for i in range(len(self.offsets)))

    @property
    def count(self) -> int:
        """Number of symmetries that the reference state breaks: as many zero eigenvalues belong to it."""
        return len(self.broken)

    def belongs_to(self, x: PETSc.Vec) -> bool:
        """Whether ``x`` is the reference state, or no state can have a phase condition."""
        return not len(self.offsets) or (self.reference is not None and bool(self.reference.equal(x)))

    def motions(self, symmetries: list[Symmetry]) -> list[str]:
        """In words the motions that carry the reference state through equivalent ones, one for each condition."""
        out = []
        for weights in self.broken.values():
            sums = sum((w * s.weights for w, s in zip(weights, symmetries, strict=True)), 0.0 * weights[:1])
            along = sum(w * s.along for w, s in zip(weights, symmetries, strict=True))
            out.append(str(Symmetry(sums, symmetries[0].parts, along)))
        return out


class DriftForces:
    """What is added to ``M g`` for each drift scalar of one :class:`~rodfem.fem.system.System`."""

    def __init__(self, system: System, rigid: Generators) -> None:
        """Take the ``rigid`` motions of which the rod of the ``system`` is capable."""
        self.system, self._rigid = system, rigid

    def __call__(self, state: State, numbers: Sequence[int]) -> np.ndarray:
        """``M sum_j w_j m_j`` at a ``state`` for the drift scalars of these ``numbers``, (count, own rows).

        The weights ``w`` are at most :data:`SHARE` and differ from number to number, ``m`` are the rigid motions of
        which the rod is capable, of metric norm one.
        """
        motions, system = self._rigid.at(state), self.system
        images = system.weighed(motions)
        squares = np.einsum("ij,ij->i", motions, images)
        squares = squares if system.comm.size == 1 else system.comm.allreduce(squares, op=MPI.SUM)
        sizes = np.sqrt(np.maximum(squares, 0.0))
        moving = sizes > 0.0
        generic = np.random.default_rng(0).uniform(-SHARE, SHARE, (len(system.drifts), len(sizes)))
        return np.asarray((generic[list(numbers)][:, moving] / sizes[moving]) @ images[moving])


@cache
def _identity(count: int) -> np.ndarray:
    return np.eye(count)


def no_phase(system: System, reference: PETSc.Vec | None = None) -> Phase:
    """No active condition for any drift scalar of the ``system``."""
    count, reference = len(system.drifts), None if reference is None else reference.copy()
    return Phase({}, {}, np.zeros(count), {}, np.eye(count), reference, system.generators.vector)


def phase_at(system: System, reference: PETSc.Vec, dropped: set[int]) -> Phase:
    """Phase conditions at ``reference`` for the symmetries of the ``system``, but for those ``dropped``."""
    symmetries, count = system.symmetries, len(system.symmetries)
    if count == len(dropped):
        return no_phase(system, reference)
    state: State = system.at(reference)
    generators = state.generators
    images = system.weighed(generators)
    gram = generators @ images.T
    if system.comm.size > 1:
        gram = system.comm.allreduce(gram, op=MPI.SUM)
    exact = [i for i, s in enumerate(symmetries) if not s.along and i not in dropped]
    if len(exact) > 1:
        squares, turn = np.linalg.eigh(gram if len(exact) == count else gram[exact][:, exact])
        combinations = np.zeros((len(exact), count))
        combinations[:, exact] = turn.T
    else:
        squares, combinations = gram.diagonal()[exact], _identity(count)[exact]
    sizes, least = [sqrt(max(x, 0.0)) for x in squares.tolist()], [SYMMETRIC_STATE] * len(exact)
    if symmetries[-1].along and count - 1 not in dropped:
        # of the motion along itself only what the exact symmetries do not do as well
        rest = np.eye(count)[-1]
        for weights, size in zip(combinations, sizes, strict=True):
            if size >= SYMMETRIC_STATE:
                rest = rest - weights / size**2 * (weights @ gram[:, -1])
        rest = rest / np.linalg.norm(rest)
        # by the difference of the vectors: in the Gram matrix half of the digits cancel
        sizes.append(system.norm(system.generators.vector(rest @ generators)))
        combinations = np.vstack([combinations, rest])
        least.append(max(MESH * mismatch(state), ALONG))
    numbers = [i for i, (size, bound) in enumerate(zip(sizes, least, strict=True)) if size >= bound]
    if not numbers:  # a straight rod has all of them itself
        return Phase({}, {}, np.zeros(count), {}, combinations, reference.copy(), system.generators.vector)
    weights = combinations[numbers] / np.array([sizes[i] for i in numbers])[:, None]
    rows, offsets = weights @ images, np.zeros(count)
    own = system.fields.free_owned
    offsets[numbers] = rows[:, : len(own)] @ state.local[own]
    if system.comm.size > 1:
        offsets = system.comm.allreduce(offsets, op=MPI.SUM)
    conditions, more = dict(zip(numbers, rows, strict=True)), system.drift_forces
    return Phase(
        conditions,
        dict(zip(numbers, rows + more(state, numbers), strict=True)) if more else conditions,
        offsets,
        dict(zip(numbers, weights, strict=True)),
        combinations[[i for i in range(len(sizes)) if i not in numbers]],
        reference.copy(),
        system.generators.vector,
    )

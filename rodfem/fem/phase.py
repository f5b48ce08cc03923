"""Phase conditions at one state: one for each symmetry of the scene that the state breaks.

The symmetries form a linear space.  Those combinations ``g`` of their generators that vanish at the reference state
``x0`` are its own symmetries and have no phase condition.  The others, orthonormal in the metric ``M``, have one each,

    g . M (x - x0) = 0,

and a drift scalar as its multiplier (Doedel, in: Numerical Continuation Methods for Dynamical Systems, 2007, ch. 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from rodfem.fem.symmetries import Symmetry, mismatch

if TYPE_CHECKING:
    from rodfem.fem.state import State
    from rodfem.fem.system import System

SYMMETRIC_STATE = 1e-6
"""A generator smaller than this (in the metric) is zero: the state has the symmetry itself."""
MESH = 10.0
"""Times the mismatch of a mesh with the motion of a ring along itself, below which a generator is the mesh's error."""


@dataclass(frozen=True)
class Phase:
    """Phase conditions of one reference state, by the number of their drift scalars.

    Attributes
    ----------
    conditions
        ``M g`` for each drift scalar, None where none is active.
    offsets
        ``g . M x0``.
    broken
        Weights of the generators in each ``g``.
    kept
        Weights of those combinations that the reference has itself, a row each.
    reference
        ``x0``, None where no condition is active.
    """

    conditions: tuple[PETSc.Vec | None, ...]
    offsets: tuple[float, ...]
    broken: dict[int, np.ndarray]
    kept: np.ndarray
    reference: PETSc.Vec | None

    @property
    def count(self) -> int:
        """Number of symmetries that the reference state breaks: as many zero eigenvalues belong to it."""
        return len(self.broken)

    def belongs_to(self, x: PETSc.Vec) -> bool:
        """Whether ``x`` is the reference state, or no state can have a phase condition."""
        return not self.conditions or (self.reference is not None and bool(self.reference.equal(x)))

    def motions(self, symmetries: list[Symmetry]) -> list[str]:
        """In words the motions that carry the reference state through equivalent ones, one for each condition."""
        out = []
        for weights in self.broken.values():
            sums = sum((w * s.weights for w, s in zip(weights, symmetries, strict=True)), 0.0 * weights[:1])
            along = sum(w * s.along for w, s in zip(weights, symmetries, strict=True))
            out.append(str(Symmetry(sums, symmetries[0].parts, along)))
        return out


def no_phase(count: int, reference: PETSc.Vec | None = None) -> Phase:
    """No active condition for any of ``count`` drift scalars."""
    return Phase((None,) * count, (0.0,) * count, {}, np.eye(count), None if reference is None else reference.copy())


def phase_at(system: System, reference: PETSc.Vec, dropped: set[int]) -> Phase:
    """Phase conditions at ``reference`` for the symmetries of the ``system``, but for those ``dropped``."""
    symmetries, count = system.symmetries, len(system.symmetries)
    if count == len(dropped):
        return no_phase(count, reference)
    state: State = system.at(reference)
    generators = system.generators.at(state)
    images = system.weighed(generators)
    gram = generators @ images.T
    if system.comm.size > 1:
        gram = system.comm.allreduce(gram, op=MPI.SUM)
    exact = [i for i, s in enumerate(symmetries) if not s.along and i not in dropped]
    squares, turn = np.linalg.eigh(gram[exact][:, exact])
    combinations, sizes = list((np.eye(count)[:, exact] @ turn).T), list(np.sqrt(np.maximum(squares, 0.0)))
    least = [SYMMETRIC_STATE] * len(exact)
    if symmetries[-1].along and count - 1 not in dropped:
        # of the motion along itself only what the exact symmetries do not do as well
        rest = np.eye(count)[-1]
        for weights, size in zip(combinations, sizes, strict=True):
            if size >= SYMMETRIC_STATE:
                rest = rest - weights / size**2 * (weights @ gram[:, -1])
        combinations.append(rest / np.linalg.norm(rest))
        # by the difference of the vectors: in the Gram matrix half of the digits cancel
        sizes.append(system.norm(system.generators.vector(combinations[-1] @ generators)))
        least.append(max(MESH * mismatch(state), 10 * SYMMETRIC_STATE))
    active = np.array(sizes) >= least
    conditions, offsets, broken = [None] * count, [0.0] * count, {}
    for i in np.flatnonzero(active):
        condition = system.generators.vector(combinations[i] / sizes[i] @ images)
        conditions[i], offsets[i] = condition, state.along(condition)
        broken[int(i)] = combinations[i] / sizes[i]
    return Phase(tuple(conditions), tuple(offsets), broken, np.array(combinations)[~active], reference.copy())

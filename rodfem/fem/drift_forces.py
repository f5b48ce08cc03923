"""Forces of the drift scalars of a rod that floats under loads without a potential: see :mod:`rodfem.fem.phase`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

if TYPE_CHECKING:
    from rodfem.fem.generators import Generators
    from rodfem.fem.state import State
    from rodfem.fem.system import System

SHARE = 0.3
"""Largest weight of a rigid motion of metric norm one in a drift's force, beside the symmetry of the same norm."""


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

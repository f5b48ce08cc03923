"""Counts by dense linear algebra: numpy and the assembled matrices of a state, no phase conditions, no factors.

With ``K`` and ``C`` the blocks of the saddle matrix, and ``Z`` a basis of the null space of ``C^t`` by a singular value
decomposition, the index is the number of negative eigenvalues of ``Z^t K Z``.  All is scaled to unit rows before, which
changes no sign.  Eigenvalues are relative to the metric, in which strains have a small part, and to the lowest one of
bending.
"""

from typing import Any

import numpy as np
from scipy.linalg import eigh

from rodfem.fem.system import System
from rodfem.linalg.matrices import gathered
from rodfem.stability.pencil import assemble_pencil

RANK = 1e-11
"""A singular value of the scaled constraints below this, relative to the largest, is zero."""
NEARLY = 1e-9
"""The same, below which constraints may be dependent: a straight rod that cannot stretch, between ends that stay."""
STRAINS = 1e-3
"""Weight of strains, which are not in the metric, relative to what is."""
ROUND_OFF = 1e-14
"""Error of an eigenvalue, relative to the largest one."""
FLOOR = 1e-13
"""Part of the largest entry of the metric that is added where round-off makes it indefinite."""
SWEEPS = 8
"""Scalings of rows and columns (Ruiz 2001), each of which halves the exponents of what is left."""


class Oracle:
    """Eigenvalues of a system's states, on every rank alike."""

    dependent = False
    """Whether the constraints of the last state are nearly dependent."""
    noise: Any = 0.0
    """Round-off of each eigenvalue of the last state."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.matrix, self.mass = system.state_matrix(), system.metric_matrix()
        f = system.fields
        fields = [f.number[f.dofs[b.name]].ravel() for b in f.blocks if b.multiplier]
        mine = np.unique(np.concatenate([np.zeros(0, int), *fields]))
        every = np.concatenate(system.comm.allgather(mine[mine >= 0]))
        scalar = [f.scalars[x.name] for x in f.unknown_scalars if x.multiplier]
        self.constraints = np.unique(np.append(every, scalar).astype(int))
        none = [f.scalars["load"], *system.drifts]
        self.state = np.setdiff1d(np.arange(f.unknowns), np.append(self.constraints, none))

    def eigenvalues(self, x: Any) -> np.ndarray:
        """Eigenvalues of ``K`` on the null space of ``C^t`` at the state ``x``, ascending, and their ``noise``."""
        assemble_pencil(self.system, x, self.matrix, self.mass)
        S, G = (gathered(a).toarray() for a in (self.matrix, self.system.metric))
        d = scaling(S, np.append(self.state, self.constraints))
        K, C = ((d[:, None] * S * d)[np.ix_(self.state, of)] for of in (self.state, self.constraints))
        G = (d[:, None] * G * d)[np.ix_(self.state, self.state)]
        u, s, _ = np.linalg.svd(C)
        self.dependent = bool(s.size and s[-1] < NEARLY * s[0])
        Z = u[:, int((s > RANK * s[0]).sum()) :] if s.size else np.eye(len(K))
        size = np.diag(G)
        inside = Z.T @ (G + STRAINS * np.diag(np.where(size == 0, size[size > 0].mean(), 0.0))) @ Z
        K = Z.T @ (K + K.T) / 2 @ Z
        try:
            mu, vectors = eigh(K, inside)
        except np.linalg.LinAlgError:  # of elements of very different sizes; no metric changes a sign
            mu, vectors = eigh(K, inside + FLOOR * abs(inside).max() * np.eye(len(inside)))
        # vectors have unit size in the metric: a long one has the round-off of K so often
        self.noise = ROUND_OFF * np.maximum(abs(mu).max(), abs(K).max() * (vectors**2).sum(axis=0))
        self.noise /= self.system.stiffness_scale
        return np.asarray(mu / self.system.stiffness_scale)


def scaling(S: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Factors of rows and columns after which the largest entry of each of some ``rows`` is one."""
    d = np.ones(len(S))
    for _ in range(SWEEPS):
        largest = abs(d[:, None] * S * d).max(axis=1)
        d[rows] /= np.sqrt(np.where(largest > 0, largest, 1.0))[rows]
    return d

"""Counts by dense linear algebra: numpy and the assembled matrices of a state, no phase conditions, no factors.

With ``K`` and ``C`` the blocks of the saddle matrix, and ``Z`` a basis of the null space of ``C^t`` by a singular value
decomposition, the index is the number of negative eigenvalues of ``Z^t K Z``.  All is scaled to unit rows before, which
changes no sign.  Eigenvalues are relative to the metric, in which strains have a small part, and to the lowest one of
bending.
"""

from typing import Any

import numpy as np

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
OF_ENTRIES = 1e-15
"""Round-off of the entries of a matrix."""
FEW = 6
"""Eigenvalues ``omega^2`` whose round-off is measured."""
FLOOR = 1e-13
"""Part of the largest entry of the metric that is added where round-off makes it indefinite."""
SWEEPS = 8
"""Scalings of rows and columns (Ruiz 2001), each of which halves the exponents of what is left."""


class Oracle:
    """Eigenvalues of a system's states, on every rank alike."""

    dependent = False
    """Whether the constraints of the last state are nearly dependent."""
    noise: Any = 0.0
    """Round-off of the eigenvalues of the last state, of all or of each."""

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
        K, Z, G, _ = self._reduced(x)
        inside = Z.T @ G @ Z
        try:
            L = np.linalg.cholesky(inside)
        except np.linalg.LinAlgError:  # of elements of very different sizes; no metric changes a sign
            L = np.linalg.cholesky(inside + FLOOR * abs(inside).max() * np.eye(len(inside)))
        K = Z.T @ (K + K.T) / 2 @ Z
        half = np.linalg.solve(L, K)
        full = np.linalg.solve(L, half.T)
        mu, w = np.linalg.eigh((full + full.T) / 2)
        vectors = np.linalg.solve(L.T, w)  # of unit size in the metric: a long one has the round-off of K so often
        self.noise = ROUND_OFF * np.maximum(abs(mu).max(), abs(K).max() * (vectors**2).sum(axis=0))
        self.noise /= self.system.stiffness_scale
        return mu / self.system.stiffness_scale

    def squares(self, x: Any) -> np.ndarray:
        """Finite eigenvalues ``omega^2`` of a rod under loads without a potential, by their distance from zero.

        ``noise`` is the largest difference, relative to it or to one unit, of one of the first few with other shifts.
        Those that the round-off of ``K`` cannot tell from zero, whatever the shift, are zero.
        """
        K, Z, _, M = self._reduced(x)
        unit = self.system.scene.units.omega2
        found = []
        for shift in (10.0 * unit, 7.0 * unit, 4.0 * unit):
            inverse, w = np.linalg.eig(np.linalg.solve(Z.T @ (K + shift * M) @ Z, Z.T @ M @ Z))
            finite = abs(inverse) > 1e-9 * abs(inverse).max()
            values, vectors = 1.0 / inverse[finite] - shift, Z @ w[:, finite]
            entries = (abs(vectors) * (abs(K) @ abs(vectors))).sum(axis=0)
            kinetic = abs((vectors.conj() * (M @ vectors)).sum(axis=0))
            values[abs(values) * kinetic <= OF_ENTRIES * entries] = 0.0
            found.append(values[np.argsort(abs(values))])
        first, *others = found
        few, size = first[:FEW, None], np.maximum(abs(first[:FEW]), unit)
        self.noise = max(float((abs(few - other).min(axis=1) / size).max(initial=0.0)) for other in others)
        return first

    def _reduced(self, x: Any) -> tuple[np.ndarray, ...]:
        """Scaled ``K``, ``Z``, metric with a part of the strains, and kinetic metric."""
        assemble_pencil(self.system, x, self.matrix, self.mass)
        S, M, G = (gathered(a).toarray() for a in (self.matrix, self.mass, self.system.metric))
        d = scaling(S, np.append(self.state, self.constraints))
        K, C = ((d[:, None] * S * d)[np.ix_(self.state, of)] for of in (self.state, self.constraints))
        G, M = ((d[:, None] * a * d)[np.ix_(self.state, self.state)] for a in (G, M))
        u, s, _ = np.linalg.svd(C)
        self.dependent = bool(s.size and s[-1] < NEARLY * s[0])
        Z = u[:, int((s > RANK * s[0]).sum()) :] if s.size else np.eye(len(K))
        size = np.diag(G)
        return K, Z, G + STRAINS * np.diag(np.where(size == 0, size[size > 0].mean(), 0.0)), M


def scaling(S: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Factors of rows and columns after which the largest entry of each of some ``rows`` is one."""
    d = np.ones(len(S))
    for _ in range(SWEEPS):
        largest = abs(d[:, None] * S * d).max(axis=1)
        d[rows] /= np.sqrt(np.where(largest > 0, largest, 1.0))[rows]
    return d

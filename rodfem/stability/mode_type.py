"""Type of a mode of vibration: bending about one director or the other, torsion, mixed, or without rotation."""

from __future__ import annotations

import numpy as np

from rodfem.fem.system import System
from rodfem.tolerances import TINY

PURE = 0.99
"""Share of the mean square rotation above which a mode is named after one kind of motion."""
RIGID = "rigid motion"
"""Name of what a rod that nothing holds does at no frequency: translations have no rotation to be named after."""
STRAIGHT = "without rotation"
"""Name of a vibration along the rod, or of one in which it moves as a whole."""
LEAST = 1e-5
"""Mean square rotation over that of displacements, by the length, below which there is none but for round-off."""
KINDS = ("bending about d1", "bending about d2", "torsion")


def shares(system: System, turned: np.ndarray, parts: list[np.ndarray]) -> np.ndarray:
    """Shares of the rotations about the three directors in a mode, (3,), summing to one, or to zero without rotation.

    Collective.  ``turned`` and ``parts``, the real and the imaginary part of the mode, as in :func:`squares`.
    """
    columns = np.stack(parts, axis=1)
    square, moved = squares(system, turned, columns).sum(axis=0), displacements(system, columns).sum()
    return of_all(square[None, :], np.array([moved]))[0]


def of_all(squares: np.ndarray, moved: np.ndarray) -> np.ndarray:
    """Shares (k, 3) of rotations with these ``squares`` (k, 3), zero where they are none beside displacements (k,)."""
    every = squares.sum(axis=1)
    return np.asarray(np.where(every > LEAST * moved, 1.0 / np.maximum(every, TINY), 0.0)[:, None] * squares)


def squares(system: System, turned: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Integrals of the squared rotations about the three directors in each of some perturbations, (k, 3); collective.

    ``turned`` (cells, nodes, components) is the rotation field of the state, or, with k in front, those of one state
    for each perturbation; ``columns`` (n, k) are the perturbations as values of this rank's unknowns.  The rotation is
    the spin ``w = 2 vec(conj(q) dq)`` at the nodes.
    """
    f = system.fields
    cells = slice(0, f.owned_cells)
    size = (f.vertices[cells, 1] - f.vertices[cells, 0])[:, None, None]
    change = system.changes(columns)[:, f.dofs[f.turning.name][cells]]
    turned = turned[..., cells, :, :]
    q, dq = f.turning.quaternion(turned), f.turning.change(turned, change)
    scalar, v, dv = q[..., :1], q[..., 1:], dq[..., 1:]
    across = v[..., [1, 2, 0]] * dv[..., [2, 0, 1]] - v[..., [2, 0, 1]] * dv[..., [1, 2, 0]]  # v x dv
    w = scalar * dv - dq[..., :1] * v - across
    mine = (w**2 * size).sum(axis=(1, 2))
    return np.asarray(mine if system.comm.size == 1 else system.comm.allreduce(mine))


def displacements(system: System, columns: np.ndarray) -> np.ndarray:
    """Integrals of the squared displacements, over the rod's length, in each of some perturbations (k,); collective.

    They are summed as rotations are: see :func:`squares`.  Without a centreline there are none.
    """
    f = system.fields
    if "r" not in f.dofs:
        return np.zeros(columns.shape[1])
    cells = slice(0, f.owned_cells)
    size = (f.vertices[cells, 1] - f.vertices[cells, 0])[:, None, None] / system.scene.length**2
    mine = (system.changes(columns)[:, f.dofs["r"][cells]] ** 2 * size).sum(axis=(1, 2, 3))
    return np.asarray(mine if system.comm.size == 1 else system.comm.allreduce(mine))


def name(share: np.ndarray) -> str:
    """Name of a motion by its shares: of :data:`KINDS`, ``bending`` (about both), ``mixed``, or :data:`STRAIGHT`."""
    return names(share[None, :])[0]


def names(shares: np.ndarray) -> list[str]:
    """The same of several motions, (k, 3)."""
    kinds = (*KINDS, "bending", "mixed")
    mixed = np.where(shares[:, 0] + shares[:, 1] > PURE, len(KINDS), len(KINDS) + 1)
    found = [kinds[i] for i in np.where(shares.max(axis=1) > PURE, shares.argmax(axis=1), mixed).tolist()]
    return [STRAIGHT if not share.any() else kind for share, kind in zip(shares, found, strict=True)]

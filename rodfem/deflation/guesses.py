"""First guesses: known states turned by smooth rotations that respect the clamps."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.problem.end import TURNS


def turned_state(system: System, base: PETSc.Vec, amplitude: float, seed: list[int]) -> PETSc.Vec:
    """Known state turned by a smooth rotation that respects clamps, its vector of that root mean square size.

    The vector is a random combination of the lowest four waves along the rod that vanish where directors are clamped.
    It depends on the nodes and the seed only, not on how the rod is shared among ranks.  ``base`` is the known state of
    the ``system``, ``amplitude`` the size in radian, ``seed`` that of the random numbers.
    """
    f = system.fields
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(4, 3)) / np.arange(1, 5)[:, None]
    a, b = system.scene.interval
    x = (f.coordinates(f.discretization.degree) - a) / (b - a)
    left, right = (end.fixed_rotation is not None for end in system.scene.sides)
    waves = _waves(x, left, right)
    dense = _waves(np.linspace(0.0, 1.0, 401), left, right)
    size = float(np.sqrt(np.mean(np.sum((dense @ weights) ** 2, axis=-1))))
    state = system.at(base)
    turned = f.turning.turned(state.turned, waves @ weights * (amplitude / size))
    return system.vector(f.filled(state.named | {f.turning.name: turned}))


def turned_over(system: System, base: PETSc.Vec) -> list[PETSc.Vec]:
    """Known state turned as a whole by half a turn about d1, and about d2, where both ends turn freely; else none.

    Waves along the rod never get there: a rod between two pins may hang below the one that it stands on.  Newton's
    method moves the ends to where they are held.  ``base`` is the known state of the ``system``.
    """
    if system.scene.closed or any(end.turning != TURNS for end in system.scene.sides):
        return []
    f, state = system.fields, system.at(base)
    out = []
    for axis in np.eye(3)[:2]:
        vector = np.broadcast_to(np.pi * axis, (*state.turned.shape[:-1], 3))
        out.append(system.vector(f.filled(state.named | {f.turning.name: f.turning.turned(state.turned, vector)})))
    return out


def _waves(x: np.ndarray, left: bool, right: bool) -> np.ndarray:
    """Four waves at ``x`` in [0, 1], (..., 4), that vanish at clamped ends; periodic where none is clamped."""
    k = np.arange(1, 5)
    x = x[..., None]
    if left and right:
        return np.sin(np.pi * k * x)
    if left or right:
        return np.sin(np.pi * (k - 0.5) * (x if left else 1 - x))
    return np.where(k % 2, np.sin(2 * np.pi * ((k + 1) // 2) * x), np.cos(2 * np.pi * ((k + 1) // 2) * x))

r"""Mirror images and reversals: the discrete symmetries that a discretised scene turns out to have.

A reflection or half turn of space is ``S = diag(s1, s2, s3)`` with signs ``s_i``; together with the same reflection of
the directors, and perhaps with a reversal of the rod (``sigma = -1``, otherwise 1), it carries a state to ::

    R -> S R S,   r -> S r,   v -> sigma S v,   k -> sigma det(S) S k,   n -> sigma S n,   eta -> eta,

in quaternions ``(q0, vec q) -> (q0, det(S) S vec q)``, fields being read from the other end where the rod is reversed.
A stretch stays positive only if ``s3 = sigma``, which leaves seven candidates other than the identity.  Whether a scene
has one of them is not asked of the scene but of its equations: with ``F`` their residual and ``T`` the map, ``T`` is a
symmetry of the discrete problem if and only if ``F(T x) . T y = F(x) . y`` for all ``x`` and ``y``.  One smooth state
without any symmetry of its own and one direction decide that to round-off, at the cost of two residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from petsc4py import PETSc

from rodfem.fem.system import System
from rodfem.tolerances import NEGLIGIBLE, SAME_PLACE, same_place


@dataclass(frozen=True)
class Mirror:
    """The map of signs ``s`` = (s1, s2, s3), with a reversal of the rod or not; applies to states of a system."""

    signs: tuple[int, int, int]
    reversal: bool

    def __str__(self) -> str:
        """Return the map in words."""
        words = "diag(" + ", ".join(f"{s:+d}" for s in self.signs) + ")"
        return words + " and reversal of the rod" if self.reversal else words

    def in_words(self) -> str:
        """Say the same for people."""
        axes = [f"e{i + 1}" for i, sign in enumerate(self.signs) if sign < 0]
        kept = [f"e{i + 1}" for i, sign in enumerate(self.signs) if sign > 0]
        words = {1: f"reflection along {axes[0]}", 2: f"half turn about {''.join(kept)}", 3: "inversion"}[len(axes)]
        return words + (", ends exchanged" if self.reversal else "")

    def weights(self, field: str, components: tuple[int, ...], normal: int | None = None) -> np.ndarray:
        """Signs of the components of a field, or of scalar contact forces (``n``); ``normal`` that of the plane."""
        s = np.array(self.signs, dtype=float)
        full = {
            "q": np.concatenate([[1.0], s.prod() * s]),
            "angle": (s.prod() * s)[[normal or 0]],
            "eta": np.ones(1),
            "r": s,
            "v": -s if self.reversal else s,
            "n": -s if self.reversal else s,
        }[field]
        return full[list(components)]

    def __call__(self, system: System, x: PETSc.Vec) -> PETSc.Vec:
        """Image of the state ``x``; drift scalars of the image are zero."""
        f, state = system.fields, system.at(x)
        named = state.named
        for block in f.blocks:
            components = system.scene.free_strains if block.name == "v" else tuple(range(block.size))
            values = state.values(block.name)
            if self.reversal:
                values = _reversed(system, values, block.degree)
            values = values * self.weights(block.name, components, system.scene.normal)
            if block.name == "r" and self.reversal:
                values = values - _misfit(system, values)
            named[block.name] = values
        named |= {f"n{i + 1}": state.scalars[f"n{i + 1}"] * float(self.weights("n", (i,))[0]) for i in f.forces}
        return system.vector(f.filled(named))


def _reversed(system: System, values: np.ndarray, degree: int) -> np.ndarray:
    """Nodal values (cells, nodes, components) of a field as read from the other end of the rod."""
    f = system.fields
    order = np.argsort(f.coordinates(degree)[0])
    here = f.vertices[:, 0].copy()
    gathered = system.comm.allgather((here[: f.owned_cells], values[: f.owned_cells][:, order]))
    starts = np.concatenate([start for start, _ in gathered])
    table = np.concatenate([part for _, part in gathered])[np.argsort(starts)]
    tolerance = SAME_PLACE * system.scene.length
    cell = np.searchsorted(np.sort(starts), here - tolerance)
    out = np.empty_like(values)
    out[:, order] = table[len(starts) - 1 - cell][:, ::-1]
    return out


def _misfit(system: System, values: np.ndarray) -> np.ndarray:
    """Translation (3,) by which a centreline misses the ends at which it is held, left end first."""
    f = system.fields
    x = f.coordinates(f.discretization.degree)
    found = np.zeros((2, 3))
    here = np.zeros((2, 3), dtype=bool)
    for side, s in enumerate(system.scene.interval):
        at_end = same_place(x, s, system.scene.length)
        for number, value in zip(f.number[f.dofs["r"][at_end]], values[at_end], strict=True):
            here[side], found[side] = number < 0, np.where(number < 0, value, 0.0)
    both = system.comm.allgather((here, found))
    shift = np.zeros(3)
    for side in (1, 0):  # the left end has the last word
        for held, value in both:
            shift = np.where(held[side], value[side], shift)
    return shift


def generic_state(system: System, like: PETSc.Vec, amplitude: float, seed: int) -> PETSc.Vec:
    """Add to a state ``like`` smooth changes of all fields, by about ``amplitude``, that no symmetry leaves alone.

    Clamps of the ``system`` are kept; ``seed`` is that of the random numbers.
    """
    f, named, units = system.fields, system.at(like).named, system.scene.units
    rng = np.random.default_rng(seed)
    a, b = system.scene.interval
    for block in f.blocks:
        x, size = (f.coordinates(block.degree) - a) / (b - a), amplitude * units.of_field(block)
        for i in range(block.size):
            waves = enumerate(rng.uniform(0.3, 1.0, (3, 2)), start=1)
            named[block.name][:, :, i] += size * sum(c * np.sin(k * np.pi * x + p) for k, (c, p) in waves)
    for i in f.forces:
        named[f"n{i + 1}"] += amplitude * units.force * rng.uniform(0.3, 1.0)
    return system.vector(f.filled(named))


def candidates(system: System) -> list[Mirror]:
    """Maps that may be symmetries, the identity left out.

    None of a scene with constraints all along the rod: what a mirror does to their multipliers is not known.
    """
    if any(block.along for block in system.fields.blocks):
        return []
    signs = [s for s in product((1, -1), repeat=3) if s != (1, 1, 1)]
    return [Mirror((s1, s2, s3), reversal=s3 < 0) for s1, s2, s3 in signs]


def mirrors(system: System, x: PETSc.Vec, among: Sequence[Mirror] | None = None) -> list[Mirror]:
    """Discrete symmetries of the equations at the load of ``x``, among all :func:`candidates` unless given."""
    among = candidates(system) if among is None else among
    if not among:
        return []
    system.set_phase(None)
    base = generic_state(system, x, 0.2, 1)
    other = generic_state(system, base, 0.2, 2)
    reference, scale = _work(system, base, other)
    works = ((mirror, _work(system, mirror(system, base), mirror(system, other))[0]) for mirror in among)
    return [mirror for mirror, work in works if abs(work - reference) < NEGLIGIBLE * scale]


def _work(system: System, x: PETSc.Vec, y: PETSc.Vec) -> tuple[float, float]:
    """``F(x) . (y - x)``, and the product of the norms in natural sizes."""
    equations, change = system.new_vector(), y - x
    system.at(x).residual(equations)
    scale = system.in_units(equations, 1).norm() * system.in_units(change, -1).norm()
    return float(equations.dot(change)), float(scale)

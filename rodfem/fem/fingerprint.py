"""Numbers that tell whether two scenes state the same rod: files hold no functions.

All equations are evaluated at one smooth state that is no equilibrium, in which every unknown differs from zero.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.fields import LOAD
from rodfem.fem.shape import Shape
from rodfem.fem.system import System

AMPLITUDE = 0.1
"""Size of the waves on top of the undeformed rod, in natural sizes."""
SAME = 1e-9
"""Relative difference of fingerprints that is round-off."""


def fingerprint(system: System) -> list[float | None]:
    """Norm of the residual, stored energy and ordinate at a smooth state, at both ends of the range of the scene.

    Not finite ones are None.  Collective.
    """
    out: list[float] = []
    system.set_phase(None)
    shape, residual = Shape(system), system.new_vector()
    for load in system.scene.span:
        x = _waves(system, load)
        state = system.at(x)
        state.residual(residual)
        out += [residual.norm(), state.energy(), shape.ordinate(x)]
    return [float(value) if np.isfinite(value) else None for value in out]


def same(a: list[float | None], b: list[float | None]) -> bool:
    """Whether two fingerprints are those of one scene."""
    if len(a) != len(b) or any((p is None) != (q is None) for p, q in zip(a, b, strict=True)):
        return False
    known = np.array([(p, q) for p, q in zip(a, b, strict=True) if p is not None and q is not None])
    return bool((abs(known[:, 0] - known[:, 1]) <= SAME * abs(known).max(axis=1)).all())


def _waves(system: System, load: float) -> PETSc.Vec:
    """Undeformed rod with a wave in each component of each field, at a load."""
    fields, scene = system.fields, system.scene
    named = {}
    for block in fields.blocks:
        x = (fields.coordinates(block.degree) - scene.interval[0]) / scene.length
        number = np.arange(1, block.size + 1)
        named[block.name] = np.sin(number + np.multiply.outer(x, number))
    named |= {name: np.sin(number) for number, name in enumerate(fields.scalars, start=1) if name != LOAD}
    start = fields.turning.start(scene.start, fields.coordinates(fields.discretization.degree).ravel(), scene.interval)
    undeformed = np.array([1.0 if i == 2 else 0.0 for i in scene.free_strains])
    rest = {fields.turning.name: start.reshape(*fields.coordinates(fields.discretization.degree).shape, -1)}
    base = fields.filled(rest | {"v": undeformed, LOAD: load})
    return system.vector(base + AMPLITUDE * fields.sizes * np.where(fields.number < 0, 0.0, fields.filled(named)))

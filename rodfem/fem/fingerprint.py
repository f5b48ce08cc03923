"""Numbers that tell whether two scenes state the same rod: files hold no functions.

All equations, and the kinetic metric, are evaluated at one smooth state that is no equilibrium, in which every unknown
differs from zero: at both ends of the range of the scene, and at loads inside, where an imperfection that vanishes at
both ends is seen.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from rodfem.fem.shape import Shape
from rodfem.fem.state import LOAD
from rodfem.fem.system import System
from rodfem.problem.functions import inside

SAME = 1e-9
"""Relative difference of fingerprints that is round-off."""


def fingerprint(system: System, span: tuple[float, float], version: int = 2) -> list[float | None]:
    """Numbers of the equations of a ``system`` at a smooth state, at loads of the range of its scene and of a ``span``.

    First the norm of the residual, stored energy and ordinate at both ends of the range of the scene, which older files
    have alone; then kinetic energy and total potential energy there; then all five at loads inside, and at those of the
    ``span`` if that is another range.  What is not finite, or is not there, is None.  ``version`` is that of
    the file.  Collective.
    """
    system.set_phase(None)
    shape, mass, units = Shape(system), system.metric_matrix(), _units(system, version)
    found = [_numbers(shape, mass, load, units) for load in _loads(system, span)]
    ends, others = found[:2], found[2:]
    out = [values[:3] for values in ends] + [values[3:] for values in ends] + others
    return [float(value) if np.isfinite(value) else None for values in out for value in values]


def same(a: list[float | None], b: list[float | None]) -> bool:
    """Whether two fingerprints are those of one scene; of an older file, which has less, what it has is compared."""
    pairs = list(zip(a, b, strict=False))
    if any((p is None) != (q is None) for p, q in pairs):
        return False
    known = np.array([(p, q) for p, q in pairs if p is not None and q is not None]).reshape(-1, 2)
    return bool((abs(known[:, 0] - known[:, 1]) <= SAME * abs(known).max(axis=1)).all())


def _numbers(shape: Shape, mass: PETSc.Mat, load: float, units: PETSc.Vec) -> list[float]:
    """Residual's norm, stored energy, ordinate, kinetic energy and potential at a load; nan where there is none.

    What a drag dissipates, in the place of a kinetic energy, is negative.  The kinetic metric of the system is written
    into ``mass``; ``shape`` evaluates its states.
    """
    system = shape.system
    x, change = _waves(system, load), system.vector(system.fields.sizes * system.fields.wave())
    x.pointwiseMult(x, units)
    state, residual = system.at(x), system.new_vector()
    state.residual(residual)
    residual.pointwiseMult(residual, units)
    mass.zeroEntries()
    if not system.equations.massless:  # dolfinx has no form of nothing
        state.assemble_into(mass, system.equations.kinetic)
    mass.assemble()
    kinetic = (mass * change).dot(change).real / (2 if system.scene.inertia.order == 2 else -2)
    energy = state.integral(system.equations.potential) if system.equations.potential is not None else float("nan")
    return [residual.norm(), state.energy(), shape.ordinate(x), kinetic, energy]


def _units(system: System, version: int) -> PETSc.Vec:
    """Of each unknown that of a version of the files in today's: moments at ends were twice what they are."""
    ends = [x.name for x in system.fields.unknown_scalars if x.group.moment and x.direction]
    halves = system.fields.filled({name: 0.5 for name in ends if version == 1})
    return system.vector(np.where(halves == 0.0, 1.0, halves))


def _loads(system: System, span: tuple[float, float]) -> list[float]:
    """Loads of the states: those of the range of the scene of a ``system``, then of the ``span`` if it is another."""
    own = system.scene.span
    return [*own, *inside(own)] + ([] if tuple(span) == own else [*span, *inside(span)])


def _waves(system: System, load: float) -> PETSc.Vec:
    """Undeformed rod with a wave in each component of each field, at a load."""
    fields, scene = system.fields, system.scene
    start = fields.turning.start(scene.start, fields.coordinates(fields.discretization.degree).ravel(), scene.interval)
    undeformed = np.array([1.0 if i == 2 else 0.0 for i in scene.free_strains])
    rest = {fields.turning.name: start.reshape(*fields.coordinates(fields.discretization.degree).shape, -1)}
    base = fields.filled(rest | {"v": undeformed, LOAD: load})
    return system.vector(base + 0.1 * fields.sizes * fields.wave())

"""Half-waves along a rod under the loads of a range: whether a mesh can hold them, told before anything is traced.

A rod of bending stiffness B under a compression N has half-waves of the length ``pi sqrt(B / N)``, under a moment M
such of ``pi B / M``.  Where the loads of a range are so large that a mesh has few nodes for each, the index of the
scene's start at that load is counted: one not far from the number of nodes is that of the mesh, not of the rod.
"""

from __future__ import annotations

from math import pi

import numpy as np

from rodfem.continuation.solvers import BranchSolver, StaticSolver
from rodfem.diagram.solver import check_index
from rodfem.problem.roles import functions_of
from rodfem.problem.scene import Scene

FEW = 4
"""Nodes for each half-wave below which the index is counted."""
SMALL = 1e-6
"""Curvature times length of the differences that give the moment of the undeformed rod."""


def check_waves(solver: StaticSolver, span: tuple[float, float]) -> None:
    """Raise :class:`InputError` where a solver's mesh cannot hold the half-waves at an end of a range of loads.

    ``span`` is the range; collective.
    """
    if not isinstance(solver, BranchSolver):
        return
    fields = solver.system.fields
    scene, nodes = fields.scene, fields.discretization.elements * fields.discretization.degree
    for load in span:
        if FEW * half_waves(scene, load) > nodes:
            x, outcome = solver.at_load(solver.start(load), load)
            if outcome.converged:
                check_index(scene, load, solver.inertia.at(x).count().negative, nodes)


def half_waves(scene: Scene, load: float) -> float:
    """Number of half-waves along the rod under its loads at ``load``, as forces and moments given by numbers tell."""
    stiffness, c = scene.stiffness(), scene.constants(load)
    softest = float(np.linalg.eigvalsh(stiffness[-3:, -3:])[0])
    force, moment = 0.0, float(np.linalg.norm(_moment(scene, load)))
    for _, function, role in functions_of(scene):
        if role.load is not None and role.call == "f(c)":
            size = float(np.linalg.norm([float(x) for x in function(c)])) * (scene.length if role.along else 1.0)
            force, moment = (force, moment + size) if role.load.moment else (force + size, moment)
    left, right = (end.held(c) for end in scene.sides)
    if None not in left and None not in right and 2 in scene.free_strains and not scene.closed:
        apart = np.linalg.norm(np.array(right, dtype=float) - np.array(left, dtype=float))
        axial = scene.free_strains.index(2)
        force += abs(float(apart) / scene.length - 1) * float(stiffness[axial, axial])
    return scene.length / pi * max((force / softest) ** 0.5, moment / softest)


def _moment(scene: Scene, load: float) -> np.ndarray:
    """Moment (3,) of the undeformed rod, that of a natural curvature, by differences of the stored energy."""
    c, step = scene.constants(load), SMALL / scene.length
    none = np.zeros(3)
    return np.array(
        [(scene.energy_at(none, step * e, c) - scene.energy_at(none, -step * e, c)) / (2 * step) for e in np.eye(3)]
    )

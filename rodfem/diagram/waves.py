"""Half-waves along a rod under the loads of a range: whether a mesh can hold them, told before anything is traced.

A rod of bending stiffness B under a compression N has half-waves of the length ``pi sqrt(B / N)``, under a moment M
such of ``pi B / M``; a rod whose start is twisted turns its sections.  Where a mesh has few nodes for each half-wave or
half turn, the index of the scene's start is counted: one not far from the number of nodes, or another one than on twice
as many elements, is that of the mesh, not of the rod.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.solver import Solver, check_index
from rodfem.errors import ConvergenceError
from rodfem.problem.roles import functions_of
from rodfem.problem.scene import Scene
from rodfem.stability.dependence import require_independent_constraints

FEW = 4
"""Nodes for each half-wave below which the index is counted."""
BENT = 1e-6
"""Rotation of the first state away from the scene's start, in radian, above which it is not that start."""
SAMPLES = 2001
"""Places along the rod at which the turning of its start is looked at."""
SMALL = 1e-6
"""Curvature times length of the differences that give the moment of the undeformed rod."""


def check_waves(solver: StaticSolver, span: tuple[float, float], warn: Callable[[str], None]) -> None:
    """Compare the index at the ends of a range of loads with that on twice as many elements, where a mesh has few.

    ``span`` is the range, and ``warn`` hears of an index that is the mesh's.  Raises :class:`InputError` where the mesh
    of the ``solver`` cannot hold the half-waves at all.  Collective.
    """
    if not isinstance(solver, BranchSolver):
        return
    fields = solver.system.fields
    scene, mesh = fields.scene, fields.discretization
    nodes, finer = mesh.elements * mesh.degree, None
    for load in span:
        if FEW * half_waves(scene, load) <= nodes or (load != span[0] and _bends(solver, span[0])):
            continue
        index = _index(solver, load)
        if index is None:
            continue
        check_index(scene, load, index, nodes)
        finer = finer or Solver(scene, mesh.finer(2), solver.system.comm).equilibria
        there = _index(finer, load)
        if there not in (None, index):
            warn(
                f"At {scene.load} = {load:g} the index of the first state is {index} on {mesh.elements} elements and "
                f"{there} on {2 * mesh.elements}: indices may be the mesh's; use more elements or a higher degree."
            )


def _bends(solver: BranchSolver, load: float) -> bool:
    """Whether the rod turns away from its start at a ``load``: elsewhere the start is then near no state of its branch.

    A rod of natural curvature that is pushed together bends further, while its start, straight, has dozens of waves.
    """
    system, start = solver.system, solver.start(load)
    x, outcome = solver.at_load(start, load)
    turned = float(abs(system.at(x).turned - system.at(start).turned).max(initial=0.0))
    return outcome.converged and max(system.comm.allgather(turned)) > BENT


def _index(solver: StaticSolver, load: float) -> int | None:
    """Index of the scene's start at a load; None where that leads to no equilibrium.

    Where the count breaks down constraints that depend on one another are named.
    """
    assert isinstance(solver, BranchSolver)
    start = solver.start(load)
    x, outcome = solver.at_load(start, load)
    if not outcome.converged:
        return None
    try:
        return solver.inertia.at(x).count().negative
    except ConvergenceError:
        require_independent_constraints(solver.shape, x, start)
        raise


def half_waves(scene: Scene, load: float) -> float:
    """Number of half-waves along the rod at ``load``: of its loads, as forces and moments given by numbers tell them.

    Or the number of half turns of its start, where those are more.
    """
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
    return max(scene.length / pi * max((force / softest) ** 0.5, moment / softest), _turned(scene) / pi)


def _turned(scene: Scene) -> float:
    """Angle by which the sections turn along the rod at its start, in all."""
    if scene.start is None:
        return 0.0
    q = np.asarray(scene.start(np.linspace(*scene.interval, SAMPLES)), dtype=float)
    cosines = abs((q[1:] * q[:-1]).sum(axis=1)) / (np.linalg.norm(q[1:], axis=1) * np.linalg.norm(q[:-1], axis=1))
    return float(2 * np.arccos(np.clip(cosines, 0.0, 1.0)).sum())


def _moment(scene: Scene, load: float) -> np.ndarray:
    """Moment (3,) of the undeformed rod, that of a natural curvature, by differences of the stored energy."""
    c, step = scene.constants(load), SMALL / scene.length
    none = np.zeros(3)
    return np.array(
        [(scene.energy_at(none, step * e, c) - scene.energy_at(none, -step * e, c)) / (2 * step) for e in np.eye(3)]
    )

"""The mesh that a run begins with: chosen for a sweep, and whether it can hold the index of a scene's start.

Equilibria are traced on meshes that are raised on the way (:mod:`rodfem.adaptivity.mesh_sequence`).  What a sweep
computes, a few frequencies at every load, asks for the richest mesh where its load is greatest, and costs little: one
mesh is chosen before, on which the frequencies wanted do not change by more than the accuracy when it is refined.

Each unstable mode has half-waves.  Where a mesh has few nodes for each of them, the index of the start is counted at
both ends of the range on twice as many elements as well: another one is that of the mesh, not of the rod.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import ceil

import numpy as np
from mpi4py import MPI

from rodfem.adaptivity.mesh_sequence import start_mesh
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.diagram.first_state import first_state
from rodfem.diagram.held import at_load
from rodfem.diagram.solver import Solver, check_index
from rodfem.errors import Argument, ConvergenceError, Remedy
from rodfem.fem.fields import Discretization
from rodfem.fem.system import System
from rodfem.problem.scene import Scene
from rodfem.stability.dependence import may_depend, require_independent_constraints
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.spectrum import SHIFT
from rodfem.tolerances import unit

MARGIN = 10.0
"""Frequencies are to be better than asked for by this factor: flutter loads depend on two that are near each other."""
REFINED = 1.5
"""Ratio of the numbers of elements of one mesh and the next."""
MOST = 8
"""Number of refinements."""
WORSE, FINE = 3, 1e-6
"""Refinements after each other that do not help before the best mesh is taken: coarse ones do not see all yet.  Below
this change one is enough: that is round-off.
"""
NODES = 8
"""Nodes for each unstable mode below which the index is compared."""
BENT = 1e-6
"""Rotation of a state away from the scene's start, in radian, above which it is not that start."""


def frequency_mesh(
    scene: Scene, formulation: str, accuracy: float, span: Sequence[float], number: int, comm: MPI.Comm
) -> tuple[Discretization, float]:
    """Discretisation for ``number`` frequencies at loads of a span, and by how much they change on the next one.

    The change is relative (to one, for values mu = omega^2 smaller than that).  Where refinement stops to help, at
    round-off, the best one is returned: its change says that it is worse than asked for.

    ``scene`` and ``formulation`` are those of the discretisation, ``accuracy`` is the change asked for, ``span`` are
    the loads, and the ranks of ``comm`` share the rod.
    """
    loads = np.linspace(span[0], span[1], 3)
    mesh = replace(start_mesh(scene, formulation, accuracy, comm), vertices=None)
    first = System(scene, mesh, comm)
    values = _frequencies(first, loads, number)
    best, least, worse = mesh, np.inf, 0
    for _ in range(MOST):
        finer = replace(mesh, elements=ceil(REFINED * mesh.elements))
        richer = _frequencies(System(scene, finer, comm, symmetries=first.symmetries), loads, number)
        one = scene.units.omega2
        change = max(_change(v[:number], w, one) for v, w in zip(values, richer, strict=True))
        if change < least:
            best, least, worse = mesh, change, 0
        else:
            worse += 1
        if worse >= (WORSE if least > FINE else 1) or least < accuracy / MARGIN:
            break
        mesh, values = finer, richer
    return best, least


def _frequencies(system: System, loads: np.ndarray, number: int) -> list[np.ndarray]:
    """Eigenvalues mu nearest the origin at each of the loads, two more than ``number``."""
    solver = BranchSolver(system)
    eigensolver = NonsymmetricSolver(solver.system)
    x, _ = first_state(solver, float(loads[0]))
    found = []
    for load in loads:
        x = at_load(solver, x, float(load))
        values = eigensolver.at(x).near(number + 2, SHIFT * system.scene.units.omega2).values
        found.append(values[np.argsort(abs(values))][: number + 2])
    if min(map(len, found)) < number:
        remedy = Remedy("ask for fewer ({})", Argument("Plan", "spectrum"))
        raise ConvergenceError(f"The coarsest mesh has fewer than {number} frequencies", remedy)
    return found


def _change(values: np.ndarray, richer: np.ndarray, one: float) -> float:
    """Largest distance of values from the nearest of the richer ones, relative to values greater than ``one``."""
    return max(float(abs(richer - v).min() / unit(v, one=one)) for v in values)


def check_start(solver: BranchSolver, span: tuple[float, float], warn: Callable[[str], None]) -> None:
    """Compare the index at the ends of a range of loads with that on twice as many elements, where a mesh has few.

    ``span`` is the range, and ``warn`` hears of an index that is the mesh's.  Of a rod that bends from the start on,
    only the first load is looked at.  Raises :class:`InputError` where the mesh of the ``solver`` cannot hold the
    half-waves at all, :class:`SceneError` where constraints depend on one another.  Collective.
    """
    if not solver.conservative:
        return
    scene, mesh = solver.system.scene, solver.system.fields.discretization
    nodes = mesh.elements * mesh.degree
    for load in span:
        index = _index(solver, load)
        if index is None:
            return
        if NODES * index > nodes:
            check_index(scene, load, index, nodes)
            finer = Solver(scene, mesh.finer(2), solver.system.comm).equilibria
            there = _index(finer, load)
            if there not in (None, index):
                warn(
                    f"At {scene.load} = {load:g} the index of the first state is {index} on {mesh.elements} elements "
                    f"and {there} on {2 * mesh.elements}: indices may be the mesh's; use more elements or a higher "
                    "degree."
                )


def _index(solver: BranchSolver, load: float) -> int | None:
    """Index of the scene's start at a load; None where it is no equilibrium there, or its energy not convex."""
    start, system = solver.start(load), solver.system
    x, outcome = solver.at_load(start, load)
    turned = float(abs(system.at(x).turned - system.at(start).turned).max(initial=0.0))
    bent = load != system.scene.span[0] and max(system.comm.allgather(turned)) > BENT
    if not outcome.converged or bent or solver.lost_convexity(x):
        return None
    if may_depend(solver.shape, x):  # then a count is round-off
        require_independent_constraints(solver.shape, x, start)
    return solver.inertia.at(x).count().negative

"""The index of a scene's start at both ends of the range: whether a mesh can hold it, told before anything is traced.

Each unstable mode has half-waves.  Where a mesh has few nodes for each of them, the index of the start is counted on
twice as many elements as well: another one is that of the mesh, not of the rod.
"""

from __future__ import annotations

from collections.abc import Callable

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.solver import Solver, check_index

NODES = 8
"""Nodes for each unstable mode below which the index is compared."""
BENT = 1e-6
"""Rotation of a state away from the scene's start, in radian, above which it is not that start."""


def check_start(solver: StaticSolver, span: tuple[float, float], warn: Callable[[str], None]) -> None:
    """Compare the index at the ends of a range of loads with that on twice as many elements, where a mesh has few.

    ``span`` is the range, and ``warn`` hears of an index that is the mesh's.  Of a rod that bends from the start on,
    only the first load is looked at.  Raises :class:`InputError` where the mesh of the ``solver`` cannot hold the
    half-waves at all.  Collective.
    """
    if not isinstance(solver, BranchSolver):
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
            assert isinstance(finer, BranchSolver)
            there = _index(finer, load)
            if there not in (None, index):
                warn(
                    f"At {scene.load} = {load:g} the index of the first state is {index} on {mesh.elements} elements "
                    f"and {there} on {2 * mesh.elements}: indices may be the mesh's; use more elements or a higher "
                    "degree."
                )


def _index(solver: BranchSolver, load: float) -> int | None:
    """Index of the scene's start at a load; None where it is no equilibrium there."""
    start, system = solver.start(load), solver.system
    x, outcome = solver.at_load(start, load)
    turned = float(abs(system.at(x).turned - system.at(start).turned).max(initial=0.0))
    if not outcome.converged or (load != system.scene.span[0] and max(system.comm.allgather(turned)) > BENT):
        return None
    return solver.inertia.at(x).count().negative

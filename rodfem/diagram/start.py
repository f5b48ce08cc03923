"""Where a computation begins: its first state, the name of its branch, the index that a mesh can hold."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from rodfem.continuation.branch import FIRST_BRANCH
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.errors import Argument, ConvergenceError, InputError, Remedy
from rodfem.fem.newton import NewtonResult
from rodfem.fem.shape import Shape
from rodfem.problem.scene import Scene
from rodfem.stability.dependence import may_depend, require_independent_constraints

BENT = 1e-6
"""Distance from the chord, over the rod's length, and rotation from the scene's start, in radian, that are none."""
AHEAD = 0.1
"""Distance along the first tangent, in the metric, at which the centreline is looked at as well."""
HOPELESS, A_FEW = 0.9, 4
"""Index over the number of nodes above which it is that of the mesh; half-waves that a mesh of any size is allowed."""


def first_state(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """Equilibrium at ``load`` from the scene's start, and the iteration that led to it.

    Raises :class:`~rodfem.errors.SceneError` where constraints depend on one another: then factors are round-off.
    """
    start = solver.start(load)
    try:
        x, outcome = first_equilibrium(solver, load)
    except ConvergenceError:
        require_independent_constraints(solver.shape, start)
        raise
    if not outcome.converged:
        require_independent_constraints(solver.shape, start)
    elif may_depend(solver.shape, x):
        require_independent_constraints(solver.shape, x, start)
    return x, outcome


def name_of_first(shape: Shape, states: Sequence[PETSc.Vec]) -> str:
    """Name of the first branch: that of the scene, or else what is true of its first ``states``.  Collective."""
    scene = shape.system.scene
    if scene.states is not None:
        return scene.states
    if scene.closed:
        return "ring"
    return "straight" if all(is_straight(shape.sample(x)["r"]) for x in states) else FIRST_BRANCH


def ahead(x: PETSc.Vec, tangent: PETSc.Vec) -> PETSc.Vec:
    """The state a little farther along the tangent at ``x``: straight where straight states go on being so.

    The rotations ``q`` that give d3 one direction are a linear space, so that the length of the step does not matter.
    """
    out = x.copy()
    out.axpy(AHEAD, tangent)
    return out


def is_straight(r: NDArray[np.float64]) -> bool:
    """Whether a centreline (n, 3) lies on the line through its ends, whatever its size."""
    chord, away = r[-1] - r[0], r - r[0]
    length = np.linalg.norm(np.diff(r, axis=0), axis=1).sum()
    across = np.linalg.norm(np.cross(away, chord), axis=1).max()
    return bool(across <= BENT * length * np.linalg.norm(chord))


def check_index(scene: Scene, load: float, index: int, nodes: int) -> None:
    """Raise :class:`InputError` for an ``index`` of a ``scene`` at a ``load`` that so many ``nodes`` cannot hold."""
    if index > max(HOPELESS * nodes, A_FEW):
        raise InputError(
            f"At {scene.load} = {load:g} the rod has more half-waves than a mesh of {nodes} nodes can hold (its index "
            f"is {index} there)",
            Remedy("use smaller loads, or more elements ({})", Argument("Discretization", "elements")),
        )


def check_start(solver: BranchSolver, span: tuple[float, float]) -> None:
    """Raise :class:`InputError` where the mesh of a ``solver`` cannot hold the half-waves at the ends of a ``span``.

    Of a rod that bends from the start on, only the first load is looked at.  Raises :class:`SceneError` where
    constraints depend on one another.  Collective.
    """
    mesh = solver.system.fields.discretization
    for load in span if solver.conservative else ():
        index = _index(solver, load)
        if index is None:
            return
        check_index(solver.system.scene, load, index, mesh.elements * mesh.degree)


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

"""The equilibrium that a computation begins with, whose constraints are independent, and what its branch is called."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from rodfem.continuation.branch import FIRST_BRANCH
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.first_equilibrium import first_equilibrium
from rodfem.errors import ConvergenceError
from rodfem.fem.newton import NewtonResult
from rodfem.fem.shape import Shape
from rodfem.stability.dependence import may_depend, require_independent_constraints

STRAIGHT, RING = "straight", "ring"
BENT = 1e-6
"""Distance from the chord, relative to the rod's length, below which a centreline is straight."""
AHEAD = 0.1
"""Distance along the first tangent, in the metric, at which the centreline is looked at as well."""


def first_state(solver: BranchSolver, load: float) -> tuple[PETSc.Vec, NewtonResult]:
    """Equilibrium at ``load`` from the scene's start, and the iteration that led to it; see :func:`first_equilibrium`.

    Raises :class:`~rodfem.errors.SceneError` where constraints depend on one another: of those a matrix tells nothing,
    its factors are round-off.  Where nothing was found they are looked at in the start.
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
    """Name of the first branch: that of the scene, or else what is true of the first ``states`` of it.

    A closed rod is a ring, ``straight`` has straight centrelines, and any other is the
    :data:`~rodfem.continuation.branch.FIRST_BRANCH`; ``shape`` evaluates them.  Collective.
    """
    scene = shape.system.scene
    if scene.states is not None:
        return scene.states
    if scene.closed:
        return RING
    return STRAIGHT if all(is_straight(shape.sample(x)["r"]) for x in states) else FIRST_BRANCH


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

"""Modes at a few typical states of each branch, which every run records: its ends, evenly between, special points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError, InputError
from rodfem.modes.eigenmotions import Eigenmotions
from rodfem.modes.recorded import Typical
from rodfem.ranks import as_failure

EVENLY = 5
"""States of a branch, evenly along it."""
FEWEST, MOST = 4, 8
"""Modes of a state: those of negative eigenvalues are among them up to the latter."""


def typical_rows(branch: Branch) -> dict[int, int]:
    """Rows of the typical states of a branch, and how many modes of each are wanted."""
    along = np.array([point.arclength for point in branch.points])
    rows = [int(np.argmin(abs(along - place))) for place in np.linspace(along[0], along[-1], EVENLY)]
    wanted = {row: branch.points[row].negative for row in rows}
    for special in branch.special:
        beside = special.negative_before, special.negative_after
        wanted[special.row] = max(wanted.get(special.row, 0), *beside)
    return {row: min(max(FEWEST, wanted[row]), MOST) for row in sorted(wanted)}


def typical_modes(branches: Sequence[Branch], solvers: Sequence[BranchSolver]) -> list[list[Typical]]:
    """Modes at the typical states of each of the ``branches``: see :func:`of_branch`, also for the ``solvers``."""
    with solvers[0].system.clock.scope("modes"):
        return [of_branch(branch, solvers) for branch in branches]


def of_branch(branch: Branch, solvers: Sequence[BranchSolver]) -> list[Typical]:
    """Modes at the typical states of a ``branch``, each on the mesh of its point; collective.

    They depend on nothing but the branch.  None of a rod without inertia.  ``solvers`` are those of the meshes by
    number.
    """
    if solvers[0].system.equations.massless:
        return []
    finders: dict[int, Eigenmotions] = {}
    double = {special.row: special.omega2 for special in branch.special}
    out = []
    for row, number in typical_rows(branch).items():
        point = branch.points[row]
        if point.mesh not in finders:
            finders[point.mesh] = Eigenmotions(solvers[point.mesh])
        try:
            with as_failure(solvers[point.mesh].system.comm):
                found = finders[point.mesh].few(point.x, number, double.get(row, np.nan))
            out.append(Typical(row, found))
        except (ConvergenceError, InputError) as trouble:
            out.append(Typical(row, None, str(trouble)))
    return out

"""Branch points at which eigenvalues pass zero together in opposite directions: the index is the same on either side.

Neither the index shows them nor the sign of the determinant, which only touches zero.  The search for pairs ends at a
state beside one (:mod:`rodfem.continuation.pair_search`), at which one of the eigenvalues at least is within the
tolerance of zero.  There each eigenvalue is followed by its own mode, taken where they are still apart.
"""

from __future__ import annotations

from collections.abc import Sequence

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import BRANCH_POINT
from rodfem.continuation.locate import across, locate_mode
from rodfem.continuation.special_points import special_at
from rodfem.continuation.states_between import point_between
from rodfem.errors import ConvergenceError

ASIDE = 0.01
"""Distance from the state at which modes are told apart, relative to that of the nearer neighbour."""


def opposite_crossing(
    solver: BranchSolver, rows: Sequence[Point], index: int, persistent: int = 0
) -> SpecialPoint | None:
    """Branch point beside the middle one of three ``rows``, where eigenvalues pass zero in opposite directions.

    The ``index`` is that of the first and of the last row, and ``persistent`` eigenvalues stay zero along the branch;
    ``solver`` has the mesh.  None if they do not, or are not told apart.
    """
    a, state, b = rows
    size = ASIDE * min(state.arclength - a.arclength, b.arclength - state.arclength)
    aside = point_between(solver, a, b, state.arclength - size)
    if aside is None:
        return None
    # with those that persist; one that changes fast may be beyond the tolerance of zero yet
    number = max(state.zero - solver.system.active_drifts(state.x), persistent + 2)
    still = solver.inertia.modes_near_zero(a.x, persistent) if persistent else []
    modes = across(solver.system, solver.inertia.modes_near_zero(aside.x, number), still)
    try:
        located = [locate_mode(solver, a, b, state.arclength, mode, len(still)) for mode in modes]
        if not min(each.rate for each in located) < 0.0 < max(each.rate for each in located):
            return None
        special = special_at(solver, located[0], located[0].s, still)
    except ConvergenceError:
        return None
    if not a.arclength < special.point.arclength < b.arclength or special.multiplicity < 2:
        return None
    special.kind, special.negative_before, special.negative_after = BRANCH_POINT, index, index
    special.located_to += max(each.uncertainty + abs(each.load - special.point.load) for each in located)
    return special

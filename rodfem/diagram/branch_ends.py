"""Where a branch ends: at a branch point on the end of the range, where it closes, or meets another one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.diagram.equivalence import Alike, near
from rodfem.diagram.finders import Step
from rodfem.errors import ConvergenceError
from rodfem.tolerances import SAME_SPECIAL, SAME_STATE

BEYOND = 0.02
"""How far past a singular end of the range, relative to half the range, an equilibrium is sought to locate it."""
LEAST = 12
"""Points of the shortest closed loop."""
NEIGHBOUR = 4
"""Steps within which a closed loop passes its beginning."""
APART = 0.5
"""Arclength beyond which two special points of one branch may be one."""


def point_past_end(solver: BranchSolver, last: Point, span: tuple[float, float]) -> Point | None:
    """Equilibrium of a branch past its ``last`` point, on the end of a range; None where the load does not go there.

    Raises :class:`ConvergenceError` where there is none.
    """
    system, load = solver.system, last.load
    further = load + BEYOND * (load - sum(span) / 2)
    low, high = system.scene.parameters[system.scene.load].admissible
    if not low < further < high:
        return None
    x, outcome = solver.at_load(last.x, further, reach=1.0)
    if not outcome.converged:
        raise ConvergenceError(f"there is no equilibrium at {system.scene.load} = {further:g}")
    s = last.arclength + system.distance(last.x, x)
    return solver.point(x, s, solver.load_tangent(x, further > load), outcome)


def loop_end(branch: Branch, step: Step, width: float, here: Callable[[Point], Point], alike: Alike) -> Point | None:
    """Last point of a ``branch`` that is back at its beginning in a ``step``; None if it is not.

    It is the very state that the branch begins with.  One that leaves a branch point, a singular state, comes back to
    its first row; where loads are equal it ends with the step.  ``here`` carries points to the mesh of the step,
    ``width`` is that of the range of loads, and ``alike`` compares states.
    """
    if len(branch.points) < LEAST:
        return None
    solver, a, b = step.solver, step.a, step.b
    if max(abs(a.slope), abs(b.slope)) < VERTICAL * width:  # equal loads: compare the states
        passed = solver.system.distance(b.x, here(branch.points[0]).x) < b.arclength - a.arclength
        return b if passed else None
    first = branch.points[0 if branch.parent is None else 1]
    if not (_passes(a, b, first) and near(first, a, solver.units, NEIGHBOUR)):
        return None
    try:
        point = Arc(solver, a, b).at_load(first.load)
    except ConvergenceError:  # near a fold, say: not there
        return None
    return point if alike(point, first, SAME_STATE) else None


def _passes(a: Point, b: Point, first: Point) -> bool:
    """Whether the load passes that of the ``first`` point between two others, and in the same direction."""
    return min(a.load, b.load) <= first.load <= max(a.load, b.load) and a.load != b.load and a.slope * first.slope > 0


def connection(branch: Branch, special: SpecialPoint, branches: Sequence[Branch], alike: Alike, load: str) -> str:
    """Recognise a ``special`` point that one of the ``branches`` has; a reason if the ``branch`` ends there.

    ``alike`` compares states; ``load`` is the name of the load.
    """
    from_the_side, where = special.test_function == "slope", f"at {load} = {special.point.load:.8g}"
    found = next(_known(branch, special, branches, alike), None)
    if found is None:
        return f"meets another branch {where}" if from_the_side else ""
    other, i = found
    special.connects_to = (other.name, i)
    special.switched = other.special[i].switched = True
    if branch.parent == special.connects_to:
        return "closed loop"
    if not from_the_side and other.special[i].test_function == "slope":
        return ""  # the branch on which the known one ended: it goes on
    return f"meets {other.name} {where}"


def _known(
    branch: Branch, special: SpecialPoint, branches: Sequence[Branch], alike: Alike
) -> Iterator[tuple[Branch, int]]:
    """Yield where a ``special`` point of a ``branch`` is known: a branch, and the number of the point on it."""
    for other in branches:
        # a neighbour on this branch is another point: of a nearly double eigenvalue
        until = special.point.arclength - APART if other is branch else inf
        for i, known in enumerate(other.special):
            at = known.point
            if known.kind.branches and at.arclength <= until and alike(at, special.point, SAME_SPECIAL):
                yield other, i

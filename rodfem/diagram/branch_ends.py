"""Where a branch ends: at zero stretch, at a branch point on the end of the range, where it closes or meets another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rodfem.adaptivity.zero_stretch import LOCATED, zero_stretch
from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.kinds import END
from rodfem.diagram.equivalence import Alike, near
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE, SAME_SPECIAL, SAME_STATE

BEYOND = 0.02
"""How far past a singular end of the range, relative to half the range, an equilibrium is sought to locate it."""
ALONG = 1e-11
"""Arclength, in the metric, to which a stretch vanishes."""
SAME_END = 1e-6
"""A special point nearer to the end of the range than this, in spans, is the last state."""
ASIDE = 1e-4
"""Distance before an end at which the stretch vanishes, relative to the step, at which the index is counted."""
LEAST = 12
"""Points of the shortest closed loop."""
NEIGHBOUR = 4
"""Steps within which a closed loop passes its beginning."""


def last_admissible(solver: BranchSolver, a: Point, b: Point) -> Point:
    """The point between ``a`` and ``b`` at which the smallest stretch vanishes."""
    arc, first = Arc(solver, a, b), a.arclength + INSIDE * (b.arclength - a.arclength)
    return arc.point(zero_between(lambda s: solver.shape.stretch(arc.state(s)), first, b.arclength, ALONG))


def before_the_end(solver: BranchSolver, a: Point, last: Point) -> Point | None:
    """A point right before the ``last`` admissible one after the row ``a``; None where it is not found.

    A rod that is squeezed to nothing has no stiffness against some motions: at the very end their eigenvalues are zero,
    whatever sign they had before.
    """
    try:
        return Arc(solver, a, last).point(last.arclength - ASIDE * (last.arclength - a.arclength))
    except ConvergenceError:
        return None


def end_at_zero_stretch(solver: BranchSolver, last: Point, *, error_bars: bool) -> SpecialPoint:
    """The end at the ``last`` admissible point, on finer meshes where ``error_bars`` are asked for.

    A note says where those fail.
    """
    located = LOCATED * solver.units.load
    end = SpecialPoint(END, last, last.negative, last.negative, located, test_function="stretch")
    if error_bars:
        try:
            with solver.system.clock.scope("error bars"):
                return zero_stretch(solver, last)
        except ConvergenceError as trouble:
            end.note = f"no error estimate: {trouble}"
    return end


def singular_end(
    solver: BranchSolver,
    span: tuple[float, float],
    previous: Point,
    last: Point,
    search: Callable[[Point, Point], list[SpecialPoint]],
) -> SpecialPoint | None:
    """Branch point on the very end of the range, located on a piece of the branch that goes past it; None for none.

    ``search`` finds the special points between the ``previous`` row and one beyond the ``last``, for which the
    ``solver`` solves; ``span`` is the range.  Raises :class:`ConvergenceError` where there is no equilibrium beyond.
    """
    system, load = solver.system, last.load
    scene = system.scene
    beyond = load + BEYOND * (load - sum(span) / 2)
    low, high = scene.parameters[scene.load].admissible
    if not low < beyond < high or previous.x is last.x:
        return None
    x, outcome = solver.at_load(last.x, beyond, reach=1.0)
    if not outcome.converged:
        raise ConvergenceError(f"there is no equilibrium at {scene.load} = {beyond:g}")
    s = last.arclength + system.distance(last.x, x)
    point = solver.point(x, s, solver.load_tangent(x, beyond > load), outcome)
    found = [s for s in search(previous, point) if s.kind.branches]
    return next((s for s in found if abs(s.point.load - load) < SAME_END * abs(span[1] - span[0])), None)


def closing(
    solver: BranchSolver, branch: Branch, a: Point, b: Point, width: float, here: Callable[[Point], Point], alike: Alike
) -> Point | None:
    """Last point of a ``branch`` that is back at its beginning between two points ``a``, ``b``; None if it is not.

    It is the very state that the branch begins with.  One that leaves a branch point, a singular state, comes back to
    its first row; where loads are equal it ends at ``b``.  Points are on the mesh of the ``solver``, ``here`` carries
    one there; ``width`` is that of the range of loads, and ``alike`` compares states.
    """
    if len(branch.points) < LEAST:
        return None
    if max(abs(a.slope), abs(b.slope)) < VERTICAL * width:  # equal loads: compare the states
        passed = solver.system.distance(b.x, here(branch.points[0]).x) < b.arclength - a.arclength
        return b if passed else None
    first = branch.points[0 if branch.parent is None else 1]
    if (
        (a.load - first.load) * (b.load - first.load) > 0
        or not near(first, a, solver.units, NEIGHBOUR)
        or a.slope * first.slope <= 0
        or a.load == b.load
    ):
        return None
    try:
        point = Arc(solver, a, b).at_load(first.load)
    except ConvergenceError:  # beside a fold, say: not there
        return None
    return point if alike(point, first, SAME_STATE) else None


def meeting(branch: Branch, special: SpecialPoint, branches: Sequence[Branch], alike: Alike, load: str) -> str:
    """Recognise a ``special`` point that one of the ``branches`` has already; a reason if the ``branch`` ends there.

    ``alike`` compares states; ``load`` is the name of the load.
    """
    where = f"at {load} = {special.point.load:.8g}"
    for other in branches:
        for i, known in enumerate(other.special):
            if other is branch and special.point.arclength - known.point.arclength < 0.5:
                continue  # a neighbour on this branch: a nearly double eigenvalue
            if known.kind.branches and alike(known.point, special.point, SAME_SPECIAL):
                special.connects_to = (other.name, i)
                special.switched = known.switched = True
                if branch.parent == special.connects_to:
                    return "closed loop"
                if special.test_function == "mu" and known.test_function == "slope":
                    return ""  # the branch on which the known one ended: it goes on
                return f"meets {other.name} {where}"
    return f"meets another branch {where}" if special.test_function == "slope" else ""

r"""Special points: detection and classification of folds (turning points) and branch points; branch switching.

Between two points of a branch with different indices an eigenvalue of the second variation crosses zero; where the
load turns back, its slope does.  With ``phi`` the null vector (left and right, as the saddle matrix ``S`` is symmetric)
and ``F_lam`` the derivative of the equations in the load, ``phi . F_lam != 0`` at a fold and ``= 0`` at a branch point
(Keller 1977).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.continuation.locate import (
    NEAREST,
    WINDOW,
    Located,
    across,
    locate,
    locate_mode,
    refine,
    solve_at,
    solve_at_load,
)
from rodfem.continuation.prediction import hermite
from rodfem.continuation.solvers import VERTICAL, BranchSolver, distance
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.newton import correct
from rodfem.linalg.orthogonal import combine, project_out
from rodfem.stability.inertia import NULL, Factored
from rodfem.stability.round_off import decide, quotient_error, resolve
from rodfem.tolerances import TINY

COUPLED = 1e-5
"""A fold has a cosine between null vector and load derivative above this, a branch point below."""
UNCOUPLED = 1e-9
"""Below this it is round-off.  Between the two the index decides, and then the unfolding parameters."""
LEVEL = 1e-3
"""Slope of the load, relative to its span, below which it is taken for zero."""
INSENSITIVE = 1e-10
"""A derivative of the equations in the load smaller than this, relative to the Jacobian, is zero."""
FIRST = 0.05
"""Distance of the first point of a branch from the branch point that it leaves; at least it is :data:`NEAREST`."""
SHORTEST = 1e-4
"""Amplitude, in the metric, below which no further one is tried from a branch point."""
SEEN = 100
"""Ratio of the distance of a fold from a branch point, in load, to the uncertainty of that, for which it is located."""
CLOSE, STEEP = 2.0, 50.0
"""How far from its prediction the first point of a branch may lie, in amplitudes: usually, and at most."""
AROUND = 12
"""Directions that are tried in the plane of two null vectors; in a space of more of them as many for each but one."""
ALIGNED = 0.999
"""Cosine of the angle between directions above which they are those of one branch."""
FIXED = 1e-6
"""Norm of a unit direction's image by a symmetry below which it moves nothing."""
APART = 1e-7
"""Arclength above which there is a state to count at between two special points."""
SHIFT = 1e-6
"""Shift of a singular Jacobian, in units of the lowest bending eigenvalue."""


def special_at(
    solver: BranchSolver, located: Located, arclength: float, still: Sequence[PETSc.Vec] = ()
) -> SpecialPoint:
    """Evaluate and classify a located point: multiplicity, null vectors, coupling to the load, kind.

    Vectors of eigenvalues that are zero on the whole branch (``still``) are none of its null vectors.  ``solver`` has
    the mesh, ``located`` is the zero found there, ``arclength`` that of the point.  Raises :class:`ConvergenceError`
    where no null vector is left.
    """
    system, inertia = solver.system, solver.inertia
    x = located.x
    tangent = located.tangent / system.norm(located.tangent)
    found = inertia.at(x)
    point = solver.point(x, arclength, tangent, index=decide(found).index)
    null_count = point.zero - found.drifts
    if null_count < 1:  # what was interpolated has no zero there: two branches were taken for one
        raise ConvergenceError(
            f"No eigenvalue vanishes at load {point.load:.8g}, where one was expected to", SMALLER_STEPS
        )
    vectors = across(system, found.nearest(null_count, NULL)[1], still)
    if not vectors:
        raise ConvergenceError(
            f"The null vector near load {located.load:.8g} is in the span of those that persist along the branch",
            SMALLER_STEPS,
        )
    coupling = max(coupling_of(solver, x, v) for v in vectors)
    turning = abs(system.scalar(tangent)) < LEVEL * abs(system.scene.span[1] - system.scene.span[0])
    kind = FOLD if turning and coupling > COUPLED else BRANCH_POINT
    apart = _apart(found, vectors, located)
    special = SpecialPoint(
        kind, point, located.before, located.after, located.uncertainty + apart, [v.copy() for v in vectors], coupling
    )
    if apart > located.uncertainty:
        special.note = f"{len(vectors)} eigenvalues that are not told apart vanish within {apart:.0e}"
    return special


def _apart(found: Factored, vectors: Sequence[PETSc.Vec], located: Located) -> float:
    """How far apart in load the eigenvalues of several null ``vectors`` vanish that count as zero at a located point.

    By their Rayleigh quotients beyond round-off, and the rate at which one of them changes, which is that of all up to
    a number about one: twice the distance that follows.
    """
    if len(vectors) < 2 or not located.rate:
        return 0.0
    quotients = [abs(v.dot(found.matrix * v) + found.shift) - quotient_error(found.matrix, v) for v in vectors]
    return 2 * max(*quotients, 0.0) * abs(located.slope / located.rate)


def coupling_of(solver: BranchSolver, x: PETSc.Vec, null_vector: PETSc.Vec) -> float:
    """Cosine between a null vector and ``F_lam``, the derivative of the equations in the load at ``x``."""
    system = solver.system
    matrix = system.at(x).jacobian(solver.axis)
    derivative = matrix * solver.axis
    system.set_load(derivative, 0.0)
    derivative, null_vector = system.in_units(derivative, 1), system.in_units(null_vector, -1)
    if (
        derivative.norm() < INSENSITIVE * system.matrix_in_units(matrix).norm()
    ):  # a trivial state: its equations do not feel the load
        return 0.0
    return float(abs(derivative.dot(null_vector)) / (derivative.norm() * null_vector.norm()))


def find_special(
    solver: BranchSolver, a: Point, b: Point, orders: Sequence[int], persistent: int = 0
) -> list[SpecialPoint]:
    """All folds and branch points between two points of a branch, in order of arclength, with indices that chain.

    Where the load turns back there is a fold, or a branch point at which this branch ends on another one.  The
    eigenvalues number ``orders`` (0 is the left-most) change sign from ``a`` to ``b``: those that a fold does not
    explain do so at branch points, or further folds.  ``persistent`` eigenvalues are zero all along, beside those of
    symmetries, and are not numbered.  ``solver`` has the mesh.  Raises :class:`ConvergenceError` where one is found
    twice, and another not at all.
    """
    found: list[SpecialPoint] = []
    rest = list(orders)
    low = min(a.negative, b.negative)
    level = VERTICAL * abs(solver.system.scene.span[1] - solver.system.scene.span[0])
    if a.slope * b.slope < 0 and max(abs(a.slope), abs(b.slope)) > level:
        found.append(_special(solver, a, b, low, "slope"))
        if found[0].kind == FOLD:
            own = min(found[0].negative_before, found[0].negative_after)
            rest = [order for order in rest if not own <= order < own + found[0].multiplicity]
    still = solver.inertia.modes_near_zero(a.x, persistent) if rest and persistent else []
    while rest:
        special = _special(solver, a, b, rest[0], "mu", still)
        if (known := same_point(solver, special, found)) is not None:
            special = _another(solver, a, b, known, still)
            if same_point(solver, special, found) is not None:
                raise ConvergenceError(
                    f"Beside load {known.point.load:.8g} another eigenvalue vanishes, where none was found",
                    SMALLER_STEPS,
                )
        found.append(special)
        del rest[: special.multiplicity]
    found.sort(key=lambda s: s.point.arclength)
    _count_between(solver, a, b, found)
    return found


def same_point(solver: BranchSolver, special: SpecialPoint, found: Sequence[SpecialPoint]) -> SpecialPoint | None:
    """Special point among those found at which the same eigenvalues vanish at the same place, if there is one."""
    for known in found:
        near = abs(special.point.arclength - known.point.arclength) < APART
        if near and not across(solver.system, special.null_vectors, known.null_vectors):
            return known
    return None


def _another(solver: BranchSolver, a: Point, b: Point, known: SpecialPoint, still: Sequence[PETSc.Vec]) -> SpecialPoint:
    """Zero of the eigenvalue nearest zero at a ``known`` special point between ``a`` and ``b`` that is none of its own.

    Where eigenvalues pass each other next to zero their numbers do not tell which is which, and their vectors do.
    ``solver`` has the mesh, ``still`` are the persistent null vectors.  Raises :class:`ConvergenceError` without one.
    """
    own = [*still, *known.null_vectors]
    vectors = solver.inertia.modes_near_zero(known.point.x, len(own) + 1)
    mode = across(solver.system, vectors, own)[0]
    located = locate_mode(solver, a, b, known.point.arclength, mode, len(still))
    return special_at(solver, located, located.s, still)


def _count_between(solver: BranchSolver, a: Point, b: Point, found: list[SpecialPoint]) -> None:
    """Set the indices between neighbouring special points of one piece of a branch by counts half-way.

    Points too near to each other for a state between them have been told apart by their eigenvalues alone: there the
    index changes by the multiplicity of the first.
    """
    for p, q in pairwise(found):
        if q.point.arclength - p.point.arclength > APART:
            s = (p.point.arclength + q.point.arclength) / 2
            x = solve_at(solver, lambda t: hermite(a, b, t), s)
            between = resolve(solver.inertia.at(x))[0]
        else:
            rising = b.negative > a.negative
            between = p.negative_before + (p.multiplicity if rising else -p.multiplicity)
        p.negative_after = q.negative_before = between


def midpoint(solver: BranchSolver, a: Point, b: Point) -> Point | None:
    """Point half-way between two points of a branch; None where it is not between them."""
    return point_between(solver, a, b, (a.arclength + b.arclength) / 2)


def point_between(solver: BranchSolver, a: Point, b: Point, s: float) -> Point | None:
    """Point at arclength ``s`` between the points ``a`` and ``b`` of a branch of ``solver``; None where it is not."""
    try:
        x = solve_at(solver, lambda t: hermite(a, b, t), s)
    except ConvergenceError:
        return None
    whole = distance(solver.system, a.x, b.x)
    if max(distance(solver.system, a.x, x), distance(solver.system, x, b.x)) > whole:
        return None
    return solver.point(x, s, solver.tangent(solver.row(hermite(a, b, s)[1]), at=x))


def _special(
    solver: BranchSolver, a: Point, b: Point, order: int, test_function: str, still: Sequence[PETSc.Vec] = ()
) -> SpecialPoint:
    located = locate(solver, a, b, order, test_function, still)
    margin = 0.01 * (b.arclength - a.arclength)
    if not a.arclength - margin <= located.s <= b.arclength + margin:
        raise ConvergenceError(
            f"A special point between loads {a.load:.8g} and {b.load:.8g} slipped out of its bracket",
            SMALLER_STEPS,
        )
    special = special_at(solver, located, located.s, still)
    special.test_function = test_function
    if test_function == "slope" and abs(located.after - located.before) == 1 and special.coupling > UNCOUPLED:
        special.kind = FOLD  # an eigenvalue crosses zero with the slope; where a side branch ends it only touches zero
    return special


def directions(solver: BranchSolver, special: SpecialPoint) -> list[PETSc.Vec]:
    """Unit directions in which branches may leave a branch point, one for each circle of equivalent ones.

    In the plane of the null vectors and the branch's own tangent, what is orthogonal to the tangent; of the null
    vectors that a continuous symmetry carries into each other one is kept.
    """
    system, tangent = solver.system, special.point.tangent
    known = [] if tangent is None else [tangent.copy()]
    out: list[PETSc.Vec] = []
    candidates = list(special.null_vectors)
    if abs(special.point.slope) < LEVEL * abs(system.scene.span[1] - system.scene.span[0]):
        candidates.append(_load_response(solver, special))
    for candidate in candidates:
        d = candidate.copy()
        project_out(d, known, system.metric, times=2)
        size = system.norm(d)
        if size < 0.1 * max(system.norm(candidate), TINY):
            continue
        d.scale(1.0 / size)
        out.append(d)
        known.append(d)
        for image in system.equivalent_directions(special.point.x, d):
            if (size := system.norm(image)) > FIXED:
                known.append(image / size)
    return out


def _load_response(solver: BranchSolver, special: SpecialPoint) -> PETSc.Vec:
    """Change of state with the load off the null vectors: the other branch where a side branch ends.

    The Jacobian is singular there, and the load is orthogonal to its null vectors up to an error that its inverse would
    blow up: it is shifted, which changes the answer by about as much as the shift, :data:`SHIFT`, relative to it.
    """
    system = solver.system
    out = system.new_vector()
    x = special.point.x
    system.set_phase(x)
    system.at(x).factor(solver.axis, SHIFT * system.stiffness_scale)
    system.solve(solver.axis, out)
    project_out(out, special.null_vectors, system.metric)
    return out


def lines(solver: BranchSolver, special: SpecialPoint, ways: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Unit directions in which branches do leave a branch point with several null vectors of different motions.

    In the space of null vectors the reduced equations select a few lines, and a null vector of the eigensolver is on
    one by chance only.  Newton's method is started in directions all around, and once more in that in which what it
    finds is seen from the branch point.  Nearer to that any direction is an equilibrium to round-off.  ``solver`` has
    the mesh; ``ways`` are those of :func:`directions`, which are returned where nothing is found.  Of motions that a
    continuous symmetry turns, each in its own circle, only the relative phase that the ways have is tried.
    """
    system, n = solver.system, len(ways)
    if n == 2:
        angles = np.pi * np.arange(AROUND) / AROUND
        tried = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    else:
        rng = np.random.default_rng(n)
        tried = np.concatenate([np.eye(n), rng.normal(size=(AROUND * (n - 1), n))])
    weighed = [system.metric * way for way in ways]
    found: list[np.ndarray] = []
    for weights in tried:
        seen = weights / np.linalg.norm(weights)
        for _ in range(2):
            direction = combine(list(ways), seen)
            x = special.point.x + direction * FIRST
            if not correct(system, x, solver.row(direction), reach=CLOSE * FIRST).converged:
                break
            away = x - special.point.x
            seen = np.array([away.dot(image) for image in weighed])
            seen /= np.linalg.norm(seen)
        else:
            if all(abs(seen @ known) < ALIGNED for known in found):
                found.append(seen)
    return [combine(list(ways), weights) for weights in found] or list(ways)


def leave(
    solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec, first: float, shortest: float = SHORTEST
) -> Point | None:
    """First point of the branch that leaves ``special`` along ``direction``, about ``first`` away, or None.

    The amplitude is halved until the point lies where the direction says, within half of its distance.  Where that
    fails, a family of equilibria may leave at once, at each of which the Jacobian is singular (an elastica whose ends
    meet turns as a rigid body about any axis): then Newton's method is damped along the family.  ``solver`` has the
    mesh, ``first`` is a length in the metric.  A transcritical branch whose load changes much faster than its state is
    farther away: it is tried last.  No amplitude is tried below the ``shortest``.
    """
    system = solver.system
    row, before = solver.row(direction), system.damping
    dampings = dict.fromkeys((before, before or solver.inertia.tolerance))
    for damping, reach in (*((damping, CLOSE) for damping in dampings), (before, STEEP)):
        system.damping, amplitude = damping, first
        while amplitude > shortest:
            x = special.point.x + direction * amplitude
            outcome = correct(system, x, row, reach=reach * amplitude)
            if outcome.converged:
                apart = distance(system, special.point.x, x)
                return solver.point(x, apart, solver.tangent(row, at=x), outcome)
            amplitude /= 2
    system.damping = before
    return None


def between(solver: BranchSolver, special: SpecialPoint, outer: Point, load: float) -> Point | None:
    """State at ``load`` of a branch between ``special``, which it leaves, and its point ``outer``; None without one.

    ``solver`` has the mesh.  The state is on the side of ``outer``: what leaves in the opposite way is another one.
    """
    chord = outer.x - special.point.x
    ends = replace(special.point, arclength=0.0), replace(outer, arclength=1.0)

    def along(part: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        return special.point.x + chord * part, chord

    try:
        x, part, outcome = solve_at_load(solver, along, *ends, load)
    except ConvergenceError:  # the load is none of those between
        return None
    return solver.point(x, part * outer.arclength, solver.load_tangent(x, True), outcome)


def start_branch(
    special: SpecialPoint,
    direction: PETSc.Vec,
    name: str,
    parent: tuple[str, int],
    depth: int,
    solver: BranchSolver,
    ways: int,
    bounds: tuple[float, float],
) -> Branch | None:
    """Branch that leaves ``special`` along ``direction``, one of ``ways``: its first two points, the special one first.

    The second is nearer where the load has turned back before it, or its index is not that with which the branch
    begins: the fold, or the branch point, that says why is on the branch.  So it is where its load is out of bounds.
    Nor is it farther away than the branch that it leaves began: beside a nearly double point branches are short.
    ``name``, ``parent`` and ``depth`` are recorded in the branch; ``solver`` has the mesh, and ``bounds`` are the least
    and the greatest load.
    """
    amplitude = FIRST if depth < 2 else max(min(FIRST, special.point.arclength), NEAREST)
    first = leave(solver, special, direction, amplitude)
    if first is None:
        return None
    origin = replace(special.point, tangent=direction, arclength=0.0, slope=solver.system.scalar(direction))
    fold = fold_beside(solver, special, direction) if ways == 1 else None
    if fold is not None and (beyond := leave(solver, special, direction, NEAREST)) is not None:
        return _through(special, fold, Branch(name, parent, depth, [origin, beyond]))
    side = _side(solver, special, direction)
    while amplitude > NEAREST and (not bounds[0] <= first.load <= bounds[1] or _changed(special, side, ways, first)):
        amplitude /= 4
        first = leave(solver, special, direction, amplitude) or first
    span = solver.system.scene.span
    vertical = abs(first.slope) < VERTICAL * abs(span[1] - span[0])  # the load changes by round-off
    begins = None if vertical else index_beside(special, first.load, ways)
    return Branch(name, parent, depth, [origin, first], begins=begins)


def _through(special: SpecialPoint, fold: SpecialPoint, branch: Branch) -> Branch:
    """The ``branch`` that leaves ``special`` with the ``fold`` before its second point."""
    branch.begins = index_beside(special, fold.point.load, 1)
    fold.negative_after = branch.points[1].negative
    fold.negative_before = fold.negative_after if branch.begins is None else branch.begins
    branch.insert(fold)
    return branch


def index_beside(special: SpecialPoint, load: float, ways: int) -> int | None:
    """Index with which a branch begins that leaves towards ``load``; None where the trunk's does not determine it.

    By exchange of stability the eigenvalue that crosses zero has the sign opposite to that on the trunk at the same
    load.  Of one way to leave the eigenvalues of the other null vectors belong to a symmetry, and stay zero.
    """
    low, high = sorted((special.negative_before, special.negative_after))
    if special.test_function != "mu" or ways != 1 or high - low != special.multiplicity or not special.point.slope:
        return None
    ahead = (load - special.point.load) * special.point.slope > 0
    there = special.negative_after if ahead else special.negative_before
    return low if there == high else low + 1


def _side(solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec) -> float:
    """Sign of the load's change along a branch right after it leaves; zero where that is not asked for."""
    if special.test_function != "mu":
        return 0.0
    if special.law is not None and special.law.kind != "transcritical":
        return special.law.side if "pitchfork" in special.law.kind else 0.0
    # of a transcritical branch one side may turn back at once, in a fold: the slope is that right at the point
    near = leave(solver, special, direction, FIRST / 4 if special.law is None else NEAREST)
    return 0.0 if near is None else float(np.sign(near.load - special.point.load))


def fold_beside(solver: BranchSolver, special: SpecialPoint, direction: PETSc.Vec) -> SpecialPoint | None:
    """Fold of the branch that leaves ``special`` along ``direction``, nearer than :data:`NEAREST`; None without one.

    With ``load = load_b + b a + c a^2`` in the amplitude a there is one at ``a = -b/(2 c)``, and ``b^2/(4 |c|)`` from
    the branch point: eigenvalues and loads there are round-off next to each other.  The load as a function of the
    amplitude is regular at the branch point, and is interpolated about it.  Where the two loads differ by less than
    :data:`SEEN` times their uncertainty a note says so, and by less than that they are one.  ``solver`` has the mesh.
    """
    if special.test_function != "mu" or (special.law is not None and special.law.kind == "vertical branch"):
        return None
    loads = []
    for amplitude in (NEAREST, -NEAREST):
        x = special.point.x + direction * amplitude
        if not correct(solver.system, x, solver.row(direction), reach=CLOSE * NEAREST).converged:
            return None
        loads.append(solver.system.scalar(x) - special.point.load)
    odd, even = (loads[0] - loads[1]) / 2, (loads[0] + loads[1]) / 2
    if odd * even >= 0 or abs(odd) >= 2 * abs(even):
        return None
    apart = odd * odd / (4 * abs(even))
    if apart <= SEEN * special.located_to:
        if apart > special.located_to:
            special.note = f"a branch that leaves here turns back in a fold that is {apart:.0e} away in load"
        return None
    located = refine(
        solver,
        lambda s: (special.point.x + direction * s, direction),
        -NEAREST * odd / (2 * even),
        WINDOW,
        special.null_vectors[0],
        "slope",
    )
    fold = special_at(solver, located, distance(solver.system, special.point.x, located.x))
    fold.kind, fold.test_function = FOLD, "slope"
    return fold


def _changed(special: SpecialPoint, side: float, ways: int, first: Point) -> bool:
    """Whether the load has turned back before the point ``first`` of a branch, or its index is another one there."""
    begins = index_beside(special, first.load, ways)
    if special.law is not None and special.law.kind == "vertical branch":
        return False
    if begins is not None and not first.negative <= begins <= first.negative + first.zero:
        return True
    return min((first.load - special.point.load) * side, first.slope * side) < 0

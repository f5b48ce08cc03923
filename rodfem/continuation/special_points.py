r"""Special points: detection and classification of folds (turning points) and branch points.

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
from scipy.linalg import eigvals

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import VERTICAL, BranchSolver
from rodfem.continuation.interpolant import Located
from rodfem.continuation.kinds import BRANCH_POINT, FOLD
from rodfem.continuation.locate import across, locate, locate_mode
from rodfem.continuation.prediction import hermite
from rodfem.continuation.states_between import solve_at
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.linalg.matrices import EPS
from rodfem.stability.dependence import taut
from rodfem.stability.inertia import NULL, Factored, Index
from rodfem.stability.round_off import Decision, decide, quotient_error, resolve
from rodfem.tolerances import ROUND_OFF, SAME_LOAD

COUPLED = 1e-5
"""A fold has a cosine between null vector and load derivative above this, a branch point below."""
UNCOUPLED = 1e-9
"""Below this it is round-off.  Between the two the index decides, and then the unfolding parameters."""
LEVEL = 1e-3
"""Slope of the load, relative to its span, below which it is taken for zero."""
INSENSITIVE, ROUNDED = 1e-10, 10.0 * EPS
"""A derivative of the equations in the load smaller than this, relative to bending, or to the Jacobian, is zero."""
MISSED = 10.0
"""Eigenvalues within the band of a count are zero at a located point up to so many of its uncertainties."""
APART = 1e-7
"""Arclength above which there is a state to count at between two special points."""


class Taut(ConvergenceError):
    """The load turns back where a rod that cannot stretch is straight between its ends: no special point."""


def special_at(
    solver: BranchSolver, located: Located, arclength: float, still: Sequence[PETSc.Vec] = ()
) -> SpecialPoint:
    """Evaluate and classify a located point: multiplicity, null vectors, coupling to the load, kind.

    Vectors of eigenvalues that are zero on the whole branch (``still``) are none of its null vectors.  ``solver`` has
    the mesh, ``located`` is the zero found there, ``arclength`` that of the point.  Raises :class:`ConvergenceError`
    where no null vector is left, and :class:`Taut` where none is to be.
    """
    system, inertia = solver.system, solver.inertia
    x = located.x
    tangent = located.tangent / system.norm(located.tangent)
    found = inertia.at(x)
    index, missed = _index_of(decide(found), found, located)
    point = solver.point(x, arclength, tangent, index=index)
    null_count = point.zero - found.drifts
    if null_count < 1 and taut(solver.shape, x):
        raise Taut(_at_the_taut_state(solver, point.load))
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
    apart = _apart(solver, found, vectors, located)
    left = located.uncertainty + missed
    special = SpecialPoint(
        kind, point, located.before, located.after, left + apart, [v.copy() for v in vectors], coupling
    )
    if apart > left:
        special.note = f"{len(vectors)} eigenvalues that are not told apart vanish within {apart:.0e}"
    return special


def _at_the_taut_state(solver: BranchSolver, load: float) -> str:
    """Sentence on a taut state at a ``load``, which is known to round-off."""
    span, name = solver.system.scene.span, solver.system.scene.load
    known = load if abs(load) > ROUND_OFF * solver.units.load else 0.0
    at_end = min(abs(load - bound) for bound in span) < SAME_LOAD * abs(span[1] - span[0])
    where = f"The range ends at {name} = {known:.8g}, where" if at_end else f"At {name} = {known:.8g}"
    return (
        f"{where} the rod is taut: it cannot stretch, and any tension balances it; the branch turns back there, "
        "through no special point, and what else leaves that state is not followed; end the range before it, or let "
        "the rod stretch."
    )


def _index_of(decision: Decision, found: Factored, located: Located) -> tuple[Index, float]:
    """Index at a located point, and the uncertainty of its load by round-off that the location does not show.

    An eigenvalue is located by solutions with factors, and decided by Rayleigh quotients.  On long uniform meshes
    rounding is alike in all elements and adds up, differently for the two: what the quotients miss zero by counts
    twice.  No more than :data:`MISSED` times the uncertainty of the location, it is a zero nevertheless.
    """
    index = decision.index
    near = abs(decision.inside) <= MISSED * abs(located.rate) * located.along
    if index.zero > found.drifts or not near.any():
        return index, 0.0
    negative = int((near & (decision.inside < 0)).sum())
    index = replace(index, negative=index.negative - negative, zero=index.zero + int(near.sum()))
    return index, 2 * float(abs(decision.inside[near]).max() * abs(located.slope / located.rate))


def _apart(solver: BranchSolver, found: Factored, vectors: Sequence[PETSc.Vec], located: Located) -> float:
    """How far apart in load the eigenvalues of several null ``vectors`` vanish that count as zero at a located point.

    On the span of these vectors the pencil changes linearly along the branch, ``A + s B``: it is singular at one ``s``
    for each of them, slow ones far from where fast ones are.  Twice the largest distance; none within round-off.
    """
    if len(vectors) < 2:
        return 0.0
    small = _on_span(found, vectors)
    if abs(small).max() <= max(quotient_error(found.matrix, v) for v in vectors):
        return 0.0
    first, last = located.nodes[0], located.nodes[-1]
    rates = _on_span(solver.inertia.at(last.x), vectors) - _on_span(solver.inertia.at(first.x), vectors)
    places = eigvals(small, -rates / (last.s - first.s), homogeneous_eigvals=True)
    distances = [abs(p / q) for p, q in places.T if abs(q) > EPS * abs(p)]  # one that does not change is zero nowhere
    return 2 * float(max(distances, default=0.0)) * abs(located.slope)


def _on_span(found: Factored, vectors: Sequence[PETSc.Vec]) -> np.ndarray:
    """Second variation at a state between orthonormal ``vectors``."""
    images = [found.matrix * v for v in vectors]
    return np.array([[v.dot(w) for w in images] for v in vectors]) + found.shift * np.eye(len(vectors))


def coupling_of(solver: BranchSolver, x: PETSc.Vec, null_vector: PETSc.Vec) -> float:
    """Cosine between a null vector and ``F_lam``, the derivative of the equations in the load at ``x``."""
    system = solver.system
    matrix = system.at(x).jacobian(solver.axis)
    derivative = matrix * solver.axis
    system.set_load(derivative, 0.0)
    derivative, null_vector = system.in_units(derivative, 1), system.in_units(null_vector, -1)
    # by a load of natural size; of a trivial state the equations do not feel it
    least = max(INSENSITIVE * system.stiffness_scale, ROUNDED * system.matrix_in_units(matrix).norm())
    if derivative.norm() * solver.units.load < least:
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
            rest = [order for order in rest if not _explains(found[0], order)]
    still = solver.inertia.modes_near_zero(a.x, persistent) if rest and persistent else []
    while rest:
        special = _special(solver, a, b, rest[0], "mu", still)
        known = special if _beyond(special, a, b) else same_point(solver, special, found)
        if known is not None:
            try:
                special = _another(solver, a, b, known, still, found)
            except ConvergenceError:
                changed = known.negative_before != known.negative_after
                if not (known.test_function == "slope" and changed and _explains(known, rest[0])):
                    raise
                # a fold that hardly feels the load: where a side branch ends an eigenvalue only touches zero
                special, known.kind = known, FOLD
        if special is not known:
            found.append(special)
        del rest[: special.multiplicity]
    found.sort(key=lambda s: s.point.arclength)
    _count_between(solver, a, b, found)
    return found


def _explains(special: SpecialPoint, order: int) -> bool:
    """Whether eigenvalue number ``order`` is one of those that vanish at a special point."""
    own = min(special.negative_before, special.negative_after)
    return own <= order < own + special.multiplicity


def same_point(solver: BranchSolver, special: SpecialPoint, found: Sequence[SpecialPoint]) -> SpecialPoint | None:
    """Special point among those found at which the same eigenvalues vanish at the same place, if there is one."""
    for known in found:
        near = abs(special.point.arclength - known.point.arclength) < APART
        if near and not across(solver.system, special.null_vectors, known.null_vectors):
            return known
    return None


def _beyond(special: SpecialPoint, a: Point, b: Point) -> bool:
    """Whether a point found is one of the piece next to that from ``a`` to ``b``, whose indices it does not explain.

    Of two eigenvalues that pass zero next to a row, one on either side of it, either may be taken for the other.
    """
    outside = max(a.arclength - special.point.arclength, special.point.arclength - b.arclength)
    change = special.negative_after - special.negative_before
    return outside > max(APART, special.located_to) and change * (b.negative - a.negative) <= 0


def _another(
    solver: BranchSolver,
    a: Point,
    b: Point,
    known: SpecialPoint,
    still: Sequence[PETSc.Vec],
    found: Sequence[SpecialPoint],
) -> SpecialPoint:
    """Zero of the eigenvalue nearest zero at a ``known`` special point between ``a`` and ``b`` that is none of its own.

    Where eigenvalues pass each other next to zero their numbers do not tell which is which, and their vectors do.
    ``solver`` has the mesh, ``still`` are the persistent null vectors.  Raises :class:`ConvergenceError` where there is
    none beside those ``found``.
    """
    own = [*still, *known.null_vectors]
    vectors = solver.inertia.modes_near_zero(known.point.x, len(own) + 1)
    mode = across(solver.system, vectors, own)[0]
    located = locate_mode(solver, a, b, known.point.arclength, mode, len(still))
    special = special_at(solver, located, located.s, still)
    if _beyond(special, a, b) or same_point(solver, special, found) is not None:
        raise ConvergenceError(
            f"Beside load {known.point.load:.8g} another eigenvalue vanishes, where none was found", SMALLER_STEPS
        )
    return special


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


def _special(
    solver: BranchSolver, a: Point, b: Point, order: int, test_function: str, still: Sequence[PETSc.Vec] = ()
) -> SpecialPoint:
    located = locate(solver, a, b, order, test_function, still)
    special = special_at(solver, located, located.s, still)
    special.test_function = test_function
    if test_function == "slope" and abs(located.after - located.before) == 1 and special.coupling > UNCOUPLED:
        special.kind = FOLD  # an eigenvalue crosses zero with the slope; where a side branch ends it only touches zero
    return special

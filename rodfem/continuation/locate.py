r"""Location of special points: zeros of a test function, an eigenvalue or the slope of the load, on a branch.

The slope of the load vanishes at a fold (turning point), an eigenvalue there and at branch points.  The bordered system
is (nearly) singular near such a point, where equilibria are therefore not computed.  The branch is solved at Chebyshev
nodes on a short interval around the point; the eigenvalue, the load and the state are smooth functions of arclength,
and are interpolated with spectral accuracy.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.interpolant import FEWER, NODES, SHARP, Located, Sample, interpolate
from rodfem.continuation.prediction import hermite
from rodfem.continuation.states_between import Curve, solve_at, solve_beside
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import project_out
from rodfem.stability.inertia import ROUGH
from rodfem.stability.round_off import resolve
from rodfem.tolerances import unit

WINDOW = 0.02
"""Half length, in the metric, of the interval of a branch on which a special point is interpolated."""
NARROW = 0.25
"""Part of it that will do for an eigenvalue, whose zero is known to a tenth of it: a wider one is always narrowed."""
NEAREST = 1e-3
"""Distance of a fold from the branch point that its branch leaves, within which eigenvalues are zero to round-off."""
PART = 0.02
"""Relative uncertainty at which the difference of two loads is accepted."""
RESOLVED = 1e-13
"""Half length of a piece, relative to the arclength, below which its nodes are one point to round-off."""
OFF = 1e-3
"""Distance beside a singular state at which one is solved for instead, relative to the piece."""
ORDERED = 1e-4
"""Relative change of eigenvalues nearest zero at which their order is known."""
BESIDE = 6
"""Number of eigenvalues on either side of a crossing among which the one that crosses is looked for."""
NARROWER = 6
"""Largest number of times a bracket is narrowed until the crossing eigenvalue is among those nearest zero."""


def across(system: System, vectors: Sequence[PETSc.Vec], still: Sequence[PETSc.Vec]) -> list[PETSc.Vec]:
    """Metric-orthonormal basis of span(``vectors``) modulo span(``still``), the persistent null vectors."""
    known, out = list(still), []
    for vector in vectors:
        rest = vector.copy()
        # a remainder of less than half is round-off, or the error of the vectors: it spans nothing new
        project_out(rest, known, system.metric, times=2)
        if (size := system.norm(rest)) > 0.5 * system.norm(vector) or not still:
            rest.scale(1.0 / size)
            out.append(rest)
            known.append(rest)
    return out


def eigenvalue(
    solver: BranchSolver, x: PETSc.Vec, order: int, still: Sequence[PETSc.Vec] = ()
) -> tuple[float, PETSc.Vec]:
    """Eigenvalue number ``order`` (0 is the left-most) of the state ``x``, one of those near zero, and its vector.

    Eigenvalues of the vectors ``still``, zero on the whole branch, are not numbered.  ``solver`` has the mesh.  Raises
    :class:`ConvergenceError` where that eigenvalue is not among the nearest dozen.
    """
    found = solver.inertia.at(x)
    below = found.count().negative
    # its place among the eigenvalues of its sign, by their distance from zero
    position = order - below if order >= below else below - 1 - order
    for wanted in (position + 1, position + 3, position + 6, position + 12):
        values, vectors = found.nearest(wanted + len(still), ORDERED)
        if still:
            moving = [i for i, v in enumerate(vectors) if across(solver.system, [v], still)]
            values, vectors = values[moving], [vectors[i] for i in moving]
        side = np.flatnonzero(
            values >= -solver.inertia.tolerance if order >= below else values < -solver.inertia.tolerance
        )
        if len(side) > position:
            chosen = side[np.argsort(abs(values[side]))[position]]
            return float(values[chosen]), vectors[chosen]
    raise ConvergenceError(f"Eigenvalue number {order} is not among those nearest zero", SMALLER_STEPS)


def crossing_modes(
    solver: BranchSolver, curve: Curve, ends: tuple[float, float], order: int, still: Sequence[PETSc.Vec]
) -> Iterator[tuple[float, PETSc.Vec]]:
    """Yield where on a piece of a branch eigenvalue ``order`` changes its sign, nearly, and its vector there.

    To a tenth of what is interpolated, or so near that it is among the eigenvalues nearest to zero.  Where negative
    ones stay near zero it may have another number on the side of the piece where it is positive: if the first is not
    the one that crosses, the second is that without a partner there.  ``solver``, ``curve`` and ``still`` are those of
    :func:`eigenvalue` and :func:`sample`; ``ends`` are parameters.  Raises :class:`ConvergenceError` where the
    eigenvalue does not change its sign.
    """
    width = 0.1 * min(WINDOW, ends[1] - ends[0])
    for _ in range(NARROWER):
        negative, positive = bracket(solver, curve, ends, order, still, width)
        x, s = solve_beside(solver, curve, negative, OFF * width)
        try:
            mode = eigenvalue(solver, x, order, still)[1]
        except ConvergenceError:
            width /= 16
            continue
        yield s, mode
        if positive != negative:
            other = without_partner(solver, x, solve_beside(solver, curve, positive, OFF * width)[0], still)
            if other is not None:
                yield s, other
        return
    raise ConvergenceError(
        f"Eigenvalue number {order} is not among those nearest zero near load {solver.system.scalar(x):.8g}",
        SMALLER_STEPS,
    )


def without_partner(
    solver: BranchSolver, x: PETSc.Vec, beside: PETSc.Vec, still: Sequence[PETSc.Vec]
) -> PETSc.Vec | None:
    """Vector of the negative eigenvalue nearest zero at the state ``x`` that is none at a state ``beside`` it; or None.

    Vectors change little between the two, so that the one that has become positive is nearly orthogonal to those that
    are negative there.  ``solver`` and ``still`` are those of :func:`eigenvalue`.
    """

    def negative(state: PETSc.Vec) -> list[PETSc.Vec]:
        found = solver.inertia.at(state)
        found.count()
        values, vectors = found.nearest(BESIDE + len(still), ORDERED)
        return [vectors[i].copy() for i in np.argsort(abs(values)) if values[i] < 0.0]

    here, there = negative(x), negative(beside)
    return next((mode for mode in here if across(solver.system, [mode], [*still, *there])), None)


def bracket(
    solver: BranchSolver,
    curve: Curve,
    ends: tuple[float, float],
    order: int,
    still: Sequence[PETSc.Vec],
    width: float,
) -> tuple[float, float]:
    """Where on a piece of a branch eigenvalue ``order`` changes its sign, to ``width``.

    By bisection with counts: they know the number of an eigenvalue however many others lie nearer to zero.  The end
    where it is negative is the first: on the other side it may have changed its number with positive ones that stay
    near zero (torsion of a taut string, say).  Where the counts at both ends agree it is zero next to an end: the one
    at which it is smaller, twice.  ``solver``, ``curve`` and ``still`` are those of :func:`eigenvalue` and
    :func:`sample`; ``ends`` are parameters.
    """
    low, high = ends
    h = high - low

    def passed(s: float) -> bool:
        return solver.inertia.at(solve_beside(solver, curve, s, OFF * h)[0]).below(-solver.inertia.tolerance) > order

    first = passed(low)
    if first == passed(high):  # the zero is nearer to an end than a state can be solved
        left, right = (eigenvalue(solver, solve_beside(solver, curve, s, OFF * h)[0], order, still)[0] for s in ends)
        return (low, low) if abs(left) < abs(right) else (high, high)
    while high - low > width:
        middle = (low + high) / 2
        low, high = (middle, high) if passed(middle) == first else (low, middle)
    return (low, high) if first else (high, low)


def sample(
    solver: BranchSolver, curve: Curve, s: float, mode: PETSc.Vec, persistent: int = 0, counted: bool = True
) -> Sample:
    """Solve at ``s`` and evaluate ``1 / (mode . M S^-1 M mode)`` there.

    For a ``mode`` near the null vector this is the eigenvalue that vanishes, up to second order in their difference,
    but unlike the ordered eigenvalues it is smooth where others come by; its zero is where ``S`` is singular.
    Eigenvalues within the tolerance of zero, of which ``persistent`` stay zero, count by its sign.  Unless ``counted``,
    they are among those below: one factorisation instead of two.  ``solver`` has the mesh, and ``curve(s)`` returns a
    predicted state and the direction of the branch there.
    """
    x = solve_at(solver, curve, s)
    found = solver.inertia.at(x)
    if not counted:
        below = found.below(solver.inertia.tolerance)
        return Sample(s, x, solver.system.scalar(x), found.response(mode), below, found)
    index = found.count()
    mu = found.response(mode)
    crossing = index.zero - found.drifts - persistent
    if crossing < 2:  # a small one takes the sign of this one
        low, high = index.negative, index.negative + max(crossing, 0)
    else:  # several, each by its own quotient: they may have opposite signs
        low, high = resolve(found)
        high = min(high, index.negative + crossing)
    return Sample(s, x, solver.system.scalar(x), mu, high if mu < 0 else low, found)


def refine(
    solver: BranchSolver,
    curve: Curve,
    center: float,
    half: float,
    mode: PETSc.Vec,
    test_function: str,
    persistent: int = 0,
    beside: float | None = None,
    ends: tuple[float, float] = (-inf, inf),
) -> Located:
    """Solve at Chebyshev nodes around ``center``, moved until the zero lies among them, shrunk until it is sharp.

    Where only the distance of its load from the one ``beside`` it is wanted, that to :data:`PART` of itself is sharp
    enough, :data:`FEWER` nodes do for an eigenvalue, and nothing is counted.  ``curve(s)`` returns a predicted state
    and direction on the mesh of ``solver``; ``half`` is the first half length of the piece.  ``test_function`` is
    ``mu`` or ``slope``, ``mode`` is near the null vector, and ``persistent`` eigenvalues stay zero.  A zero between the
    ``ends`` is preferred to others.  Raises :class:`ConvergenceError` where no zero is found near by.
    """
    best: Located | None = None
    one = solver.units.load
    count = FEWER if beside is not None and test_function == "mu" else NODES
    for _ in range(10):
        if half < RESOLVED * unit(center, one=1.0):
            break
        nodes = center + half * np.cos(np.pi * (np.arange(count)[::-1] + 0.5) / count)
        samples = [sample(solver, curve, s, mode, persistent, counted=beside is None) for s in nodes]
        located = interpolate(samples, test_function, center, one, samples[-1].found.noise(mode), ends)
        # inside the nodes the interpolant is trusted: sharpen; outside it, move there; without a zero, by a secant
        if located is not None and abs(located.s - center) <= half:
            sharp = SHARP * one if beside is None else max(SHARP * one, PART * abs(located.load - beside))
            # a shorter piece that gains less than a digit has met round-off
            settled = best is not None and located.uncertainty > 0.1 * best.uncertainty
            if settled or located.uncertainty - located.arithmetic < sharp:
                return located if best is None or located.uncertainty < best.uncertainty else best
            best, center, half = located, located.s, half / 4
        elif located is not None:
            center = located.s
        elif best is not None:
            return best
        else:
            mu = [samples[0].mu, samples[-1].mu] if test_function == "mu" else _slopes(samples)
            step = -mu[0] * (nodes[-1] - nodes[0]) / (mu[1] - mu[0]) if mu[1] != mu[0] else half
            center = nodes[0] + float(np.clip(step, -4 * half, 6 * half))
    if best is not None:
        return best
    load = solver.system.scalar(curve(center)[0])
    raise ConvergenceError(f"A special point near load {load:.8g} could not be located", SMALLER_STEPS)


def _slopes(samples: list[Sample]) -> list[float]:
    """Slopes of the load at both ends of a piece."""
    a, b, y, z = samples[0], samples[1], samples[-2], samples[-1]
    return [(b.load - a.load) / (b.s - a.s), (z.load - y.load) / (z.s - y.s)]


def locate(
    solver: BranchSolver, a: Point, b: Point, order: int, test_function: str, still: Sequence[PETSc.Vec] = ()
) -> Located:
    """Locate the zero of eigenvalue ``order`` (or of the load's slope) between two points of a branch.

    The points ``a`` and ``b`` are neighbours on the mesh of ``solver``; ``test_function`` is ``mu`` or ``slope``, and
    ``still`` are the persistent null vectors.  Raises :class:`ConvergenceError` where no zero is found.
    """

    def curve(s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        return hermite(a, b, s)

    h, ends = b.arclength - a.arclength, (a.arclength, b.arclength)
    if test_function == "slope":
        x, guess = solve_beside(solver, curve, a.arclength + h * a.slope / (a.slope - b.slope), OFF * h)
        (mode,) = solver.inertia.modes_near_zero(x, 1, ROUGH)
        half = min(WINDOW, 0.45 * h)
        return _inside(refine(solver, curve, guess, half, mode, test_function, len(still), ends=ends), a, b)
    piece, half = (a.arclength + OFF * h, b.arclength - OFF * h), min(NARROW * WINDOW, 0.45 * h)
    trouble: ConvergenceError | None = None
    for guess, mode in crossing_modes(solver, curve, piece, order, still):
        try:
            return _inside(refine(solver, curve, guess, half, mode, test_function, len(still), ends=ends), a, b)
        except ConvergenceError as error:
            trouble = trouble or error
    assert trouble is not None
    raise trouble


def _inside(located: Located, a: Point, b: Point) -> Located:
    """What is located between two points, or nearly; else raises :class:`ConvergenceError`."""
    margin = 0.01 * (b.arclength - a.arclength)
    if not a.arclength - margin <= located.s <= b.arclength + margin:
        raise ConvergenceError(
            f"A special point between loads {a.load:.8g} and {b.load:.8g} slipped out of its bracket", SMALLER_STEPS
        )
    return located


def locate_mode(solver: BranchSolver, a: Point, b: Point, guess: float, mode: PETSc.Vec, persistent: int) -> Located:
    """Locate the zero of the eigenvalue of a ``mode`` near the arclength ``guess`` between two points of a branch.

    ``solver`` has the mesh of the points ``a`` and ``b``; ``persistent`` eigenvalues stay zero.  Raises
    :class:`ConvergenceError` where no zero is found.
    """
    half = min(WINDOW, 0.45 * (b.arclength - a.arclength))
    return refine(solver, lambda s: hermite(a, b, s), guess, half, mode, "mu", persistent)

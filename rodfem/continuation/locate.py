r"""Location of special points: zeros of a test function, an eigenvalue or the slope of the load, on a branch.

The slope of the load vanishes at a fold (turning point), an eigenvalue there and at branch points.  The bordered system
is (nearly) singular near such a point, where equilibria are therefore not computed.  The branch is solved at Chebyshev
nodes on a short interval around the point; the eigenvalue, the load and the state are smooth functions of arclength,
and are interpolated with spectral accuracy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.prediction import hermite
from rodfem.continuation.solvers import BranchSolver, distance
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.newton import NewtonResult, correct
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import combine, project_out
from rodfem.problem.events import Event
from rodfem.roots import zero_between
from rodfem.stability.inertia import ROUGH, Factored
from rodfem.stability.round_off import resolve
from rodfem.tolerances import INSIDE, round_off, unit

NODES, FEWER = 6, 4
"""Number of nodes of an interpolant, and of one over a very short piece, unless it is even."""
STEADILY = 4.0
"""Safety factor on the decay of the coefficients of an even series: it is told by one ratio, and changes."""
WINDOW = 0.02
"""Half length, in the metric, of the interval of a branch on which a special point is interpolated."""
NARROW = 0.25
"""Part of it that will do for an eigenvalue, whose zero is known to a tenth of it: a wider one is always narrowed."""
SHARP = 1e-11
"""Uncertainty of a load on the given mesh below which the interpolation is not refined further."""
NEAREST = 1e-3
"""Distance of a fold from the branch point that its branch leaves, within which eigenvalues are zero to round-off."""
PART = 0.02
"""Relative uncertainty at which the difference of two loads is accepted."""

OFF = 1e-3
"""Distance beside a singular state at which one is solved for instead, relative to the piece."""
ASIDE = 1e-6
"""Distance beside a singular point at which an event's equations are solved, relative to the piece."""
REAL = 1e-6
"""Imaginary part below which a zero of an interpolant, in half lengths of its interval, is real."""
ORDERED = 1e-4
"""Relative change of eigenvalues nearest zero at which their order is known."""
RESOLVED = 1e-13
"""Half length of a piece, relative to the arclength, below which its nodes are one point to round-off."""
ALONG = 1e-13
"""Arclength to which an event is located, in the metric."""
NARROWER = 6
"""Largest number of times a bracket is narrowed until the crossing eigenvalue is among those nearest zero."""

EXACT = 1e-15
"""Arclength, in the metric, to which a load is located before it is set."""
CORRECTIONS = 3
"""Newton steps on the interpolated load that improve the arclength at which a state is expected."""
ON_THE_WAY = 0.5
"""Distance of a state from where it is expected, over that from the nearer neighbour, below which it is on the way."""
INTERPOLATED = 1e-7
"""Distance of a state from where it is expected, in the metric, that is the error of the interpolation."""

Curve = Callable[[float], tuple[PETSc.Vec, PETSc.Vec]]


@dataclass
class Sample:
    """A solved point of a piece of a branch: parameter ``s``, state ``x``, load, eigenvalue ``mu``, index ``below``.

    ``found`` are its factors, until the next sample.
    """

    s: float
    x: PETSc.Vec
    load: float
    mu: float
    below: int
    found: Factored


def solve_at(solver: BranchSolver, curve: Curve, s: float) -> PETSc.Vec:
    """Equilibrium on the plane through ``curve(s)`` across its direction; raises :class:`ConvergenceError`."""
    start, direction = curve(s)
    system, row, before = solver.system, solver.row(direction), solver.system.damping
    try:  # beside a state that may move freely, where Newton's method slides away: with damping
        for system.damping in dict.fromkeys((before, before or solver.inertia.tolerance)):
            x = start.copy()
            if correct(system, x, row).converged:
                return x
    finally:
        system.damping = before
    raise ConvergenceError(
        f"No equilibrium near load {system.scalar(start):.8g} while locating a special point", SMALLER_STEPS
    )


def solve_at_load(
    solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float
) -> tuple[PETSc.Vec, float, NewtonResult]:
    """State at exactly ``load`` between two neighbours ``p``, ``q`` of a branch, its arclength, and the last iteration.

    Close to a branch point Newton's method at a fixed load fails, or ends on the other branch: far from where the
    ``curve`` that interpolates the branch is.  On planes across the branch it does not, and the load is a function of
    arclength there, whose zero is found.  ``solver`` has the mesh.  Raises :class:`ConvergenceError` where there is no
    such state.
    """
    system, s = solver.system, _expected(solver, curve, p, q, load)
    guess = curve(s)[0]
    x, outcome = solver.at_load(guess, load, reach=1.0)
    if outcome.converged:
        near = min(distance(system, p.x, x), distance(system, q.x, x))
        if load in (p.load, q.load) or distance(system, guess, x) < max(ON_THE_WAY * near, INTERPOLATED):
            return x, s, outcome
    if (p.load - load) * (q.load - load) >= 0:
        raise ConvergenceError(
            f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another load."
        )

    known = {p.arclength: p.load, q.arclength: q.load}  # there the equations may be singular

    def beyond(s: float) -> float:
        return (known[s] if s in known else system.scalar(solve_at(solver, curve, s))) - load

    margin = INSIDE * (q.arclength - p.arclength)
    s = zero_between(beyond, p.arclength, q.arclength, EXACT)
    s = min(max(s, p.arclength + margin), q.arclength - margin)
    x = solve_at(solver, curve, s)
    system.set_load(x, load)
    return x, s, outcome


def _expected(solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float) -> float:
    """Arclength between ``p`` and ``q`` at which the interpolated branch has a ``load``."""
    s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
    for _ in range(CORRECTIONS):
        x, direction = curve(s)
        slope = solver.system.scalar(direction)
        if slope:
            there = s + (load - solver.system.scalar(x)) / slope
            # never onto an end, at another load: beside a branch point that is a state of the other branch
            s = min(max(there, (p.arclength + s) / 2), (s + q.arclength) / 2)
    return s


def solve_beside(solver: BranchSolver, curve: Curve, s: float, aside: float) -> tuple[PETSc.Vec, float]:
    """Solve at ``s``, or at ``s + aside`` if the bordered matrix is singular there; returns state and parameter.

    ``solver`` has the mesh, and ``curve(s)`` returns a predicted state and the direction of the branch there.
    """
    try:
        return solve_at(solver, curve, s), s
    except ConvergenceError:
        return solve_at(solver, curve, s + aside), s + aside


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


@dataclass
class Located:
    """A zero found on a piece of a branch: parameter, state, direction, load, slope of the load, uncertainty, index.

    The ``uncertainty`` is of the load, ``along`` is that of the parameter, and ``arithmetic`` the part of the first
    that no sharper interpolation lowers.  At the parameter ``s`` the state is ``x``, the direction ``tangent``, and
    ``slope`` the load's derivative along it, ``rate`` that of the eigenvalue; the index is ``before`` and ``after`` it.
    """

    s: float
    x: PETSc.Vec
    tangent: PETSc.Vec
    load: float
    slope: float
    uncertainty: float
    before: int
    after: int
    along: float
    arithmetic: float
    rate: float


def interpolate(
    samples: list[Sample],
    test_function: str,
    guess: float,
    one: float,
    noise: float = 0.0,
    ends: tuple[float, float] = (-inf, inf),
) -> Located | None:
    """Zero of ``mu`` or of the load's slope by Chebyshev interpolation; None where it is not near the piece.

    The uncertainty of the load is what the last coefficients of the two interpolants can contribute at the zero, at
    least what the solver's tolerance leaves open, and what round-off of size ``noise`` in ``mu``, the same in all
    samples, moves the zero by.  ``samples`` are at Chebyshev nodes; ``test_function`` is ``mu`` or ``slope``; of
    several zeros the one nearest to the parameter ``guess`` is taken, one between the ``ends`` where there is one.
    ``one`` is the natural size of the load.
    """
    s = np.array([p.s for p in samples])
    middle, half = (s[0] + s[-1]) / 2, (s[-1] - s[0]) / 2
    t = (s - middle) / half
    loads, values = np.array([p.load for p in samples]), np.array([p.mu for p in samples])
    load = chebyshev.chebfit(t, loads - loads[0], len(t) - 1)
    slope = chebyshev.chebder(load)
    # the test function: an eigenvalue at a branch point, the load's derivative at a fold (turning point)
    mu = chebyshev.chebfit(t, values, len(t) - 1)
    f = mu if test_function == "mu" else slope
    root = real_root(f, (guess - middle) / half, *((end - middle) / half for end in ends))
    if root is None:
        return None
    load_at = float(chebyshev.chebval(root, load)) + loads[0]
    slope_at = float(chebyshev.chebval(root, slope))
    left = zero_uncertainty(f, root)
    # the last coefficients bound what the series leaves out; a shift of the zero moves the load by its slope
    tail = left_out(load) + abs(slope_at) * left
    floor = round_off(load_at, one)
    moved = abs(noise / float(chebyshev.chebval(root, chebyshev.chebder(f)))) if test_function == "mu" else 0.0
    arithmetic = floor + abs(slope_at) * moved
    weights, slopes = _barycentric(t, root)
    states = [p.x for p in samples]
    x, tangent = combine(states, weights), combine(states, slopes / half)
    before = [p.below for p in samples if p.s < middle + half * root] or [samples[0].below]
    after = [p.below for p in samples if p.s >= middle + half * root] or [samples[-1].below]
    return Located(
        *(middle + half * root, x, tangent, load_at, slope_at / half, max(tail - floor, 0.0) + arithmetic),
        *(before[-1], after[0], half * (left + moved), arithmetic),
        float(chebyshev.chebval(root, chebyshev.chebder(mu))) / half,
    )


def real_root(series: np.ndarray, guess: float, low: float = -inf, high: float = inf) -> float | None:
    """Real zero nearest to ``guess`` of a Chebyshev series on [-1, 1], or a little outside; None without one.

    Zeros between ``low`` and ``high`` come first.
    """
    roots = chebyshev.chebroots(series)
    real = roots[abs(roots.imag) < REAL].real
    real = real[abs(real) <= 1.5]
    within = real[(low <= real) & (real <= high)]
    real = within if len(within) else real
    return float(real[np.argmin(abs(real - guess))]) if len(real) else None


def zero_uncertainty(series: np.ndarray, root: float) -> float:
    """How far the last coefficient of a Chebyshev series can move its ``root``."""
    slope = float(chebyshev.chebval(root, chebyshev.chebder(series)))
    return float(abs(series[-1] / slope)) if slope else float("inf")


def left_out(series: np.ndarray) -> float:
    """Size of what a Chebyshev series leaves out: that of its last coefficient, or what the one before it decays to.

    Where a branch passes into its own mirror image the load is even about that point, and the last coefficient, an odd
    one, is zero however much is left out.  The even ones before it decay geometrically.
    """
    odd = float(abs(series[-1]))
    if len(series) < NODES:
        return odd
    before, even = abs(series[[-4, -2]])
    return max(odd, float(even * min(STEADILY * even / before, 1.0)) if before else float(even))


def _barycentric(nodes: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the values at nodes in the interpolating polynomial at ``t`` and in its derivative."""
    degree = len(nodes) - 1
    inverse = np.linalg.inv(chebyshev.chebvander(nodes, degree))
    derivative = chebyshev.chebder(np.eye(degree + 1), axis=0)
    value, slope = (chebyshev.chebvander(np.array([t]), d)[0] for d in (degree, degree - 1))
    return value @ inverse, slope @ derivative @ inverse


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


def crossing_mode(
    solver: BranchSolver, curve: Curve, ends: tuple[float, float], order: int, still: Sequence[PETSc.Vec]
) -> tuple[float, PETSc.Vec]:
    """Where on a piece of a branch eigenvalue ``order`` changes its sign, nearly, and its vector there.

    To a tenth of what is interpolated, or so near that it is among the eigenvalues nearest to zero.  ``solver``,
    ``curve`` and ``still`` are those of :func:`eigenvalue` and :func:`sample`; ``ends`` are parameters.  Raises
    :class:`ConvergenceError` where the eigenvalue does not change its sign.
    """
    width = 0.1 * min(WINDOW, ends[1] - ends[0])
    for _ in range(NARROWER):
        x, s = solve_beside(solver, curve, bracket(solver, curve, ends, order, still, width), OFF * width)
        try:
            return s, eigenvalue(solver, x, order, still)[1]
        except ConvergenceError:
            width /= 16
    raise ConvergenceError(
        f"Eigenvalue number {order} is not among those nearest zero near load {solver.system.scalar(x):.8g}",
        SMALLER_STEPS,
    )


def bracket(
    solver: BranchSolver,
    curve: Curve,
    ends: tuple[float, float],
    order: int,
    still: Sequence[PETSc.Vec],
    width: float,
) -> float:
    """Where on a piece of a branch eigenvalue ``order`` changes its sign, to ``width``.

    By bisection with counts: they know the number of an eigenvalue however many others lie nearer to zero.  The end
    where it is negative is returned: on the other side it may have changed its number with positive ones that stay near
    zero (torsion of a taut string, say).  Where the counts at both ends agree it is zero next to an end: the one at
    which it is smaller.  ``solver``, ``curve`` and ``still`` are those of :func:`eigenvalue` and :func:`sample`;
    ``ends`` are parameters.
    """
    low, high = ends
    h = high - low

    def passed(s: float) -> bool:
        return solver.inertia.at(solve_beside(solver, curve, s, OFF * h)[0]).below(-solver.inertia.tolerance) > order

    first = passed(low)
    if first == passed(high):  # the zero is nearer to an end than a state can be solved
        left, right = (eigenvalue(solver, solve_beside(solver, curve, s, OFF * h)[0], order, still)[0] for s in ends)
        return low if abs(left) < abs(right) else high
    while high - low > width:
        middle = (low + high) / 2
        low, high = (middle, high) if passed(middle) == first else (low, middle)
    return low if first else high


def locate(
    solver: BranchSolver, a: Point, b: Point, order: int, test_function: str, still: Sequence[PETSc.Vec] = ()
) -> Located:
    """Locate the zero of eigenvalue ``order`` (or of the load's slope) between two points of a branch.

    The points ``a`` and ``b`` are neighbours on the mesh of ``solver``; ``test_function`` is ``mu`` or ``slope``, and
    ``still`` are the persistent null vectors.  Raises :class:`ConvergenceError` where no zero is found.
    """

    def curve(s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        return hermite(a, b, s)

    h, window = b.arclength - a.arclength, WINDOW
    if test_function == "slope":
        x, guess = solve_beside(solver, curve, a.arclength + h * a.slope / (a.slope - b.slope), OFF * h)
        (mode,) = solver.inertia.modes_near_zero(x, 1, ROUGH)
    else:
        piece = a.arclength + OFF * h, b.arclength - OFF * h
        guess, mode = crossing_mode(solver, curve, piece, order, still)
        window *= NARROW
    ends = a.arclength, b.arclength
    return refine(solver, curve, guess, min(window, 0.45 * h), mode, test_function, len(still), ends=ends)


def locate_mode(solver: BranchSolver, a: Point, b: Point, guess: float, mode: PETSc.Vec, persistent: int) -> Located:
    """Locate the zero of the eigenvalue of a ``mode`` near the arclength ``guess`` between two points of a branch.

    ``solver`` has the mesh of the points ``a`` and ``b``; ``persistent`` eigenvalues stay zero.  Raises
    :class:`ConvergenceError` where no zero is found.
    """
    half = min(WINDOW, 0.45 * (b.arclength - a.arclength))
    return refine(solver, lambda s: hermite(a, b, s), guess, half, mode, "mu", persistent)


def event_at(solver: BranchSolver, event: Event, x: PETSc.Vec) -> float:
    """Value of an event at a state; collective."""
    return event(solver.shape.sample(x))


def locate_event(
    solver: BranchSolver, event: Event, curve: Curve, low: float, high: float
) -> tuple[float, PETSc.Vec, float]:
    """Parameter, state and uncertainty of the parameter of an event on a piece of a branch.

    Where it happens at a branch point, at which the equations across the branch are singular, states beside it serve.
    Raises :class:`ConvergenceError` without a change of sign.  The ``event`` changes its sign between the parameters
    ``low`` and ``high`` of the ``curve``, on the mesh of ``solver``.
    """
    aside = ASIDE * (high - low)

    def value(s: float) -> float:
        return event_at(solver, event, solve_beside(solver, curve, s, aside)[0])

    if value(low) * value(high) > 0:
        raise ConvergenceError(f"The event {event.name!r} does not happen between the ends of the piece.")
    s = zero_between(value, low, high, ALONG)
    x, there = solve_beside(solver, curve, s, aside)
    return there, x, ALONG + 2 * abs(there - s)

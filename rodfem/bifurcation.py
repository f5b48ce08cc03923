r"""Special points: locating folds and branch points, telling them apart, and switching branches.

Between two points of a branch with different indices an eigenvalue ``mu`` of the second variation crosses zero; where the
load turns back, its slope does.  Near such a point the bordered system is (nearly) singular, so no equilibrium is computed
closer to it than need be: the branch is solved at Chebyshev nodes of a short piece around it, and ``mu``, the load and the state are
interpolated, all smooth functions of arclength, at spectral accuracy.

With ``phi`` the null vector (left and right, as ``S`` is symmetric) and ``F_lam`` the derivative of the equations in the load,
``phi . F_lam != 0`` at a fold and ``= 0`` at a branch point (Keller 1977).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc
from scipy.optimize import brentq

from rodfem.branch import BRANCH_POINT, FOLD, Branch, Point, Special
from rodfem.continuation import Follower, hermite
from rodfem.errors import ConvergenceError
from rodfem.newton import correct
from rodfem.stability.inertia import combine

NODES = 6
WINDOW = 0.02
"""Half length of the piece of a branch, in the metric, on which a special point is interpolated."""
ROUND_OFF = 1e-12
"""What Newton's tolerance and the conditioning near a singular point leave open in a load, relative to it or to one."""
SHARP = 1e-11
"""Uncertainty of a load, for the given mesh, at which a special point needs no sharper interpolation."""
COUPLED = 1e-5
"""A fold has a cosine between null vector and load derivative above this, a branch point below."""

Curve = Callable[[float], tuple[PETSc.Vec, PETSc.Vec]]


@dataclass
class Sample:
    """A solved point of a piece of a branch: parameter ``s``, state, load, the eigenvalue looked at, and the index."""

    s: float
    x: PETSc.Vec
    load: float
    mu: float
    below: int


def solve_at(follower: Follower, curve: Curve, s: float) -> PETSc.Vec:
    """Equilibrium on the plane through ``curve(s)`` across its direction; raises :class:`ConvergenceError`."""
    x, direction = curve(s)
    follower.system.set_phase(x)
    outcome = correct(follower.system, x, follower.row(direction))
    if not outcome.converged:
        raise ConvergenceError(f"No equilibrium near load {follower.system.scalar(x):.8g} while locating a special point.")
    return x


def eigenvalue(follower: Follower, x: PETSc.Vec, order: int) -> tuple[float, PETSc.Vec]:
    """Eigenvalue number ``order`` (0 is the left-most) of the state ``x`` and its vector; it must be one of those near zero."""
    below = follower.inertia.count(x).negative
    position = order - below if order >= below else below - 1 - order
    for wanted in (position + 1, position + 3, position + 6, position + 12):
        values, vectors = follower.inertia.nearest(wanted, accuracy=1e-4)
        side = np.flatnonzero(values >= -follower.inertia.tolerance if order >= below else values < -follower.inertia.tolerance)
        if len(side) > position:
            chosen = side[np.argsort(abs(values[side]))[position]]
            return float(values[chosen]), vectors[chosen].copy()
    raise ConvergenceError(f"Eigenvalue number {order} is not among those nearest zero; use smaller steps.")


def sample(follower: Follower, curve: Curve, s: float, mode: PETSc.Vec) -> Sample:
    """Solve at ``s`` and evaluate ``1 / (mode . M S^-1 M mode)`` there.

    For a ``mode`` near the null vector this is the eigenvalue that vanishes, up to second order in their difference, but unlike the
    ordered eigenvalues it is smooth where others come by; its zero is where ``S`` is singular.
    """
    x = solve_at(follower, curve, s)
    below = follower.inertia.count(x).negative
    return Sample(s, x, follower.system.scalar(x), follower.inertia.response(mode), below)


@dataclass
class Located:
    """A zero found on a piece of a branch: parameter, state, direction, load, slope of the load, uncertainty, index."""

    s: float
    x: PETSc.Vec
    tangent: PETSc.Vec
    load: float
    slope: float
    uncertainty: float
    before: int
    after: int


def interpolate(samples: list[Sample], zero_of: str, guess: float) -> Located | None:
    """Zero of ``mu`` or of the load's slope, by Chebyshev interpolation; None where it is not on (or just off) the piece.

    The uncertainty of the load compares the full interpolation with one that is a degree lower, and adds what the solver's
    tolerance leaves open.
    """
    s = np.array([p.s for p in samples])
    middle, half = (s[0] + s[-1]) / 2, (s[-1] - s[0]) / 2
    t = (s - middle) / half
    loads, values = np.array([p.load for p in samples]), np.array([p.mu for p in samples])
    found = []
    for degree in (len(s) - 1, len(s) - 2):
        load = chebyshev.chebfit(t, loads - loads[0], degree)
        f = chebyshev.chebfit(t, values, degree) if zero_of == "mu" else chebyshev.chebder(load)
        roots = chebyshev.chebroots(f)
        real = roots[abs(roots.imag) < 1e-6].real
        real = real[abs(real) <= 1.5]
        if not len(real):
            return None
        root = float(real[np.argmin(abs(real - (guess - middle) / half))])
        found.append((root, float(chebyshev.chebval(root, load)) + loads[0], float(chebyshev.chebval(root, chebyshev.chebder(load))) / half))
    (root, load_at, slope), (_, other, _) = found
    weights, slopes = _barycentric(t, root)
    states = [p.x for p in samples]
    x, tangent = combine(states, weights), combine(states, slopes / half)
    before = [p.below for p in samples if p.s < middle + half * root] or [samples[0].below]
    after = [p.below for p in samples if p.s >= middle + half * root] or [samples[-1].below]
    uncertainty = max(abs(load_at - other), ROUND_OFF * max(1.0, abs(load_at)))
    return Located(middle + half * root, x, tangent, load_at, slope, uncertainty, before[-1], after[0])


def _barycentric(nodes: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the values at nodes in the interpolating polynomial at ``t`` and in its derivative."""
    degree = len(nodes) - 1
    inverse = np.linalg.inv(chebyshev.chebvander(nodes, degree))
    derivative = chebyshev.chebder(np.eye(degree + 1), axis=0)
    return chebyshev.chebvander(np.array([t]), degree)[0] @ inverse, chebyshev.chebvander(np.array([t]), degree - 1)[0] @ derivative @ inverse


def refine(follower: Follower, curve: Curve, center: float, half: float, mode: PETSc.Vec, zero_of: str) -> Located:
    """Solve at Chebyshev nodes around ``center``: move them until the zero lies among them, shrink them until it is sharp."""
    best: Located | None = None
    for _ in range(10):
        nodes = center + half * np.cos(np.pi * (np.arange(NODES)[::-1] + 0.5) / NODES)
        samples = [sample(follower, curve, s, mode) for s in nodes]
        located = interpolate(samples, zero_of, center)
        if located is not None and abs(located.s - center) <= half:
            if located.uncertainty < SHARP or (best is not None and located.uncertainty > 0.1 * best.uncertainty):
                return located if best is None or located.uncertainty < best.uncertainty else best
            best, center, half = located, located.s, half / 4
        elif located is not None:
            center = located.s
        elif best is not None:
            return best
        else:
            mu = [samples[0].mu, samples[-1].mu] if zero_of == "mu" else _slopes(samples)
            step = -mu[0] * (nodes[-1] - nodes[0]) / (mu[1] - mu[0]) if mu[1] != mu[0] else half
            center = nodes[0] + float(np.clip(step, -4 * half, 6 * half))
    if best is not None:
        return best
    raise ConvergenceError(f"A special point near load {samples[0].load:.8g} could not be located; use smaller steps.")


def _slopes(samples: list[Sample]) -> list[float]:
    """Slopes of the load at both ends of a piece."""
    a, b, y, z = samples[0], samples[1], samples[-2], samples[-1]
    return [(b.load - a.load) / (b.s - a.s), (z.load - y.load) / (z.s - y.s)]


def locate(follower: Follower, a: Point, b: Point, order: int, zero_of: str) -> Located:
    """Locate the zero of eigenvalue ``order`` (or of the load's slope) between two points of a branch."""

    def curve(s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        return hermite(a, b, s)

    h = b.arclength - a.arclength
    if zero_of == "slope":
        guess = a.arclength + h * a.slope / (a.slope - b.slope)
    else:
        ends = a.arclength + 1e-3 * h, b.arclength - 1e-3 * h

        def mu(s: float) -> float:
            return eigenvalue(follower, solve_at(follower, curve, s), order)[0]

        left, right = mu(ends[0]), mu(ends[1])
        if left * right > 0:
            guess = ends[0] if abs(left) < abs(right) else ends[1]
        else:
            guess = float(brentq(mu, *ends, xtol=0.1 * min(WINDOW, h)))
    x = solve_at(follower, curve, guess)
    if zero_of == "slope":
        follower.inertia.count(x)
        mode = follower.inertia.nearest(1, accuracy=1e-2)[1][0].copy()
    else:
        mode = eigenvalue(follower, x, order)[1]
    return refine(follower, curve, guess, min(WINDOW, 0.45 * h), mode, zero_of)


def special_at(follower: Follower, located: Located, arclength: float) -> Special:
    """Evaluate and classify a located point: multiplicity, null vectors, coupling to the load, kind."""
    system, inertia = follower.system, follower.inertia
    x = located.x
    system.set_phase(x)
    tangent = located.tangent
    tangent.scale(1.0 / system.norm(tangent))
    point = follower.point(x, arclength, tangent)
    null_count = max(point.zero - system.active_drifts(), 1)
    _, vectors = inertia.nearest(null_count, accuracy=1e-8)
    coupling = max(coupling_of(follower, x, v) for v in vectors)
    turning = abs(system.scalar(tangent)) < 1e-3 * abs(system.scene.span[1] - system.scene.span[0])
    kind = FOLD if turning and coupling > COUPLED else BRANCH_POINT
    return Special(kind, point, located.before, located.after, located.uncertainty, [v.copy() for v in vectors], coupling)


def coupling_of(follower: Follower, x: PETSc.Vec, null_vector: PETSc.Vec) -> float:
    """Cosine between a null vector and ``F_lam``, the derivative of the equations in the load at ``x``."""
    system = follower.system
    system.residual(x, system.new_vector())
    derivative = system.jacobian(follower.axis) * follower.axis
    system.set_load(derivative, 0.0)
    size = derivative.norm() * null_vector.norm()
    return abs(derivative.dot(null_vector)) / size if size else 0.0


def find_special(follower: Follower, a: Point, b: Point) -> list[Special]:
    """All folds and branch points between two consecutive points of a branch, in order of arclength.

    Where the load turns back there is a fold, or a branch point at which this branch ends on another one.  Crossings of the index that a
    fold does not explain are branch points, or further folds.
    """
    found: list[Special] = []
    low, high = sorted((a.negative, b.negative))
    crossing = list(range(low, high))
    if a.slope * b.slope < 0:
        found.append(_special(follower, a, b, low, "slope"))
        if found[0].kind == FOLD and crossing:
            del crossing[: found[0].multiplicity]
    while crossing:
        special = _special(follower, a, b, crossing[0], "mu")
        found.append(special)
        del crossing[: special.multiplicity]
    return sorted(found, key=lambda s: s.point.arclength)


def _special(follower: Follower, a: Point, b: Point, order: int, zero_of: str) -> Special:
    located = locate(follower, a, b, order, zero_of)
    margin = 0.01 * (b.arclength - a.arclength)
    if not a.arclength - margin <= located.s <= b.arclength + margin:
        raise ConvergenceError(
            f"A special point between loads {a.load:.8g} and {b.load:.8g} slipped out of its bracket: use smaller steps."
        )
    special = special_at(follower, located, located.s)
    special.zero_of = zero_of
    return special


def directions(follower: Follower, special: Special) -> list[PETSc.Vec]:
    """Unit directions in which branches may leave a branch point, one for each circle of equivalent ones.

    In the plane of the null vectors and the branch's own tangent, what is orthogonal to the tangent; of the null vectors that a
    continuous symmetry carries into each other one is kept.
    """
    system, tangent = follower.system, special.point.tangent
    known = [] if tangent is None else [tangent.copy()]
    system.set_phase(special.point.x)
    broken = system.active_drifts()
    out: list[PETSc.Vec] = []
    candidates = list(special.null_vectors)
    if abs(special.point.slope) < 1e-3 * abs(system.scene.span[1] - system.scene.span[0]):
        candidates.append(_load_response(follower, special))
    for candidate in candidates:
        d = candidate.copy()
        for _ in range(2):
            for k in known:
                d.axpy(-(system.metric * k).dot(d), k)
        size = system.norm(d)
        if size < 0.1 * max(system.norm(candidate), 1e-300):
            continue
        d.scale(1.0 / size)
        out.append(d)
        known.append(d)
        if broken == 0:
            for i in range(len(system.drifts)):
                image = system.generator(_sum(special.point.x, d), i)
                if system.norm(image) > 1e-6:
                    image.scale(1.0 / system.norm(image))
                    known.append(image)
    return out


def _sum(x: PETSc.Vec, d: PETSc.Vec) -> PETSc.Vec:
    total = x.copy()
    total.axpy(1.0, d)
    return total


def _load_response(follower: Follower, special: Special) -> PETSc.Vec:
    """Change of state with the load on the complement of the null vectors: the other branch where a side branch ends."""
    system = follower.system
    out = system.new_vector()
    x = special.point.x
    system.set_phase(x)
    system.residual(x, out)
    system.factor(follower.axis)
    system.solve(follower.axis, out)
    for v in special.null_vectors:
        out.axpy(-(system.metric * v).dot(out), v)
    return out


def leave(follower: Follower, special: Special, direction: PETSc.Vec, first: float) -> Point | None:
    """First point of the branch that leaves ``special`` along ``direction``, about ``first`` away; None if there is none.

    The amplitude is halved until the point lies where the direction says, within half of its distance.
    """
    system, amplitude = follower.system, first
    origin = special.point.x
    row = follower.row(direction)
    while amplitude > 1e-4:
        x = origin.copy()
        x.axpy(amplitude, direction)
        system.set_phase(x)
        outcome = correct(system, x, row, reach=0.5 * amplitude)
        if outcome.converged:
            change = origin.copy()
            change.aypx(-1.0, x)
            return follower.point(x, system.norm(change), follower.tangent(row, at=x), outcome)
        amplitude /= 2
    return None


def start_branch(special: Special, direction: PETSc.Vec, name: str, parent: tuple[str, int], depth: int, follower: Follower) -> Branch | None:
    """Branch that leaves ``special`` along ``direction``: its first two points, the special point itself first."""
    first = leave(follower, special, direction, 0.05)
    if first is None:
        return None
    p = special.point
    origin = Point(p.x, direction, 0.0, p.load, p.ordinate, p.energy, p.stretch, p.negative, p.zero, follower.system.scalar(direction), p.drift, p.error)
    return Branch(name, parent, depth, [origin, first])

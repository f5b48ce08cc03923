"""Chebyshev interpolants of a test function, of the load and of the state on a piece of a branch, and their zeros."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc

from rodfem.linalg.orthogonal import combine
from rodfem.stability.inertia import Factored
from rodfem.tolerances import round_off

NODES, FEWER = 6, 4
"""Number of nodes of an interpolant, and of one over a very short piece, unless it is even."""
SHARP = 1e-11
"""Uncertainty of a load on the given mesh below which the interpolation is not refined further."""
STEADILY = 4.0
"""Safety factor on the decay of the coefficients of an even series: it is told by one ratio, and changes."""
DECAY, NOISY = 100.0, 5.0
"""Ratio of a coefficient to the last but one after it above which a series decays; safety factor where it does not."""
REAL = 1e-6
"""Imaginary part below which a zero of an interpolant, in half lengths of its interval, is real."""


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


class Node(NamedTuple):
    """A node of an interpolant: parameter ``s``, state ``x``, and ``weight`` of it in the interpolated state."""

    s: float
    x: PETSc.Vec
    weight: float


@dataclass
class Located:
    """A zero found on a piece of a branch: parameter, state, direction, load, slope of the load, uncertainty, index.

    The ``uncertainty`` is of the load, ``along`` is that of the parameter, and ``arithmetic`` the part of the first
    that no sharper interpolation lowers.  At the parameter ``s`` the state is ``x``, the direction ``tangent``, and
    ``slope`` the load's derivative along it, ``rate`` that of the eigenvalue; the index is ``before`` and ``after`` it.
    The state is the sum of those at the ``nodes`` times their weights.
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
    nodes: list[Node]


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
    left = zero_uncertainty(f, root, in_doubt(f) if test_function == "mu" else None)
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
        [Node(p.s, p.x, float(w)) for p, w in zip(samples, weights, strict=True)],
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


def zero_uncertainty(series: np.ndarray, root: float, doubt: float | None = None) -> float:
    """How far a ``doubt`` about values of a Chebyshev series, by default its last coefficient, can move its root."""
    slope = float(chebyshev.chebval(root, chebyshev.chebder(series)))
    return float((abs(series[-1]) if doubt is None else doubt) / abs(slope)) if slope else float("inf")


def in_doubt(series: np.ndarray) -> float:
    """Size of what a Chebyshev series leaves open of values that are measured: its last coefficient, or their noise.

    Coefficients that do not decay are those of noise, of which the last one is small as often as not: an eigenvalue
    near zero along a whole branch moves by much of itself with what Newton's method leaves of a state.
    """
    before, between, last = abs(series[-3:])
    return float(last if DECAY * last < before else NOISY * max(before, between, last))


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

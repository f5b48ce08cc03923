"""Zeros of Chebyshev series on [-1, 1], and what is uncertain about them."""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.polynomial import chebyshev

SHARP = 1e-11
"""Uncertainty of a load on the given mesh below which the interpolation is not refined further."""
DECAY, NOISY = 100.0, 5.0
"""Ratio of a coefficient to the last but one after it above which a series decays; safety factor where it does not."""
REAL = 1e-6
"""Imaginary part below which a zero of an interpolant, in half lengths of its interval, is real."""


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

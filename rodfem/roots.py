"""Zero of a function between two arguments at which its signs differ, and its lowest value between two others.

Zeros are bracketed, by inverse quadratic interpolation: T. R. Chandrupatla, Adv. Engrg. Software 28 (1997) 145-149.
Lowest values are found by parabolas and golden sections: R. P. Brent, Algorithms for minimization without derivatives
(1973), chapter 5.  ``scipy.optimize`` has the like, and takes a tenth of a second to load.
"""

from __future__ import annotations

from collections.abc import Callable
from math import copysign
from sys import float_info

ROUND_OFF = 4 * float_info.epsilon
"""Relative distance of neighbours that are told apart."""
GOLDEN = 0.5 * (3.0 - 5.0**0.5)
"""Part of the larger side of a bracket that a golden section takes."""
TRIES = 100
"""Sections until a lowest value is taken as it is."""


def zero_between(f: Callable[[float], float], a: float, b: float, within: float) -> float:
    """Zero of ``f`` between ``a`` and ``b``, ``within`` that of the exact one; raises ValueError for equal signs."""
    fa, fb = f(a), f(b)
    if fa * fb > 0:
        raise ValueError(f"The function has one sign, {copysign(1.0, fa):+g}, at both {a:g} and {b:g}.")
    part = 0.5
    while True:
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        # the smallest step, in parts of the bracket: across the zero, to the other side of the best point
        smallest = 0.5 * (within + ROUND_OFF * abs(best)) / abs(b - a) if b != a else 1.0
        if least == 0.0 or smallest >= 0.5:
            return best
        x = a + min(max(part, smallest), 1 - smallest) * (b - a)
        fx = f(x)
        if (fx > 0) == (fa > 0):
            (c, fc), (a, fa) = (a, fa), (x, fx)
        else:
            (c, fc), (b, fb), (a, fa) = (b, fb), (a, fa), (x, fx)
        part, xi, phi = 0.5, (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1 - phi) ** 2 < 1 - xi:  # the quadratic has one value there
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)


def lowest_between(f: Callable[[float], float], a: float, x: float, b: float, within: float) -> tuple[float, float]:
    """Argument between ``a`` and ``b`` at which ``f`` is lowest, ``within`` that of the exact one, and its value.

    The first at which it is negative serves, too: beside it are zeros.  The search begins at ``x``.
    """
    fx = f(x)
    (v, fv), (w, fw) = (x, fx), (x, fx)
    step = before = 0.0
    for _ in range(TRIES):
        middle, least = 0.5 * (a + b), within + ROUND_OFF * abs(x)
        if fx < 0.0 or abs(x - middle) + 0.5 * (b - a) <= 2 * least:
            break
        # the vertex of the parabola through the three lowest values, where it is inside and steps become smaller
        r, q = (x - w) * (fx - fv), (x - v) * (fx - fw)
        p, q = (x - v) * q - (x - w) * r, 2 * (q - r)
        p, q = (-p if q > 0 else p), abs(q)
        if abs(p) < abs(0.5 * q * before) and q * (a - x) < p < q * (b - x):
            before, step = step, p / q
            if min(x + step - a, b - x - step) < 2 * least:
                step = copysign(least, middle - x)
        else:
            before = (b if x < middle else a) - x
            step = GOLDEN * before
        u = x + (step if abs(step) >= least else copysign(least, step))
        fu = f(u)
        if fu <= fx:
            a, b = (x, b) if u >= x else (a, x)
            (v, fv), (w, fw), (x, fx) = (w, fw), (x, fx), (u, fu)
        else:
            a, b = (u, b) if u < x else (a, u)
            if fu <= fw or w == x:
                (v, fv), (w, fw) = (w, fw), (u, fu)
            elif fu <= fv or v in (x, w):
                v, fv = u, fu
    return x, fx

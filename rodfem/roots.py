"""Zero of a function between two arguments at which its signs differ.

It is bracketed, by inverse quadratic interpolation: T. R. Chandrupatla, Adv. Engrg. Software 28 (1997) 145-149.
``scipy.optimize`` has the like, and takes a tenth of a second to load.
"""

from __future__ import annotations

from collections.abc import Callable
from math import copysign
from sys import float_info

ROUND_OFF = 4 * float_info.epsilon  # relative distance of neighbours


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

"""A taut rod between clamps turned out of its line: boundary layers of width ``sqrt(EI/T)``, in closed form.

The rod of length 1 and bending stiffness 1 is pulled by a dead force ``T = 10^lam`` along e3; both ends are clamped at
the angle ``ANGLE`` to e3.  Near an end the angle obeys ``tan(theta/4) = tan(ANGLE/4) exp(-s sqrt(T))`` (the separatrix
of a pendulum), and shortens the rod by ``2 (1 - cos(ANGLE/2)) / sqrt(T)``; the other end is felt as ``exp(-sqrt(T))``.
"""

from math import cos, pi, sin

from classics import column

from rodfem import Ordinate, Scene, clamped, sliding

ANGLE = pi / 3


def scene(span: tuple[float, float] = (3.0, 6.0)) -> Scene:
    """The rod with the exponent of its tension as the load."""
    turned = (cos(ANGLE / 2), 0.0, sin(ANGLE / 2), 0.0)
    ends = clamped(rotation=turned), sliding(lambda c: (None, None, None), turned, lambda c: (0.0, 0.0, 10.0**c.lam))
    constants, ordinate = {"lam": span[0], "B2": 1.0}, Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2])
    return column("taut", ends, span, load="lam", constants=constants, ordinate=ordinate)


def shortening(lam: float) -> float:
    """Exact ordinate, up to ``exp(-sqrt(T))``."""
    return 4 * (1 - cos(ANGLE / 2)) * 10 ** (-lam / 2)

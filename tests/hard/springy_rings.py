"""Pressed rings on springs that repeat n times around: multiple branch points by the symmetry of a regular n-gon.

The circle of radius and bending stiffness one is held by springs ``k0 + k1 cos(n s)`` to where its points were.  It
does not stretch: displacements inward ``w`` and along the ring ``u`` have ``u' = w``, and the second variation under
the pressure P is

    int (w'' + w)^2 - P (w'^2 - w^2) + (k0 + k1 cos(n s)) (w^2 + u^2) ds.

The recorded loads are those of a symmetric matrix of 81 Fourier coefficients, which converge exponentially.  By the
group of the n-gon a mode of m waves is double, unless 2 m is a multiple of n.
"""

from typing import Any

import classics
import ufl
from classics import column
from hard.case import Measured, compare, reference, run, said, singular

from rodfem import Discretization, Ring
from rodfem.forms import loads

MOST = 14.0
"""Greatest pressure."""
MEAN, COINCIDENT, MODULATION = 18.0, 17.987962206622775, 6.0
"""Stiffness at which two waves and three buckle at one pressure if it does not vary, and for n = 7; its amplitude."""


def ring(n: int) -> Measured:
    """All critical pressures below 14 with their multiplicities; n = 0: springs that do not vary."""

    def potential(x: Any, c: Any) -> Any:
        away = x.r - ufl.as_vector((1 - ufl.cos(c.s), 0.0, ufl.sin(c.s)))
        springs = (c.k + c.k1 * ufl.cos(c.n * c.s)) / 2 * ufl.dot(away, away)
        return loads.pressure(x.r, x.dr, c.P) + springs

    springs = {"k": COINCIDENT if n == 7 else MEAN, "k1": MODULATION if n else 0.0, "n": float(n)}
    scene = column(
        "springy ring", Ring(), (8.0, MOST), start=classics.circle, planar="e2", potential=potential,
        constants={"P": 8.0, "B2": 1.0} | springs, **classics.ROUND,
    )  # fmt: skip
    diagram = run(scene, Discretization("pointwise", 10, 6))
    return compare(singular(diagram[0]), reference("springs", n), said(diagram))

"""The writhing of a clamped rod: its ends come nearer to each other, and one is turned against the other.

A rod of length one has bending stiffness one and twisting stiffness C.  Its ends are clamped on one axis; the second
is nearer by D, and turned about the axis by phi (van der Heijden, Neukirch, Goss & Thompson 2003, Int. J. Mech. Sci.
45; here without contact).  The planar elastica is lost out of its plane at some D.  Nearer to that the load phi
turns back, and turns again: the loop that is thrown at one phi opens at a smaller one.  The rod turned by 4 pi has the
states of the one that is not turned, so that with phi also 4 pi - phi is a fold.

A heavy and naturally curved rod between the same clamps is that of Lazarus, Miller, Metlitz & Reis 2013 (Soft Matter 9)
and Lazarus, Miller & Reis 2013 (J. Mech. Phys. Solids 61): round, of a rubber that keeps its volume, C/B = 2/3, without
stretch or shear.  Its natural curvature k0, about d2, is that by the length, and its weight w along e1 is that per
length by length^3 over bending stiffness.  In the plane k0 changes nothing but the moment.  That a weight delays what a
natural curvature does, which they found, is here, too: with k0 = 1 the sagging arch leaves its plane at D = 0.33 with a
weight of 20, and at 0.48 with one of 60.  The numbers D, k0, w are not theirs: nothing is compared with what they
measured.

The recorded loads are by shooting in space with exact derivatives; indices are numbers of conjugate points, places s in
(0, 1) at which ``d(r, theta)(s)/d(m, n)(0)`` is singular, ``theta`` the vector of small rotation (Manning, Rogers &
Maddocks 1998, Proc. R. Soc. A 454; Hoffman 2004).
"""

from math import pi, sqrt
from typing import Any

import numpy as np
import ufl
from classics import column
from hard.case import Measured, check, reference

from rodfem import Discretization, Ordinate, Scene, clamped
from rodfem.forms.energy import bending_and_twist

FIRST, LAST, NEAREST = 0.1, 0.9, 0.7
"""Range of D of the planar elastica, and the end of that of the heavy rod."""
MOST = 4 * pi
"""Largest angle phi."""
ROUND = 2 / 3
"""Twisting stiffness over bending stiffness of a round rod whose Poisson ratio is 1/2."""


def clamped_rod(C: float, load: str, D: float, span: tuple[float, float], **more: Any) -> Scene:
    """The rod without weight, with what else is given."""
    constants = {"phi": 0.0, "D": D, "B2": 1.0, "C": C} | more.pop("constants", {})

    def turned(c: Any) -> tuple[Any, ...]:
        return (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2))

    def start(s: np.ndarray) -> np.ndarray:
        half = sqrt(D) * np.sin(2 * pi * s)
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    return column(
        "writhing", (clamped(), clamped(lambda c: (0.0, 0.0, 1 - c.D), turned)), span, load=load, start=start,
        constants=constants, ordinate=Ordinate("deflection", s=0.5, of=lambda r, q: np.hypot(r[0], r[1])), **more,
    )  # fmt: skip


def heavy_rod(k0: float, w: float, load: str, D: float, span: tuple[float, float]) -> Scene:
    """The heavy and curved one."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return bending_and_twist((k[0], k[1] - c.k0, k[2]), (c.B1, c.B2, c.C))

    return clamped_rod(
        ROUND, load, D, span, constants={"k0": k0, "w": w}, energy=energy, distributed=lambda c: (c.w, 0.0, 0.0)
    )


def changes(scene: Scene, elements: int, series: str, *values: float) -> Measured:
    """All folds and losses of stability of the first branch, with the index on either side."""
    return check(reference(series, *values), scene, Discretization("auto", elements, 6))


def turned(D: float, C: float) -> Measured:
    """The end is turned by 4 pi: both folds, or none where D is small."""
    return changes(clamped_rod(C, "phi", D, (0.0, MOST)), 10, "turned", D, C)


def shortened(C: float) -> Measured:
    """The ends of the planar elastica come nearer, until it is lost, and further."""
    return changes(clamped_rod(C, "D", FIRST, (FIRST, LAST)), 10, "shortened", C)


def heavy_turned(D: float, k0: float, w: float) -> Measured:
    """The end of the heavy rod is turned by up to 4 pi."""
    return changes(heavy_rod(k0, w, "phi", D, (0.0, MOST)), 12, "heavy, turned", D, k0, w)


def heavy_shortened(k0: float, w: float) -> Measured:
    """The ends of the sagging arch come nearer."""
    return changes(heavy_rod(k0, w, "D", FIRST, (FIRST, NEAREST)), 12, "heavy, shortened", k0, w)

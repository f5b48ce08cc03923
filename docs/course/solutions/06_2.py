"""Spins obey theta'' - i M theta' - T theta = const: with M as unknown, the determinant of a 3 x 3 system vanishes."""

import numpy as np
import ufl
from scipy.optimize import brentq

import rodfem
from rodfem import Ordinate, Plan, Scene, clamped, sliding
from rodfem.forms.energy import bending_and_twist

shaft = Scene(
    name="pulled shaft",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, 1.0)),
    parameters={"phi": 0.0, "T": 10.0},
    load="phi",
    ends=(
        clamped(),
        sliding(
            lambda c: (0.0, 0.0, None),
            lambda c: (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2)),
            force=lambda c: (0.0, 0.0, c.T),
        ),
    ),
    ordinate=Ordinate("end shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 13.0),
)
answer = rodfem.trace(shaft, plan=Plan(depth=0)).special("branch point")[0].point.load


def condition(M: float) -> float:
    """sin(q - p) = (q - p) sin p sin q / (p q) with p, q = M/4 -+ W/2, W^2 = M^2/4 - T: the spin has mean zero."""
    W = np.sqrt(M * M / 4 - 10)
    p, q = (M / 2 - W) / 2, (M / 2 + W) / 2
    return float(np.sin(q - p) - (q - p) * np.sin(p) * np.sin(q) / (p * q))


exact = brentq(condition, 9.0, 12.0)
assert abs(answer - exact) < 1e-8, (answer, exact)

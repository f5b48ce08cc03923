"""Where the stiffness jumps the strain does: inside an element no polynomial follows it, and the order is lost."""

from math import sqrt

import numpy as np
import ufl
from scipy.optimize import brentq

import rodfem
from rodfem import Discretization, Ordinate, Plan, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist


def stepped(breaks: tuple[float, ...]) -> rodfem.SpecialPoint:
    """Buckling of the column, with or without an element boundary at the step."""
    column = Scene(
        name="stepped",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: ufl.conditional(ufl.lt(c.s, 0.3), 2.0, 1.0) * bending_and_twist(k, (1.0, 1.0, 1.0)),
        parameters={"P": 2.0},
        load="P",
        ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
        ordinate=Ordinate("displacement of the tip", s=1.0, of=lambda r, q: r[0]),
        span=(2.0, 5.0),
        breaks=breaks,
        planar="e2",
    )
    return rodfem.trace(column, Discretization(elements=8, degree=6), Plan(depth=0)).special("branch point")[0]


blurred, sharp = stepped(()), stepped((0.3,))
exact = brentq(lambda P: np.tan(0.3 * sqrt(P / 2)) * np.tan(0.7 * sqrt(P)) - sqrt(2), 2.0, 4.0, xtol=1e-14)
assert abs(sharp.point.load - exact) < 1e-9 and abs(blurred.point.load - exact) > 1e-5
answer = sharp.point.load

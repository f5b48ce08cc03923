"""The taper is a constant of the scene; its best value is where the derivative of the load in it vanishes."""

from scipy.optimize import brentq

import rodfem
from rodfem import Ordinate, Plan, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, (1 + c.t * (1 - 2 * c.s)) ** 2, 1.0)),
    parameters={"P": 0.5, "t": 0.0},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: r[0]),
    span=(0.5, 6.0),
    planar="e2",
)


def buckling(t):
    return rodfem.trace(column.varying(t=t), plan=Plan(depth=0, error_bars=False)).special("branch point")[0]


best = brentq(lambda t: buckling(t).derivative("t").value, 0.1, 0.8, xtol=1e-8)
answer = buckling(best).point.load

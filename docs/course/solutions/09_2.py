"""Divergence, at w^2 with cos w = -0.3/0.7: below one half the part that follows cannot make the column flutter."""

from math import acos, hypot

import rodfem
from rodfem import Inertia, Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="partly following",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 10.0, 1.0)),
    parameters={"P": 0.0, "a": 0.3},
    load="P",
    ends=(
        clamped(),
        free(force=lambda c: (0.0, 0.0, -(1 - c.a) * c.P), follower=lambda c: (0.0, 0.0, -c.a * c.P)),
    ),
    inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
    ordinate=Ordinate("displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
    span=(0.0, 10.0),
)
(loss,) = rodfem.trace(column).special()
assert loss.kind == "divergence"
answer = loss.point.load
assert abs(answer - acos(-3 / 7) ** 2) < 1e-8

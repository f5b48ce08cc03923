"""The middle of a pinned column is held."""

import rodfem
from rodfem import Ordinate, Plan, Scene, at, pinned
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="pinned and held in the middle",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": 0.0},
    load="P",
    ends=(pinned(), pinned(lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P))),
    constraints=(at(0.5, lambda x, c: x.r[0]),),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 60.0),
    planar="e2",
)
answer = rodfem.trace(column, plan=Plan(depth=0)).special("branch point")[0].point.load

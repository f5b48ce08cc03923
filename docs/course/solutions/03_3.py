"""The distance of the clamps is the load; its multiplier is the thrust."""

import rodfem
from rodfem import Ordinate, Plan, Scene, clamped
from rodfem.forms.energy import bending_and_twist

rod = Scene(
    name="machine",
    interval=(0.0, 1.0),
    rod="unshearable",
    energy=lambda v, k, c: 500.0 * (v[2] - 1) ** 2 + bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"d": 1.0},
    load="d",
    ends=(clamped(), clamped(lambda c: (0.0, 0.0, c.d))),
    ordinate=Ordinate("displacement of the middle", s=0.5, of=lambda r, q: abs(r[0])),
    span=(1.0, 0.93),
    planar="e2",
)
answer = rodfem.trace(rod, plan=Plan(depth=0)).special("branch point")[0].point.load

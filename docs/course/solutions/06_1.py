"""The moment is the same, 8.9868, and the angle M/C: half of it."""

import ufl

import rodfem
from rodfem import Ordinate, Plan, Scene, clamped, sliding
from rodfem.forms.energy import bending_and_twist

shaft = Scene(
    name="stiff shaft",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 1.0, c.C)),
    parameters={"phi": 0.0, "C": 2.0},
    load="phi",
    ends=(
        clamped(),
        sliding(lambda c: (0.0, 0.0, None), lambda c: (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2))),
    ),
    ordinate=Ordinate("end shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 6.0),
)
answer = rodfem.trace(shaft, plan=Plan(depth=0)).special("branch point")[0].point.load

"""Leipholz (1962): the thrust at s is p (1 - s), and follows the rod."""

from math import hypot

import rodfem
from rodfem import Inertia, Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="Leipholz's column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, 10.0, 1.0)),
    parameters={"p": 0.0},
    load="p",
    ends=(clamped(), free()),
    follower=lambda c: (0.0, 0.0, -c.p),
    inertia=Inertia(rho_A=lambda c: 1.0, rho_I=lambda c: (0.0, 0.0, 0.0)),
    ordinate=Ordinate("displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
    span=(0.0, 50.0),
)
answer = rodfem.trace(column).special("flutter")[0].point.load

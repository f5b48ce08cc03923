"""A moment M at the tip has the potential -M theta(1), natural is theta'(1) = M: the rod is an arc of a circle."""

import numpy as np

from rodfem import End, Ordinate, Scene, Solver, clamped
from rodfem.forms.energy import bending_and_twist

rod = Scene(
    name="moment",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"M": 0.0},
    load="M",
    ends=(clamped(), End(moment=lambda c: (0.0, c.M, 0.0))),
    ordinate=Ordinate("tip, across", s=1.0, of=lambda r, q: r[0]),
    span=(0.0, 2.0),
    planar="e2",
)
answer = Solver(rod).equilibrium(np.pi / 2).ordinate

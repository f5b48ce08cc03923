"""Weights: the force keeps its direction, p = n^2.  The index is 1 below: turned about its centre the ring sinks."""

import numpy as np
import ufl

import rodfem
from rodfem import Discretization, Ordinate, Plan, Ring, Scene
from rodfem.forms.energy import bending_and_twist

ring = Scene(
    name="ring under weights",
    interval=(0.0, 2 * np.pi),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (1.0, 1.0, 1.0)),
    parameters={"p": 0.5},
    load="p",
    ends=Ring(),
    distributed=lambda c: (c.p * ufl.cos(c.s), 0.0, -c.p * ufl.sin(c.s)),
    ordinate=Ordinate("width", s=np.pi, of=lambda r, q: r[0]),
    span=(0.5, 4.5),
    planar="e2",
    start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
)
diagram = rodfem.trace(ring, Discretization(elements=16, degree=6), Plan(depth=0))
(oval,) = diagram.special("branch point")
assert oval.negative_before == 1
answer = oval.point.load

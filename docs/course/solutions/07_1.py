"""A fluid: its force on the ring stays normal, with the potential p/2 n . (r x r').  Lévy 1884: p = n^2 - 1, n = 2."""

import numpy as np

import rodfem
from rodfem import Discretization, Ordinate, Plan, Ring, Scene
from rodfem.forms import loads
from rodfem.forms.energy import bending_and_twist

ring = Scene(
    name="ring under a fluid",
    interval=(0.0, 2 * np.pi),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (1.0, 1.0, 1.0)),
    parameters={"p": 0.5},
    load="p",
    ends=Ring(),
    potential=lambda x, c: loads.pressure(x.r, x.dr, c.p),
    ordinate=Ordinate("width", s=np.pi, of=lambda r, q: r[0]),
    span=(0.5, 4.5),
    planar="e2",
    start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
)
diagram = rodfem.trace(ring, Discretization(elements=16, degree=6), Plan(depth=0))
answer = diagram.special("branch point")[0].point.load

"""Strings to the centre: p times the distance from it, p = (n^2 - 1)^2/(n^2 - 2) with n = 2 (Boresi 1955)."""

import numpy as np
import ufl

import rodfem
from rodfem import Discretization, Ordinate, Plan, Ring, Scene
from rodfem.forms.energy import bending_and_twist

ring = Scene(
    name="ring on strings",
    interval=(0.0, 2 * np.pi),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (1.0, 1.0, 1.0)),
    parameters={"p": 0.5},
    load="p",
    ends=Ring(),
    potential=lambda x, c: c.p * ufl.sqrt((x.r[0] - 1) ** 2 + x.r[2] ** 2),
    ordinate=Ordinate("width", s=np.pi, of=lambda r, q: r[0]),
    span=(0.5, 5.0),
    planar="e2",
    start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
)
diagram = rodfem.trace(ring, Discretization(elements=16, degree=6), Plan(depth=0))
answer = diagram.special("branch point")[0].point.load

"""The curve that one has to enter from above, bent against the imperfection."""

import numpy as np

import rodfem
from rodfem import Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist


def bent(s):
    half = -0.85 * np.sin(np.pi * s / 2)
    return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)


column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": 1.0, "eps": 0.05},
    load="P",
    ends=(clamped(), free(force=lambda c: (c.eps, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: r[0]),
    span=(4.0, 1.0),
    planar="e2",
    start=bent,
)
(snap,) = rodfem.trace(column).special("fold")
answer = snap.point.load

"""A machine that moves the crown of the deep arch: the displacement itself has a fold."""

import numpy as np

import rodfem
from rodfem import Discretization, Ordinate, Plan, Scene, at, clamped, pinned
from rodfem.forms.energy import bending_and_twist

HALF = np.radians(107.5)
FOOT, DEPTH = np.sin(HALF), 1 - np.cos(HALF)
TURNED = (np.cos(HALF / 2), 0.0, -np.sin(HALF / 2), 0.0)
machine = Scene(
    name="machine",
    interval=(-HALF, HALF),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - 1, k[2]), (50.0, 1.0, 50.0)),
    parameters={"w": 0.0},
    load="w",
    ends=(clamped(lambda c: (DEPTH, 0.0, -FOOT), TURNED), pinned(lambda c: (DEPTH, 0.0, FOOT))),
    constraints=(at(0.0, lambda x, c: x.r[0] - c.w),),
    ordinate=Ordinate("drift of the crown", s=0.0, of=lambda r, q: r[2]),
    span=(0.0, 1.5),
    planar="e2",
    start=lambda s: np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1),
)
diagram = rodfem.trace(machine, Discretization(elements=8, degree=8), Plan(depth=0))
answer = diagram.special("fold")[0].point.load

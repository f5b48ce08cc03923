"""The bend of Bathe & Bolourchi (1979): an arc in the plane of e1 and e3, loaded along e2."""

import numpy as np

from rodfem import Ordinate, Scene, Solver, clamped, free
from rodfem.forms.energy import bending_and_twist

E, GA, radius = 1e7, 5e6, 100.0
EI = E / 12
length = radius * np.pi / 4
bend = Scene(
    name="45 degree bend",
    interval=(0.0, length),
    rod="flexible",
    energy=lambda v, k, c: (
        0.5 * GA * (v[0] ** 2 + v[1] ** 2)
        + 0.5 * E * (v[2] - 1) ** 2
        + bending_and_twist((k[0], k[1] - 1 / radius, k[2]), (EI, EI, EI))
    ),
    parameters={"P": 0.0},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, c.P, 0.0))),
    ordinate=Ordinate("displacement of the tip along the force", s=length, of=lambda r, q: r[1]),
    span=(0.0, 600.0),
    start=lambda s: np.stack([np.cos(s / radius / 2), 0 * s, np.sin(s / radius / 2), 0 * s], axis=1),
)
solver = Solver(bend)
point = solver.equilibrium(0.0)
for load in np.linspace(0.0, 600.0, 9):  # in steps, each from the state before
    point = solver.equilibrium(float(load), point)
answer = point.ordinate

"""A critical load by counts alone."""

from rodfem import Ordinate, Scene, Solver, pinned
from rodfem.forms.energy import bending_and_twist

rod = Scene(
    name="pinned",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": 0.0},
    load="P",
    ends=(pinned(), pinned(lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 20.0),
    planar="e2",
)
solver = Solver(rod)
low, high = 5.0, 15.0
while high - low > 1e-8:
    middle = (low + high) / 2
    low, high = (middle, high) if solver.equilibrium(middle).index == 0 else (low, middle)
answer = (low + high) / 2

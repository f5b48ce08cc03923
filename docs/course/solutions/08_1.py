"""Euler's column between clamps of length 6 has the thrust 4 pi^2/36 = 10 lam (1 - lam)."""

from math import inf, pi

import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, clamped
from rodfem.forms.energy import hemitropic

rod = Scene(
    name="hemitropic",
    interval=(-3.0, 3.0),
    rod="unshearable",
    energy=lambda v, k, c: hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=1.0, bending=1.0),
    parameters={"lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0)), "A": Parameter(0.0)},
    load="lam",
    ends=(clamped(lambda c: (0.0, 0.0, -3 * (1 - c.lam))), clamped(lambda c: (0.0, 0.0, 3 * (1 - c.lam)))),
    ordinate=Ordinate("displacement of the middle", s=0.0, of=lambda r, q: r[0]),
    span=(0.0, 0.25),
)
(buckling,) = rodfem.trace(rod, plan=Plan(depth=0)).special("branch point")
answer = buckling.point.load
assert abs(10 * answer * (1 - answer) - 4 * pi**2 / 36) < 1e-9

"""Here tan(w/2) = w/2, as for Greenhill's shaft: both are a mode with mean zero, of w'' = const, between clamps."""

from math import pi

import rodfem
from rodfem import Ordinate, Parameter, Plan, Scene, clamped, sliding
from rodfem.forms.energy import bending_and_twist

cord = Scene(
    name="cord",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k0, k[2]), (1.0, 1.0, 1.0)),
    parameters={"lam": Parameter(60.0, r"\lambda"), "k0": Parameter(3 * pi)},
    load="lam",
    ends=(clamped(), sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, c.lam))),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(60.0, 1.0),
)
first, second = rodfem.trace(cord, plan=Plan(depth=0)).special("branch point")
answer = second.point.load
assert abs(9 * pi**2 - answer - 8.986818915818128**2) < 1e-7

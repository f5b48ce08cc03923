"""The density of the derivative, by the first pieces at the foot: their means, extrapolated to the foot itself."""

import numpy as np

import rodfem
from rodfem import Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

column = Scene(
    name="column",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (1.0, c.A**2, 1.0)),
    parameters={"P": 0.5, "A": 1.0},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("tip displacement", s=1.0, of=lambda r, q: r[0]),
    span=(0.5, 4.0),
    planar="e2",
)
found = rodfem.trace(column, depth=0).special("branch point")[0].derivative("A", along_the_rod=True)
integral = np.append(0.0, np.cumsum(found.density * np.diff(found.ends)))[:7]
answer = np.polynomial.Polynomial.fit(found.ends[:7], integral, 6).deriv()(0.0)

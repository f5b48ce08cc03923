"""In space each plane of bending counts for itself."""

from rodfem import Ordinate, Scene, Solver, clamped, free
from rodfem.forms.energy import bending_and_twist

rod = Scene(
    name="column in space",
    interval=(0.0, 1.0),
    rod="unshearable and inextensible",
    energy=lambda v, k, c: bending_and_twist(k, (2.0, 1.0, 1.0)),
    parameters={"P": 0.0},
    load="P",
    ends=(clamped(), free(force=lambda c: (0.0, 0.0, -c.P))),
    ordinate=Ordinate("shortening", s=1.0, of=lambda r, q: 1 - r[2]),
    span=(0.0, 100.0),
)
answer = Solver(rod).equilibrium(100.0).index

r"""Lateral load on a ruler.

A ruler bends easily about one axis and hardly about the other.  It is clamped at s = 0 and pushed sideways at its
free end by a dead force lam along e1 (or e2).  It is unshearable, and hard to stretch:

    n3 = 20 log v3,   m1 = k1,   m2 = 10 k2,   m3 = k3.

A force along e1 bends the ruler in the plane of e1 and e3, the way it resists.  It stays in that plane only up to
a load at which it twists and falls to the side: lateral buckling, with the bending and stretching before it taken
into account.  A force along e2 bends it the easy way, and nothing else happens.

The contact force is the dead force everywhere along the ruler: no force is unknown, and the centreline follows from the
rotation.  What is left are the rotation q, its multiplier eta and the stretch v3.

Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.3 and figures 8 and 9.
"""

import rodfem.app.main as program
from forms.energy import bending_and_twist, logarithmic_stretch
from rodfem.errors import InputError
from rodfem.problem.ends import clamped, free
from rodfem.problem.scene import Ordinate, Parameter, Scene

DIRECTIONS = {"e1": (1.0, 0.0), "e2": (0.0, 1.0)}


def ruler(
    direction: str = "e1",
    stretching: float = 20.0,
    bending: tuple[float, float] = (1.0, 10.0),
    twisting: float = 1.0,
) -> Scene:
    """State the problem: the rod's energy, how its ends are held, and the number to look at.

    Parameters
    ----------
    direction
        Direction of the force, e1 or e2.
    stretching
        Stiffness E.
    bending
        Stiffnesses B1 and B2.
    twisting
        Stiffness B3.
    """
    if direction not in DIRECTIONS:
        raise InputError(f"Unknown direction {direction!r}: choose e1 or e2.")
    x, y = DIRECTIONS[direction]

    def energy(v, k, c):
        return logarithmic_stretch(v, c.E) + bending_and_twist(k, (c.B1, c.B2, c.B3))

    return Scene(
        name="ruler",
        title="Lateral load on a ruler",
        states="plane",
        interval=(0.0, 1.0),
        rod="unshearable",
        energy=energy,
        parameters={
            "lam": Parameter(0.0, r"\lambda", words="lateral force"),
            "E": Parameter(stretching, admissible=(0.0, float("inf"))),
            "B1": Parameter(bending[0]),
            "B2": Parameter(bending[1]),
            "B3": Parameter(twisting),
        },
        load="lam",
        ends=(clamped(), free(force=lambda c: (x * c.lam, y * c.lam, 0.0))),
        ordinate=Ordinate("tip displacement out of the plane", s=1.0, of=lambda r, q: abs(y * r[0] - x * r[1])),
        span=(0.0, 12.0),
    )


if __name__ == "__main__":
    program.main(ruler)

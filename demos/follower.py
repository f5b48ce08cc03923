r"""A rod under a follower load.

A rod is clamped at one end, and pushed at the other by a force P that stays tangent to it, like a rocket.  It is
unshearable and inextensible, with m = (k1, 10 k2, k3).  The straight rod is an equilibrium at every P, and the
only one near it at any: nothing ever buckles.  Still it does not stay straight.  The load has no potential, its
tangent matrix is not symmetric, and two frequencies

    omega^2 = mu,    S x = mu M x,

approach each other as P grows, meet, and become a complex pair: oscillations that grow.  This is flutter, at P =
20.0509 without rotary inertia (Beck 1952).  Stability is a matter of motion here, so the mass of the rod counts,
and with it the centreline.

Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.4 and figure 11.
"""

from math import hypot, inf

import rodfem
import rodfem.app.main as program
from forms.energy import bending_and_twist
from rodfem.errors import InputError
from rodfem.problem.ends import clamped, free
from rodfem.problem.scene import Inertia, Ordinate, Parameter, Scene


def pushed_rod(
    stiffness: tuple[float, float, float] = (1.0, 10.0, 1.0),
    mass: float = 1.0,
    rotary_inertia: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Scene:
    """State the problem: the rod's energy, its ends, its inertia, and the number to look at.

    Parameters
    ----------
    stiffness
        B1, B2 and B3.
    mass
        Mass per unit length.
    rotary_inertia
        J1, J2 and J3.
    """
    b1, b2, b3 = stiffness
    j1, j2, j3 = rotary_inertia
    if min(j1, j2, j3) < 0:
        raise InputError(f"A rotary inertia of {min(j1, j2, j3):g} is negative: give zero or more.")

    def energy(v, k, c):
        return bending_and_twist(k, (c.B1, c.B2, c.B3))

    return Scene(
        name="follower",
        title="Rod under a follower load",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=energy,
        parameters={
            "P": Parameter(0.0, "P", words="follower force"),
            "B1": Parameter(b1),
            "B2": Parameter(b2),
            "B3": Parameter(b3),
            "m": Parameter(mass, admissible=(0.0, inf)),
            "J1": Parameter(j1),
            "J2": Parameter(j2),
            "J3": Parameter(j3),
        },
        load="P",
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))),
        inertia=Inertia(rho_A=lambda c: c.m, rho_I=lambda c: (c.J1, c.J2, c.J3)),
        ordinate=Ordinate("transverse displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, 25.0),
    )


def mesh(**_: object) -> rodfem.Discretization:
    """Four elements are enough for a straight rod."""
    return rodfem.Discretization(elements=4)


if __name__ == "__main__":
    program.main(pushed_rod, mesh)

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

from argparse import Namespace
from math import hypot, inf

import rodfem.app.cli as cli
from forms.energy import bending_and_twist
from rodfem.errors import InputError
from rodfem.problem.ends import clamped, free
from rodfem.problem.scene import Inertia, Ordinate, Parameter, Scene


def scene(options: Namespace) -> Scene:
    """State the problem: what the rod is made of, how its ends are held, how it moves, and what to look at."""
    b1, b2, b3 = options.stiffness
    j1, j2, j3 = options.rotary_inertia
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
            "P": Parameter(0.0, "P"),
            "B1": Parameter(b1),
            "B2": Parameter(b2),
            "B3": Parameter(b3),
            "m": Parameter(options.mass, admissible=(0.0, inf)),
            "J1": Parameter(j1),
            "J2": Parameter(j2),
            "J3": Parameter(j3),
        },
        load="P",
        ends=(clamped(), free(follower=lambda c: (0.0, 0.0, -c.P))),
        inertia=Inertia(rho_A=lambda c: c.m, rho_I=lambda c: (c.J1, c.J2, c.J3)),
        ordinate=Ordinate("transverse displacement of the tip", s=1.0, of=lambda r, q: hypot(r[0], r[1])),
        span=tuple(options.span),
    )


if __name__ == "__main__":
    parser = cli.parser_for("follower", __doc__, load="P", span=(0.0, 25.0), elements=4, degree=6)
    constants = parser.add_argument_group("constants of the rod")
    constants.add_argument(
        "--stiffness", type=float, nargs=3, default=(1.0, 10.0, 1.0), metavar="B", help="B1 B2 B3 (default 1 10 1)"
    )
    constants.add_argument("--mass", type=float, default=1.0, metavar="M", help="per unit length (default 1)")
    constants.add_argument(
        "--rotary-inertia", type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar="J", help="J1 J2 J3 (default 0 0 0)"
    )
    cli.main(parser, scene)

r"""Compression of a hemitropic rod.

A hemitropic rod twists when it is stretched, as a rope or a strand of DNA does.  Its stored energy couples
stretch and twist::

    W = 5 (v3 - 1)^2 + A (v3 - 1) k3 + B/2 k3^2 + C/2 (k1^2 + k2^2)

(an unshearable rod: v1 = v2 = 0).  Both ends are clamped, and pushed towards each other to r = -+ (1 - lam) l e3,
l half the length. The straight rod is an equilibrium at every lam.  Linear theory has it buckle where, with a = A
lam/(2C), Om^2 = a^2 + 10 lam (1 - lam)/C, p = l (a - Om) and q = l (a + Om),

    sin(q - p) = (q - p) sin p sin q / (p q).

Nothing in the problem prefers a direction across the rod.  Hence every buckled state is one of a circle of
states, its second variation has one zero eigenvalue, and at the straight state eigenvalues cross zero in pairs.

Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.2 and figures 5 and 6.
"""

from argparse import Namespace
from math import hypot, inf

import rodfem.app.cli as cli
from forms.energy import hemitropic
from rodfem.problem.ends import clamped
from rodfem.problem.scene import Ordinate, Parameter, Scene


def scene(options: Namespace) -> Scene:
    """State the problem: what the rod is made of, how its ends are held, and what to look at."""

    def energy(v, k, c):
        return hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=c.B, bending=c.C)

    return Scene(
        name="hemitropic",
        title="Compressed hemitropic rod",
        interval=(-options.half_length, options.half_length),
        rod="unshearable",
        energy=energy,
        parameters={
            "lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0)),
            "A": Parameter(options.coupling),
            "B": Parameter(options.twisting),
            "C": Parameter(options.bending),
            "l": Parameter(options.half_length),
        },
        load="lam",
        ends=(
            clamped(lambda c: (0.0, 0.0, -c.l * (1 - c.lam))),
            clamped(lambda c: (0.0, 0.0, +c.l * (1 - c.lam))),
        ),
        ordinate=Ordinate("transverse displacement of the mid point", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
        span=tuple(options.span),
    )


if __name__ == "__main__":
    parser = cli.parser_for("hemitropic", __doc__, load="lam", span=(0.0, 0.95), elements=8, degree=6)
    constants = parser.add_argument_group("constants of the rod")
    constants.add_argument(
        "--coupling", type=float, default=-3.0, metavar="A", help="of stretch and twist (default -3)"
    )
    constants.add_argument("--twisting", type=float, default=1.0, metavar="B", help="stiffness (default 1)")
    constants.add_argument("--bending", type=float, default=1.0, metavar="C", help="stiffness (default 1)")
    constants.add_argument(
        "--half-length", type=float, default=3.0, metavar="L", help="half the rod's length (default 3)"
    )
    cli.main(parser, scene)

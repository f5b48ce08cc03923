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

from math import hypot, inf

import rodfem.app.main as program
from forms.energy import hemitropic
from rodfem.problem.ends import clamped
from rodfem.problem.scene import Ordinate, Parameter, Scene


def hemitropic_rod(
    coupling: float = -3.0, twisting: float = 1.0, bending: float = 1.0, half_length: float = 3.0
) -> Scene:
    """State the problem: the rod's energy, how its ends are held, and the number to look at.

    Parameters
    ----------
    coupling
        A, of stretch and twist.
    twisting
        Stiffness B.
    bending
        Stiffness C.
    half_length
        l, half the rod's length.
    """

    def energy(v, k, c):
        return hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=c.B, bending=c.C)

    return Scene(
        name="hemitropic",
        title="Compressed hemitropic rod",
        interval=(-half_length, half_length),
        rod="unshearable",
        energy=energy,
        parameters={
            "lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0), words="end shortening"),
            "A": Parameter(coupling),
            "B": Parameter(twisting),
            "C": Parameter(bending),
            "l": Parameter(half_length),
        },
        load="lam",
        ends=(
            clamped(lambda c: (0.0, 0.0, -c.l * (1 - c.lam))),
            clamped(lambda c: (0.0, 0.0, +c.l * (1 - c.lam))),
        ),
        ordinate=Ordinate("transverse displacement of the mid point", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, 0.95),
    )


if __name__ == "__main__":
    program.main(hemitropic_rod)

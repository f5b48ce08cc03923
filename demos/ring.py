r"""Michell's ring.

A thin rod is bent to a circle, and its ends are joined.  It has round cross-sections, W = 1/2 [k1^2 + k2^2 + C (k3 -
t0)^2], and its natural twist is t0.  Its link was fixed when it was closed, so that the circle has
no twist, and is under a torque C t0.  With radius 1 it buckles out of its plane where

    C t0 = sqrt(n^2 - 1),    n = 2, 3, ...

(Michell 1889; Zajac, J. Appl. Mech. 29 (1962) 136): at C t0 = sqrt(3) first, like a kinked cable.  What leaves there
leads, past a figure of eight, to a circle with another link, in which the rod has passed through itself.  The twist,
int k3 ds / 2 pi, tells all of these apart: 0 on the first circle, 2 on the last one, and in between the link less the
writhe, as long as the rod does not pass through itself.

A ring may go anywhere: rotations, the turning of its cross-sections and the motion along itself are zero eigenvalues at
every state.  They are found from the equations, and counted apart.
"""

from math import inf, pi

import numpy as np

import rodfem.app.main as program
from forms.energy import bending_and_twist
from rodfem.problem.ends import Ring
from rodfem.problem.scene import Ordinate, Parameter, Scene

TWIST = r"twist $\int k_3\,ds/2\pi$"


def circle(s):
    """Quaternions of the circle of radius 1 in the plane of e1 and e3: a turn by s about e2, no twist."""
    return np.stack([np.cos(s / 2), 0 * s, np.sin(s / 2), 0 * s], axis=1)


def ring(twisting: float = 1.5) -> Scene:
    """State the problem: the rod's energy, that it is closed, and the number to look at.

    Parameters
    ----------
    twisting
        Stiffness C of twist over that of bending.
    """
    return Scene(
        name="ring",
        title="Michell's ring",
        interval=(0.0, 2 * pi),
        rod="unshearable and inextensible",
        energy=lambda v, k, c: bending_and_twist((k[0], k[1], k[2] - c.t0), (1.0, 1.0, c.C)),
        parameters={
            "t0": Parameter(0.0, "t_0", words="natural twist"),
            "C": Parameter(twisting, admissible=(0.0, inf)),
        },
        load="t0",
        ends=Ring(),
        start=circle,
        states="circle",
        ordinate=Ordinate("twist in turns", s=None, of=lambda x, c: x.k[2] / (2 * pi), label=TWIST),
        span=(0.0, 1.6),
    )


if __name__ == "__main__":
    program.main(ring)

r"""Perversion of a telephone cord.

A telephone cord is a rod whose natural state is coiled: its intrinsic curvature is k0 = 2 pi N about d2, N turns
over its length. Pulled straight, and let go, it does not coil back: clamped at both ends it can only form coils
of both hands, with a perversion between them.  The rod is unshearable and inextensible, with

    W = 1/2 [k1^2 + (k2 - k0)^2 + k3^2],     r(0) = 0,   R(0) = R(1) = I,   r1(1) = r2(1) = 0,

and is pulled along e3 at s = 1 by a dead tension lam.  The straight rod is an equilibrium at every tension, with
the constant moment m2 = -k0; it loses stability where lam = k0^2 - w^2 with w = 2 pi n or tan(w/2) = w/2.

No force acts along the rod, so the contact force is constant; n3 = lam is known, n1 and n2 are two scalar unknowns.

Kumar & Healey, Comput. Methods Appl. Mech. Engrg. 199 (2010) 1805-1815, section 5.1 and figures 2 and 3.
"""

from math import ceil, isfinite, pi

import rodfem
import rodfem.app.main as program
from forms.energy import bending_and_twist
from rodfem.problem.ends import clamped, sliding
from rodfem.problem.scene import Ordinate, Parameter, Scene

MOST = 1e6
"""Turns beyond which mesh and tension stay as they are: no mesh holds them."""


def cord(turns: float = 1.5) -> Scene:
    """State the problem: the rod's energy, how its ends are held, and the number to look at.

    Parameters
    ----------
    turns
        k0 = 2 pi N; more elements and tension for more.
    """

    def energy(v, k, c):
        return bending_and_twist((k[0], k[1] - c.k0, k[2]), (1.0, 1.0, 1.0))

    return Scene(
        name="cord",
        title="Telephone cord",
        interval=(0.0, 1.0),
        rod="unshearable and inextensible",
        energy=energy,
        parameters={
            "lam": Parameter(60.0, r"\lambda", words="tension"),
            "k0": Parameter(2 * pi * turns),
        },
        load="lam",
        ends=(
            clamped(),
            sliding(lambda c: (0.0, 0.0, None), force=lambda c: (0.0, 0.0, c.lam)),
        ),
        ordinate=Ordinate("shortening 1 - r3(1)", s=1.0, of=lambda r, q: 1 - r[2], label="shortening $1 - r_3(1)$"),
        span=(max(60.0, 10.0 * ceil(0.11 * (2 * pi) ** 2 * (within(turns) ** 2 - 1))), 0.0),  # stable at first
    )


def mesh(turns: float = 1.5) -> rodfem.Discretization:
    """Six elements a turn, of higher degree where many turns make tight loops."""
    elements = min(max(ceil(6 * within(turns)), 6), 600)
    return rodfem.Discretization(elements=elements, degree=8 if within(turns) > 2 else 6)


def within(turns: float) -> float:
    """Number of turns, within what a mesh holds."""
    return min(abs(turns), MOST) if isfinite(turns) else 0.0


if __name__ == "__main__":
    program.main(cord, mesh)

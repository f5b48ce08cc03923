"""A heavy and naturally curved rod between clamps writhes: one end is turned, or comes nearer to the other.

Of Lazarus, Miller, Metlitz & Reis 2013 (Soft Matter 9) and Lazarus, Miller & Reis 2013 (J. Mech. Phys. Solids 61) this
has the problem: a round rod of a rubber that keeps its volume, C/B = 2/3, without stretch or shear, of a natural
curvature k0, in gravity, is clamped at two places of one horizontal axis, nearer to each other by D than the rod is
long.  The second clamp is turned about the axis by phi, far, or is moved.  That a weight delays what a natural
curvature does, which they found, is here, too: with k0 = 1 the sagging arch leaves its plane at D = 0.33 with a weight
of 20, and at 0.48 with one of 60.  The numbers D, k0, w are not theirs, and the rod may pass through itself: nothing is
compared with what they measured.

Length and bending stiffness are one: k0 is the natural curvature, about d2, by the length, and w the weight per length
by length^3 over bending stiffness, along e1.  In the plane k0 changes nothing but the moment, so that the first state
is that of a straight heavy rod.  Unlike the weightless rod of :mod:`hard.writhing` this one is free to turn about no
axis: moments and forces at the first clamp are six unknowns.
"""

from typing import Any

import numpy as np
from hard import writhing
from hard.case import Change, Measured, compare, run, said, singular
from hard.shooting_space import FINE, Branch, Misfit, R, Rod, about_e3, times

from rodfem import Discretization, Scene
from rodfem.forms.energy import bending_and_twist

C = 2 / 3
"""Twisting stiffness over bending stiffness of a round rod whose Poisson ratio is 1/2."""
SCALE = (10.0, 10.0, 10.0, 50.0, 50.0, 50.0)
"""Sizes of moments and forces."""
ADDED = 4.0
"""Weight that is added at once where the first state is looked for."""
NEAREST = 0.7
"""End of the range of D."""


def misfit_of(rod: Rod, load: str, D: float) -> Misfit:
    """Position and rotation of the last end, (6,), by moment, force and load at the first."""

    def misfit(u: np.ndarray, pieces: int) -> np.ndarray:
        phi, near = (u[6], D) if load == "phi" else (0 * u[6], u[6])
        end = rod.states(u[:3], u[3:6], pieces)[-1]
        x, y, z = end[R]
        return np.array([x, y, z - (1 - near), *times(end[:4], about_e3(-phi))[1:]])

    return misfit


def reference(k0: float, w: float, load: str, D: float, span: tuple[float, float]) -> list[Change]:
    """Changes of the index along the branch that begins with the sagging planar state at D, by load."""
    scale = (*SCALE, 1.0 if load == "phi" else 0.1)
    m2, _, *n = writhing.planar(D)
    u = np.array([0.0, m2 - k0, 0.0, *n, span[0]])
    for weight in np.linspace(0.0, w, 2 + int(w / ADDED)):
        rod = Rod(C, k0, (weight, 0.0, 0.0))
        u, _ = Branch(misfit_of(rod, load, D), np.array(scale), [], []).correct(u, np.eye(7)[-1])

    def index(u: np.ndarray) -> int:
        return rod.index(u[:3], u[3:6], pieces=FINE, to_the_end=True)

    return Branch.follow(misfit_of(rod, load, D), u, scale, span).changes(index)


def heavy_rod(k0: float, w: float, load: str, D: float, span: tuple[float, float]) -> Scene:
    """The rod as rodfem has it."""

    def energy(v: Any, k: Any, c: Any) -> Any:
        return bending_and_twist((k[0], k[1] - c.k0, k[2]), (c.B1, c.B2, c.C))

    return writhing.clamped_rod(
        C, load, D, span, constants={"k0": k0, "w": w}, energy=energy, distributed=lambda c: (c.w, 0.0, 0.0)
    )


def turned(D: float, k0: float, w: float) -> Measured:
    """The end is turned by up to 4 pi: all folds, with the index on either side."""
    span = (0.0, writhing.MOST)
    diagram = run(heavy_rod(k0, w, "phi", D, span), Discretization("auto", 12, 6))
    return compare(singular(diagram[0]), reference(k0, w, "phi", D, span), said(diagram))


def shortened(k0: float, w: float) -> Measured:
    """The ends of the sagging arch come nearer: all losses of stability, with the index on either side."""
    span = (writhing.FIRST, NEAREST)
    diagram = run(heavy_rod(k0, w, "D", span[0], span), Discretization("auto", 12, 6))
    return compare(singular(diagram[0]), reference(k0, w, "D", span[0], span), said(diagram))

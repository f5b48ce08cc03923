"""The writhing of a clamped rod: its ends come nearer to each other, and one is turned against the other.

A rod of length one has bending stiffness one and twisting stiffness C.  Its ends are clamped on one axis; the second
is nearer by D, and turned about the axis by phi (van der Heijden, Neukirch, Goss & Thompson 2003, Int. J. Mech. Sci.
45; here without contact).  The planar elastica is lost out of its plane at some D.  Nearer to that the load phi
turns back, and turns again: the loop that is thrown at one phi opens at a smaller one.  The rod turned by 4 pi has the
states of the one that is not turned, so that with phi also 4 pi - phi is a fold.

Turning the rod in space, and its sections back, changes nothing: the reference begins with a moment across e1, and does
not ask for the rotation of the end about its moment, which follows from the others.
"""

from math import pi, sqrt
from typing import Any

import numpy as np
import ufl
from classics import column
from hard import shooting_plane, snapping
from hard.case import Change, Measured, compare, run, said, singular
from hard.shooting_space import Branch, M, R, Rod, about_e3, times

from rodfem import Discretization, Ordinate, Scene, clamped

SCALE = (10.0, 10.0, 50.0, 50.0, 50.0)
"""Sizes of moments and forces."""
FIRST, LAST = 0.1, 0.9
"""Range of D of the planar elastica."""
MOST = 4 * pi
"""Largest angle phi."""


def planar(D: float) -> np.ndarray:
    """Moment about e2 and e3, and force, (5,), of the elastica that is not turned."""
    u = np.array([4 * pi * sqrt(FIRST), 0.0, -4 * pi * pi, 0.0])
    for near in np.linspace(FIRST, D, 6):
        u = shooting_plane.solve(snapping.between_clamps(1 - near, 0.0), u[:-1], 0.0)
    return np.array([u[0], 0.0, u[1], 0.0, u[2]])


def reference(C: float, load: str, D: float, span: tuple[float, float], back: float | None = None) -> list[Change]:
    """Changes of the index along the branch that begins with the planar elastica at D, by load."""
    rod = Rod(C)

    def misfit(u: np.ndarray, pieces: int) -> np.ndarray:
        phi, near = (u[5], D) if load == "phi" else (0 * u[5], u[5])
        end = rod.states(np.array([0 * u[0], u[0], u[1]]), u[2:5], pieces)[-1]
        (x, y, z), away = end[R], times(end[:4], about_e3(-phi))[1:]
        return np.array([x, y, z - (1 - near), (away[:2] * end[M][:2]).sum(0), away[2]])

    def index(u: np.ndarray) -> int:
        return rod.index((0.0, u[0], u[1]), u[2:5])

    size = 1.0 if load == "phi" else 0.1
    return Branch.follow(misfit, [*planar(D), span[0]], (*SCALE, size), span, back).changes(index)


def clamped_rod(C: float, load: str, D: float, span: tuple[float, float], **more: Any) -> Scene:
    """The rod as rodfem has it, with what else is given."""
    constants = {"phi": 0.0, "D": D, "B2": 1.0, "C": C} | more.pop("constants", {})

    def turned(c: Any) -> tuple[Any, ...]:
        return (ufl.cos(c.phi / 2), 0.0, 0.0, ufl.sin(c.phi / 2))

    def start(s: np.ndarray) -> np.ndarray:
        half = sqrt(D) * np.sin(2 * pi * s)
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    return column(
        "writhing", (clamped(), clamped(lambda c: (0.0, 0.0, 1 - c.D), turned)), span, load=load, start=start,
        constants=constants, ordinate=Ordinate("deflection", s=0.5, of=lambda r, q: np.hypot(r[0], r[1])), **more,
    )  # fmt: skip


def turned(D: float, C: float) -> Measured:
    """The end is turned by 4 pi: both folds, or none where D is small, with the index on either side."""
    span = (0.0, MOST)
    half = reference(C, "phi", D, span, back=2 * pi)
    expected = half + [Change(MOST - c.load, c.after, c.before) for c in reversed(half)]
    diagram = run(clamped_rod(C, "phi", D, span), Discretization("auto", 10, 6))
    return compare(singular(diagram[0]), expected, said(diagram))


def shortened(C: float) -> Measured:
    """The ends of the planar elastica come nearer, until it is lost, and further."""
    span = (FIRST, LAST)
    diagram = run(clamped_rod(C, "D", FIRST, span), Discretization("auto", 10, 6))
    return compare(singular(diagram[0]), reference(C, "D", FIRST, span), said(diagram))

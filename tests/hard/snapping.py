"""Rods that snap in a plane as their clamps are turned by ``t``; length and stiffness are one.

The ends of a strip are D apart; the last clamp is turned by t, the first one by ``ratio t``.  The arch that bends to
one side is followed from t = 0 until it loses its stability (Cazzolli & Dal Corso 2019, Int. J. Solids Struct. 162).
For the ratios -1 and 1 the clamps have a symmetry, and a pitchfork takes the place of the fold.  The recorded loads
are by shooting with exact derivatives, and the indices by conjugate points.

A cantilever of natural curvature k0 carries a dead load P at its tip, against the direction of the clamp at t = 0.  By
the angle b of the tip, where no moment acts, the angle t of the clamp is explicit, by one integration: its extremes are
the two folds of a hysteresis (Dhanakoti 2024, arXiv 2407.07601).
"""

from math import inf, sqrt
from typing import Any

import numpy as np
import ufl
from classics import BEAM, column
from hard.case import Change, Measured, check, compare, reference, run, said, singular

from rodfem import Discretization, Ordinate, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

MESH = Discretization("auto", 8, 6)
CURVED = 0.5
"""Natural curvature of the cantilever."""
RANGE = 2.0
"""Largest angle of its clamp."""


def strip(distance: float, ratio: float) -> Scene:
    """The arch between its clamps, the load t."""
    bow = sqrt(1 - distance)

    def turned(part: float) -> Any:
        return lambda c: (ufl.cos(part * c.t / 2), 0.0, ufl.sin(part * c.t / 2), 0.0)

    def start(s: np.ndarray) -> np.ndarray:
        half = bow * np.sin(2 * np.pi * s)
        return np.stack([np.cos(half), 0 * s, np.sin(half), 0 * s], axis=1)

    return column(
        "strip", (clamped(rotation=turned(ratio)), clamped(lambda c: (0.0, 0.0, c.D), turned(1.0))),
        (0.0, 4 * bow), load="t", planar="e2", constants={"t": 0.0, "D": distance, "B2": 1.0}, start=start,
        ordinate=Ordinate("rise", s=0.5, of=lambda r, q: r[0]),
    )  # fmt: skip


def snapping(distance: float, ratio: float) -> Measured:
    """The first loss of stability, and the index on either side."""
    diagram = run(strip(distance, ratio), MESH)
    return compare(singular(diagram[0])[:1], reference("strip", distance, ratio), said(diagram))


def opposite(distance: float) -> Measured:
    """Ratio -1: the symmetric arch is lost at a pitchfork shortly before its fold."""
    return check(reference("strip", distance, -1.0), strip(distance, -1.0), MESH)


def alike(distance: float) -> Measured:
    """Ratio 1: the arch ends, stable, in an S that is stable from there on, and is not before."""
    (lost,) = reference("strip", distance, 1.0)
    diagram = run(strip(distance, 1.0), MESH, depth=1)
    sides = {
        (p.load > lost.load, p.negative)
        for b in diagram.branches[1:]
        for p in b.points
        if abs(p.load - lost.load) > 1e-6
    }
    if len(diagram.branches) != 3 or sides != {(True, lost.before), (False, lost.after)}:
        return Measured(inf, 1.0, said(diagram), f"{diagram.branches} where {lost} was expected")
    return compare(singular(diagram[0]), [Change(lost.load, 0, 0)], said(diagram))


def turning(load: float, share: float) -> Scene:
    """The cantilever whose clamp turns, and whose load follows its tip by a ``share``."""
    follower = {"follower": lambda c: (0.0, 0.0, -share * c.P)} if share else {}
    return column(
        "hysteresis", (clamped(rotation=lambda c: (ufl.cos(c.t / 2), 0.0, ufl.sin(c.t / 2), 0.0)),
                       free(lambda c: (0.0, 0.0, (share - 1) * c.P), **follower)),
        (-RANGE, RANGE), load="t", planar="e2", constants={"t": -RANGE, "P": load, "B2": 1.0, "k": CURVED},
        energy=lambda v, k, c: bending_and_twist((k[0], k[1] - c.k, k[2]), (c.B1, c.B2, c.C)),
        ordinate=Ordinate("tip", s=1.0, of=lambda r, q: r[0]), inertia=BEAM,
    )  # fmt: skip


def hysteresis(load: float) -> Measured:
    """Both folds, and the index on either side of each."""
    return check(reference("hysteresis", load), turning(load, 0.0), MESH)

"""Columns on which something varies along themselves: layers, peaks, long tails and ripple, at random.

Small deflections of a column follow linear equations ``y' = A(s) y``.  The recorded loads carry them over short pieces
by Magnus' expansion of fourth order (Iserles & Norsett 1999), graded about the place where the column varies.
"""

from math import pi
from typing import Any

import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Measured, compare, reference, run, said, singular

from rodfem import Discretization

MESHES = ((8, 6), (10, 5), (14, 4), (20, 3))
LEAST, MOST = -0.9, -0.5
"""Decimal exponents of the width of a layer or a peak."""
KINDS = {
    "layer": lambda s, c: ufl.erf((s - c.p) / c.w),
    "peak": lambda s, c: ufl.exp(-(((s - c.p) / c.w) ** 2)),
    "tails": lambda s, c: 1 / (1 + ((s - c.p) / c.w) ** 2),
    "ripple": lambda s, c: ufl.sin(2 * pi * (s - c.p) / c.w),
}
"""How something varies: about the place p on the scale w."""


class Drawn:
    """Numbers of one column: amplitude a, place p and scale w, and its one critical load of a ``series``."""

    def __init__(self, series: str, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.kind = list(KINDS)[seed % len(KINDS)]
        self.mesh = MESHES[int(random.integers(len(MESHES)))]
        a, p = float(10 ** random.uniform(-3, -0.2)), float(random.uniform(0.05, 0.95))
        w = float(10 ** random.uniform(LEAST, MOST))
        if self.kind == "ripple":  # in step with the elements, or nearly so
            w = 1 / (self.mesh[0] * float(random.choice([0.2, 0.25, 0.3, 0.5])))
        self.bed = float(10 ** random.uniform(1, 3))
        self.constants = {"a": a, "p": p, "w": w, "B2": 9.0}
        (self.change,) = reference(series, seed)

    def along(self, c: Any, s: Any) -> Any:
        """What varies, about one."""
        return 1 + c.a * KINDS[self.kind](s, c)

    def measured(self, supports: str, until: float, formulation: str, **given: Any) -> Measured:
        """Diagram of a column from rest up to a load."""
        scene = column(f"uneven {self.kind}", SUPPORTS[supports], (0.0, until), constants=self.constants, **given)
        diagram = run(scene, Discretization(formulation, *self.mesh))
        return compare(singular(diagram[0]), [self.change], said(diagram))


def stiffness(seed: int) -> Measured:
    """A cantilever: ``theta' = M/B(s), M' = -P theta``."""
    drawn = Drawn("uneven stiffness", seed)

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * (drawn.along(c, c.s) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2)

    return drawn.measured("clamped-free", 5.0, "reduced", energy=energy)


def weight(seed: int) -> Measured:
    """A cantilever under a thrust P and as much weight: ``theta' = M, M' = -P (1 + int_s^1 q) theta``."""
    drawn = Drawn("uneven weight", seed)
    weight = lambda c: (0, 0, -c.P * drawn.along(c, c.s))  # noqa: E731
    return drawn.measured("clamped-free", 1.5 * drawn.change.load, "pointwise", distributed=weight)


def bed(seed: int) -> Measured:
    """A pinned column on a foundation: ``w' = theta, theta' = M, M' = -P theta - V, V' = k(s) w``."""
    drawn = Drawn("uneven bed", seed)
    spring = lambda x, c: 0.5 * drawn.bed * drawn.along(c, x.s) * (x.r[0] ** 2 + x.r[1] ** 2)  # noqa: E731
    return drawn.measured("pinned-pinned", 1.02 * drawn.change.load, "pointwise", potential=spring)

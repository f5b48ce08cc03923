"""Hard by their numbers: stiff against bending, meshes of any size and degree, rotations of many turns, uneven rods.

Uneven columns vary along themselves, by layers, peaks, long tails and ripple, at random.  Small deflections follow
linear equations ``y' = A(s) y``.  The recorded loads carry them over short pieces by Magnus' expansion of fourth order
(Iserles & Norsett 1999), graded about the place where the column varies.
"""

from math import inf, pi, sqrt
from typing import Any

import classics
import numpy as np
import ufl
from classics import SUPPORTS, column
from closed_forms import TORQUE
from hard.case import Change, Measured, check, compare, reference, run, said, singular
from stability.test_soft_modes import nearly_free

from rodfem import Discretization, Solver

EULER = pi**2 / 4
"""Buckling load of a cantilever of length and bending stiffness one."""


def haringx(exponent: float, formulation: str = "reduced") -> Measured:
    """``P (1 - P/EA + P/GA) = pi^2/4``, EA = 2 GA."""
    GA = 10.0**exponent
    slope = 0.5 / GA  # 1/GA - 1/EA
    load = 2 * EULER / (1 + sqrt(1 + 4 * slope * EULER))
    scene = classics.shearable("flexible", GA, 2 * GA)
    return check([Change(load, 0, 1)], scene, Discretization(formulation, 8, 6))


def ratio(B2: float) -> Measured:
    """Rods of bending ratio B2 about the load of the stiff plane: (2n - 1)^2 weak modes are below."""
    low, high = 0.9991 * EULER * B2, 1.0009 * EULER * B2
    weak = [(2 * n - 1) ** 2 * EULER for n in range(1, 200)]
    loads = sorted([*weak, *(B2 * x for x in weak)])
    index = sum(x < low for x in loads)
    inside = [x for x in loads if low < x < high]
    expected = [Change(x, index + i, index + i + 1) for i, x in enumerate(inside)]
    scene = column("ratio", SUPPORTS["clamped-free"], (low, high), constants={"B2": B2})
    return check(expected, scene, Discretization("reduced", 24, 6))


def euler(mesh: Discretization) -> Measured:
    return check([Change(EULER, 0, 1)], column("mesh", SUPPORTS["clamped-free"], (0.0, 4.0)), mesh)


def graded(smallest: float) -> Measured:
    """Elements that shrink by equal factors towards the clamp, down to ``smallest``."""
    vertices = (0.0, *np.geomspace(smallest, 1.0, 12))
    return euler(Discretization("reduced", 12, 6, vertices))


def turned(C: float) -> Measured:
    """Twisted between clamps until the moment C phi is Greenhill's: by 2 pi and more where C is small."""
    scene = classics.greenhill()
    scene = scene.varying("phi", (0.0, 1.03 * TORQUE / C), C=C)
    return check([Change(TORQUE / C, 0, 2)], scene)


def soft(spring: float) -> Measured:
    """A spring at a ball joint, about three axes: of each rotation it is the eigenvalue, and its sign the stability."""
    point = Solver(nearly_free(spring), Discretization("reduced", 4, 4)).equilibrium(0.0)
    undecided = tuple(str(mode) for mode in point.soft if not mode.decided)
    index = 0 if undecided or spring > 0 else 3
    if len(point.soft) != 3 or (point.negative, point.undecided) != (index, len(undecided)):
        return Measured(inf, 1.0, undecided, repr(point))
    return Measured(max(abs(mode.value - spring) / mode.uncertainty for mode in point.soft), 1.0, undecided)


# --- uneven columns ---------------------------------------------------------------------------------------------------

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


def uneven_stiffness(seed: int) -> Measured:
    """A cantilever: ``theta' = M/B(s), M' = -P theta``."""
    drawn = Drawn("uneven stiffness", seed)

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * (drawn.along(c, c.s) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2)

    return drawn.measured("clamped-free", 5.0, "reduced", energy=energy)


def uneven_weight(seed: int) -> Measured:
    """A cantilever under a thrust P and as much weight: ``theta' = M, M' = -P (1 + int_s^1 q) theta``."""
    drawn = Drawn("uneven weight", seed)
    weight = lambda c: (0, 0, -c.P * drawn.along(c, c.s))  # noqa: E731
    return drawn.measured("clamped-free", 1.5 * drawn.change.load, "pointwise", distributed=weight)


def uneven_bed(seed: int) -> Measured:
    """A pinned column on a foundation: ``w' = theta, theta' = M, M' = -P theta - V, V' = k(s) w``."""
    drawn = Drawn("uneven bed", seed)
    spring = lambda x, c: 0.5 * drawn.bed * drawn.along(c, x.s) * (x.r[0] ** 2 + x.r[1] ** 2)  # noqa: E731
    return drawn.measured("pinned-pinned", 1.02 * drawn.change.load, "pointwise", potential=spring)

"""A cantilever whose two planes pass their critical loads several times, at random: a closed form.

The thrust over Euler's is ``1 + g1(P)`` for bending in one plane and ``1 + g2(P)`` in the other one.  Each ``g`` has
its zeros at given loads, where the index changes by one, and is smooth between them.  Loads are drawn in a cluster of
any width from 1e-3 to 1; now and then two of both planes are one, so that eigenvalues pass zero together, in the same
direction or in opposite ones, and now and then one is that of a row.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import exp, inf, sqrt
from typing import Any

import numpy as np
import ufl
from classics import column
from hard.case import Change, Measured, compare, run, said, singular
from hard.stiffness import EULER

from rodfem import Discretization, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

RANGE = (0.25, 2.3)
MESH = Discretization("auto", 6, 6)
SHALLOW = 1e-5
"""Largest value of ``g`` between two neighbouring zeros of it below which a draw is left out."""
SIDE = 1e-11
"""Distance from a zero at which the index beside it is taken."""


@dataclass(frozen=True)
class Plane:
    """Zeros of a function ``g``, the width of each, and the bound of the function."""

    zeros: tuple[float, ...]
    widths: tuple[float, ...]
    size: float

    def __call__(self, P: Any, root: Any = sqrt) -> Any:
        value = self.size
        for zero, width in zip(self.zeros, self.widths, strict=True):
            value = value * (P - zero) / root(width**2 + (P - zero) ** 2)
        return value

    @property
    def depth(self) -> float:
        """Largest size between two neighbouring zeros, the least of all; infinite with fewer than two."""
        zeros = sorted(self.zeros)
        pieces = [np.linspace(a, b, 21) for a, b in pairwise(zeros)]
        return min((max(abs(self(P)) for P in piece) for piece in pieces), default=inf)


@dataclass(frozen=True)
class Draw:
    """Two planes, and the rate ``grow`` at which thrust and stiffnesses grow with the load."""

    planes: tuple[Plane, Plane]
    grow: float

    def index(self, P: float) -> int:
        """Number of planes that have buckled."""
        return sum(plane(P) > 0 for plane in self.planes)

    def scene(self) -> Scene:
        first, second = (lambda P, plane=plane: plane(P, ufl.sqrt) for plane in self.planes)
        grows = lambda P: ufl.exp(self.grow * (P - 1.2))  # noqa: E731
        push = lambda c: (0.0, 0.0, -EULER * grows(c.P) * (1 + first(c.P)))  # noqa: E731
        return column(
            "two planes", (clamped(), free(push)), RANGE,
            energy=lambda v, k, c: grows(c.P) * bending_and_twist(k, (1.0, (1 + first(c.P)) / (1 + second(c.P)), 1.0)),
        )  # fmt: skip

    def measured(self) -> Measured:
        """Special points and indices of all rows against the closed form."""
        diagram = run(self.scene(), MESH, error_bars=False)
        places = sorted({x for plane in self.planes for x in plane.zeros})
        expected = [Change(x, self.index(x - SIDE), self.index(x + SIDE)) for x in places]
        for point in diagram[0].points:
            if not point.zero and point.negative != self.index(point.load):
                return Measured(inf, 1.0, said(diagram), f"index {point.negative} at {point.load}")
        return compare(singular(diagram[0]), expected, said(diagram))


def drawn(number: int, seed: int = 49, most: int = 4, shallow: float = SHALLOW) -> Draw:
    """Random draw of a ``number``, of two to ``most`` zeros; those not deeper than ``shallow`` are drawn again."""
    random = np.random.default_rng([seed, number])
    while True:
        middle = random.uniform(0.4, 2.15)
        zeros: tuple[list[float], list[float]] = ([], [])
        widths: tuple[list[float], list[float]] = ([], [])
        for _ in range(random.integers(2, most + 1)):
            away = 0.5 * exp(random.uniform(np.log(1e-3), 0.0)) * random.choice([-1, 1])
            inside = RANGE[0] + 0.01 < middle + away < RANGE[1] - 0.01
            plane = int(random.integers(2))
            zeros[plane].append(float(middle + away) if inside else float(random.uniform(0.3, 2.25)))
            widths[plane].append(float(10 ** random.uniform(-1, 0.5)))
        kind, grow = random.choice(["apart", "apart", "together", "row"]), random.choice([0.0, 0.0, 1.0, 3.0, -2.0])
        sizes = [random.choice([-1, 1]) * 10 ** random.uniform(-1.3, -0.15) for _ in range(2)]
        if kind == "together" and zeros[0] and zeros[1]:
            zeros[1][0] = zeros[0][0]
        if kind == "row":
            some = zeros[0] or zeros[1]
            some[0] = min(0.6641, 1.1766, 1.5866, 1.9966, key=lambda row: abs(row - some[0]))
        planes = [Plane(tuple(z), tuple(w), float(c)) for z, w, c in zip(zeros, widths, sizes, strict=True)]
        if min(plane.depth for plane in planes) > shallow:
            return Draw((planes[0], planes[1]), float(grow))


def crossings(number: int) -> Measured:
    """Random draw of a ``number``."""
    return drawn(number).measured()


def cluster(number: int) -> Measured:
    """Random draw of a ``number`` with up to five zeros, and pairs that are shallower."""
    return drawn(number, seed=16, most=5, shallow=1e-6).measured()

"""A column whose stiffness varies along itself on any scale: layers, peaks, long tails and ripple, drawn at random.

The slope of a cantilever under a thrust follows ``theta' = M/B(s), M' = -P theta``, from ``theta = 0`` at the clamp to
``M = 0`` at the free end.  Its matrix is carried over short pieces by Magnus' expansion of fourth order (Iserles &
Norsett 1999), which preserves the determinant; pieces are graded about the place where the stiffness varies.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Change, Measured, compare, run, said, singular
from scipy.optimize import brentq
from scipy.special import erf

from rodfem import Discretization

MESHES = ((8, 3), (10, 4), (14, 5), (20, 3))
LEAST, MOST = -8.0, -0.7
"""Decimal exponents of the width of a layer or a peak."""
KINDS = {
    "layer": lambda s, c, f: f.erf((s - c.p) / c.w),
    "peak": lambda s, c, f: f.exp(-(((s - c.p) / c.w) ** 2)),
    "tails": lambda s, c, f: 1 / (1 + ((s - c.p) / c.w) ** 2),
    "ripple": lambda s, c, f: f.sin(2 * pi * (s - c.p) / c.w),
}
"""How a stiffness varies: about the place p on the scale w."""


class Numbers:
    """Functions of arrays, by UFL's names."""

    exp, sin, erf = np.exp, np.sin, erf


class Drawn:
    """Numbers of one column: amplitude a, place p and scale w."""

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.kind = list(KINDS)[seed % len(KINDS)]
        self.elements, self.degree = MESHES[int(random.integers(len(MESHES)))]
        self.a, self.p = float(10 ** random.uniform(-3, -0.2)), float(random.uniform(0.05, 0.95))
        self.w = float(10 ** random.uniform(LEAST, MOST))
        if self.kind == "ripple":  # in step with the elements, or nearly so
            self.w = 1 / (self.elements * float(random.choice([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 5.0, 9.3])))

    def stiffness(self, s: np.ndarray) -> np.ndarray:
        return np.asarray(1 + self.a * KINDS[self.kind](s, self, Numbers))

    def pieces(self) -> np.ndarray:
        even = np.linspace(0.0, 1.0, int(200 / min(self.w, 0.1)) + 1 if self.kind == "ripple" else 2001)
        graded = self.p + self.w * np.sinh(np.linspace(-np.arcsinh(2 / self.w), np.arcsinh(2 / self.w), 8001))
        return np.unique(np.concatenate([even, graded[(graded > 0) & (graded < 1)]]))

    def moment(self, P: float, ends: np.ndarray) -> float:
        """Moment at the free end under the thrust P, where that at the clamp is one."""
        middle, h = (ends[1:] + ends[:-1]) / 2, np.diff(ends)
        one, two = (1 / self.stiffness(middle + sign * np.sqrt(3) / 6 * h) for sign in (-1, 1))
        turn, bend, push = -np.sqrt(3) / 12 * h**2 * P * (two - one), h * (one + two) / 2, -P * h
        angle = np.sqrt(-(turn**2 + bend * push))
        cosine, sine = np.cos(angle), np.sinc(angle / pi)
        matrices = np.array([[cosine + sine * turn, sine * bend], [sine * push, cosine - sine * turn]])
        y = np.array([0.0, 1.0])
        for matrix in np.moveaxis(matrices, 2, 0):
            y = matrix @ y
        return float(y[1])

    def load(self) -> float:
        """Lowest critical thrust."""
        ends = self.pieces()
        return float(brentq(lambda P: self.moment(P, ends), 0.5, 5.0, xtol=1e-14))


def stiffness(seed: int) -> Measured:
    drawn = Drawn(seed)

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * ((1 + c.a * KINDS[drawn.kind](c.s, c, ufl)) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2)

    scene = column(
        f"uneven {drawn.kind}", SUPPORTS["clamped-free"], (0.0, 5.0), energy=energy,
        constants={"a": drawn.a, "p": drawn.p, "w": drawn.w},
    )  # fmt: skip
    diagram = run(scene, Discretization("reduced", drawn.elements, drawn.degree))
    return compare(singular(diagram[0]), [Change(drawn.load(), 0, 1)], said(diagram))

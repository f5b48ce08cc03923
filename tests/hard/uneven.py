"""Columns on which something varies along themselves: layers, peaks, long tails and ripple, at random.

Small deflections of a column follow linear equations ``y' = A(s) y``.  They are carried over short pieces by Magnus'
expansion of fourth order (Iserles & Norsett 1999), which are graded about the place where the column varies.
"""

from collections.abc import Callable
from functools import reduce
from math import pi
from typing import Any

import numpy as np
import ufl
from classics import SUPPORTS, column
from hard.case import Change, Measured, compare, run, said, singular
from scipy.optimize import brentq
from scipy.special import erf

from rodfem import Discretization, Scene

MESHES = ((8, 6), (10, 5), (14, 4), (20, 3))
LEAST, MOST = -0.9, -0.5
"""Decimal exponents of the width of a layer or a peak."""
KINDS = {
    "layer": lambda s, c, f: f.erf((s - c.p) / c.w),
    "peak": lambda s, c, f: f.exp(-(((s - c.p) / c.w) ** 2)),
    "tails": lambda s, c, f: 1 / (1 + ((s - c.p) / c.w) ** 2),
    "ripple": lambda s, c, f: f.sin(2 * pi * (s - c.p) / c.w),
}
"""How something varies: about the place p on the scale w."""
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(8)
TERMS = 8
"""Terms of the exponential of a short piece."""
Matrices = Callable[[np.ndarray], np.ndarray]


class Numbers:
    """Functions of arrays, by UFL's names."""

    exp, sin, erf = np.exp, np.sin, erf


class Drawn:
    """Numbers of one column: amplitude a, place p and scale w."""

    def __init__(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        self.kind = list(KINDS)[seed % len(KINDS)]
        self.mesh = MESHES[int(random.integers(len(MESHES)))]
        self.a, self.p = float(10 ** random.uniform(-3, -0.2)), float(random.uniform(0.05, 0.95))
        self.w = float(10 ** random.uniform(LEAST, MOST))
        if self.kind == "ripple":  # in step with the elements, or nearly so
            self.w = 1 / (self.mesh[0] * float(random.choice([0.2, 0.25, 0.3, 0.5])))
        self.bed = float(10 ** random.uniform(1, 3))

    def __call__(self, s: np.ndarray) -> np.ndarray:
        """What varies, about one."""
        return np.asarray(1 + self.a * KINDS[self.kind](s, self, Numbers))

    def along(self, c: Any, s: Any) -> Any:
        """The same in UFL."""
        return 1 + c.a * KINDS[self.kind](s, c, ufl)

    @property
    def pieces(self) -> np.ndarray:
        even = np.linspace(0.0, 1.0, int(200 / self.w) + 1 if self.kind == "ripple" else 2001)
        graded = self.p + self.w * np.sinh(np.linspace(-np.arcsinh(2 / self.w), np.arcsinh(2 / self.w), 8001))
        return np.unique(np.concatenate([even, graded[(graded > 0) & (graded < 1)]]))

    def measured(self, supports: str, load: float, until: float, formulation: str, **given: Any) -> Measured:
        """Diagram of a column from rest up to a load, with the one critical ``load`` that it has."""
        scene: Scene = column(
            f"uneven {self.kind}", SUPPORTS[supports], (0.0, until),
            constants={"a": self.a, "p": self.p, "w": self.w, "B2": 9.0}, **given,
        )  # fmt: skip
        diagram = run(scene, Discretization(formulation, *self.mesh))
        return compare(singular(diagram[0]), [Change(load, 0, 1)], said(diagram))


def carried(A: Matrices, ends: np.ndarray) -> np.ndarray:
    """Matrix that carries y from one end to the other, by matrices ``A(s)`` at many places."""
    middle, h = (ends[1:] + ends[:-1]) / 2, np.diff(ends)
    one, two = (A(middle + sign * np.sqrt(3) / 6 * h) for sign in (-1, 1))
    h = h[:, None, None]
    generator = h / 2 * (one + two) - np.sqrt(3) / 12 * h**2 * (one @ two - two @ one)
    term = out = np.broadcast_to(np.eye(one.shape[-1]), one.shape)
    for i in range(1, TERMS + 1):
        term = term @ generator / i
        out = out + term
    return reduce(_halved, range(int(np.ceil(np.log2(len(out))))), out)[0]


def _halved(matrices: np.ndarray, _: int) -> np.ndarray:
    """Products of neighbours."""
    if len(matrices) % 2:
        matrices = np.concatenate([matrices, np.eye(matrices.shape[-1])[None]])
    return np.asarray(matrices[1::2] @ matrices[::2])


def matrices(size: int, entries: dict[tuple[int, int], Any], places: np.ndarray) -> np.ndarray:
    """Matrices with these entries, numbers or arrays, at places."""
    out = np.zeros((len(places), size, size))
    for (i, j), value in entries.items():
        out[:, i, j] = value
    return out


def stiffness(seed: int) -> Measured:
    """A cantilever: ``theta' = M/B(s), M' = -P theta``."""
    drawn = Drawn(seed)
    ends = drawn.pieces

    def moment(P: float) -> float:
        return float(carried(lambda s: matrices(2, {(0, 1): 1 / drawn(s), (1, 0): -P}, s), ends)[1, 1])

    def energy(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * (drawn.along(c, c.s) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2)

    load = float(brentq(moment, 0.5, 5.0, xtol=1e-14))
    return drawn.measured("clamped-free", load, 5.0, "reduced", energy=energy)


def weight(seed: int) -> Measured:
    """A cantilever under a thrust P and as much weight: ``theta' = M, M' = -P (1 + int_s^1 q) theta``."""
    drawn = Drawn(seed)
    ends = drawn.pieces
    start, half = ends[:-1, None], np.diff(ends)[:, None] / 2
    pieces = (drawn(start + half * (1 + POINTS)) * half) @ WEIGHTS
    above = np.append(np.cumsum(pieces[::-1])[::-1], 0.0)

    def carries(s: np.ndarray) -> np.ndarray:
        i = np.searchsorted(ends, s, side="right") - 1
        half = (ends[i + 1] - s)[:, None] / 2
        return np.asarray(1 + above[i + 1] + (drawn(s[:, None] + half * (1 + POINTS)) * half) @ WEIGHTS)

    def moment(P: float) -> float:
        return float(carried(lambda s: matrices(2, {(0, 1): 1.0, (1, 0): -P * carries(s)}, s), ends)[1, 1])

    load = float(brentq(moment, 0.3, 2.4, xtol=1e-14))
    return drawn.measured(
        "clamped-free", load, 1.5 * load, "pointwise", distributed=lambda c: (0, 0, -c.P * drawn.along(c, c.s))
    )


def bed(seed: int) -> Measured:
    """A pinned column on a foundation: ``w' = theta, theta' = M, M' = -P theta - V, V' = k(s) w``.

    Raises ValueError where the two lowest loads are too near each other to be told apart by those of an even one.
    """
    drawn = Drawn(seed)
    ends = drawn.pieces
    fixed = {(0, 1): 1.0, (1, 2): 1.0, (2, 3): -1.0}

    def determinant(P: float) -> float:
        carry = carried(lambda s: matrices(4, {**fixed, (2, 1): -P, (3, 0): drawn.bed * drawn(s)}, s), ends)
        return float(np.linalg.det(carry[np.ix_([0, 2], [1, 3])]))

    # on an even bed the lowest load is that of n half waves
    even = sorted((n * pi) ** 2 + drawn.bed / (n * pi) ** 2 for n in range(1, 9))
    low, high = 0.35 * even[0], 0.5 * (even[0] + even[1])
    load = float(brentq(determinant, low, high, xtol=1e-13))
    spring = lambda x, c: 0.5 * drawn.bed * drawn.along(c, x.s) * (x.r[0] ** 2 + x.r[1] ** 2)  # noqa: E731
    return drawn.measured("pinned-pinned", load, min(1.02 * load, high), "pointwise", potential=spring)

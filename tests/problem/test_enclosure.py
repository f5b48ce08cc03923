"""Bounds of functions of the arclength on pieces of the rod: they hold, and what is narrow is found by them."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import ufl
from test_smoothness import RULES, STEEP, equal, scene

from rodfem.problem.enclosure import refined
from rodfem.problem.intervals import Interval
from rodfem.problem.jumps import jumps
from rodfem.problem.smoothness import unresolved
from rodfem.problem.values import Symbol, Values

pytestmark = pytest.mark.alone

SEVEN = [
    lambda s: ufl.sin(5 * s) * ufl.cos(3 / (s + 0.1)) + ufl.tan(s) ** 3,
    lambda s: ufl.exp(-s) / (1 + s**2) + ufl.ln(s + 1e-3) * ufl.sqrt(s + 0.01) - s**-2.5 * 1e-3,
    lambda s: ufl.tanh(9 * s - 4) * ufl.sinh(s) + ufl.cosh(2 * s - 1) ** 2 + ufl.erf(4 * s - 2),
    lambda s: ufl.asin(0.9 * s) + ufl.acos(s - 0.5) * ufl.atan(3 * s) + ufl.atan_2(s, 1 - 2 * s),
    lambda s: ufl.max_value(s, ufl.sin(9 * s)) + ufl.min_value(s**2, 0.3) + abs(s - 0.4) ** (1 + s),
    lambda s: ufl.conditional(ufl.And(ufl.gt(s, 0.3), ufl.Not(ufl.ge(s**2, 0.5))), s, 2 - s),
    lambda s: ufl.conditional(ufl.Or(ufl.le(ufl.sin(20 * s), 0.1), ufl.eq(s, 0.5)), ufl.sign(s - 0.6), s),
]


@pytest.mark.few(2)
@pytest.mark.parametrize("f", SEVEN)
def test_pieces_are_known(f: Callable[[Any], Any]) -> None:
    """Between its places each function is the straight line, to what is looked for: as told by 64 places on each."""
    s, start = Symbol(), np.linspace(1e-3, 1.0, 41)
    values = Values(ufl.as_ufl(f(s)))
    size = float(abs(values({s: start})).max())
    ends = refined(values.expression, s, start, size)
    among = np.linspace(ends[:-1], ends[1:], 66)[1:-1].T
    left, right = values({s: ends[:-1] + 1e-12}), values({s: ends[1:] - 1e-12})
    lines = left[:, None] + (right - left)[:, None] * np.linspace(0, 1, 66)[1:-1]
    missed = abs(values({s: among.ravel()}).reshape(among.shape) - lines).mean(axis=1)
    assert len(ends) < 50_000 and (missed * np.diff(ends)).max() < 2e-12 * size


def test_intervals_hold_their_values() -> None:
    """Sums, products, quotients, powers, sines and tangents of random intervals; poles have no bounds."""
    random = np.random.default_rng(7)
    low = random.normal(size=(2, 500)) * 3
    x, y = (Interval(a, a + random.exponential(size=500)) for a in low)
    for t, u in random.uniform(size=(40, 2)):
        a, b = x.low + t * (x.high - x.low), y.low + u * (y.high - y.low)
        pairs = [(x + y, a + b), (x * y, a * b), (x / y, a / b), (-x, -a), (x.size(), abs(a)), (x.power(2.0), a**2)]
        pairs += [(x.power(3.0), a**3), (x.power(-3.0), a**-3), (x.sine(), np.sin(a)), (x.tangent(), np.tan(a))]
        for interval, value in pairs:
            round_off = 1e-12 * (1 + abs(value))
            assert ((interval.low <= value + round_off) & (value <= interval.high + round_off)).all()
    assert float(Interval(np.asarray(-1.0), np.asarray(2.0)).power(2.0).low) == 0.0
    assert (
        float((Interval(np.asarray(1.0), np.asarray(1.0)) / Interval(np.asarray(-1.0), np.asarray(1.0))).high) > 1e300
    )


@pytest.mark.few(1)
@pytest.mark.parametrize("width", [1e-5, 1e-7, pytest.param(1e-9, marks=pytest.mark.long), 1e-12])
@pytest.mark.parametrize(("peak", "integral"), [
    (lambda x: ufl.exp(-(x**2)), sqrt(pi)), (lambda x: (1 + x**2) ** -2, pi / 2), (lambda x: 1 - ufl.tanh(x) ** 2, 2.0),
])  # fmt: skip
def test_a_peak_of_any_width(peak: Callable[[Any], Any], integral: float, width: float) -> None:
    """It is seen as a stiffness, and places beside it give its integral."""
    tall = lambda s: 1 + peak((s - STEEP) / width) / width  # noqa: E731
    assert "about s = 0.78" in unresolved(scene(tall), equal(8), RULES)
    s = Symbol()
    places = refined(tall(s), s, np.linspace(0.0, 1.0, 20_001), 1.0)
    near = places[abs(places - STEEP) < 40 * width]
    values = Values(tall(s))({s: near}) - 1
    found = sum((b - a) * (u + v) / 2 for (a, b), (u, v) in zip(pairwise(near), pairwise(values), strict=True))
    assert found == pytest.approx(integral, rel=4e-3)


def test_two_answers_within_a_billionth_of_the_rod() -> None:
    """A comparison with a smooth peak changes twice, its difference being far from zero everywhere else."""
    soft = lambda s: ufl.conditional(ufl.lt(0.5, ufl.exp(-(((s - STEEP) / 1e-9) ** 2))), 0.1, 1.0)  # noqa: E731
    half = 1e-9 * np.sqrt(np.log(2.0))
    assert jumps(scene(soft))["stored energy"] == pytest.approx([STEEP - half, STEEP + half], abs=2e-12)

"""What changes too sharply for the elements along the rod: found, and said, where no error bar holds."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import pi
from typing import Any

import numpy as np
import pytest
import ufl
from classics import SUPPORTS, column
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from rodfem import Discretization, Plan, Scene, trace
from rodfem.problem.smoothness import Rules, unresolved

pytestmark = pytest.mark.alone

STEEP, WIDTH = 0.786, 1e-4
RULES = Rules(7, 8, 0.5**7, strains=(5, 6))


def scene(stiffness: Callable[[Any], Any], **more: Any) -> Scene:
    """A cantilever under a thrust whose bending stiffness is a function of the arclength."""
    return column(
        "steep", SUPPORTS["clamped-free"], (0.0, 6.0), energy=lambda v, k, c: 0.5 * (
            stiffness(c.s) * (k[0] ** 2 + 9 * k[1] ** 2) + k[2] ** 2
        ), **more,
    )  # fmt: skip


def equal(number: int) -> Callable[[float], list[tuple[float, float]]]:
    """Equal elements of a rod of length one, by a place in them."""
    ends = np.linspace(0.0, 1.0, number + 1).tolist()
    return lambda s: [(a, b) for a, b in pairwise(ends) if a <= s <= b]


@pytest.mark.long
def test_a_steep_stiffness() -> None:
    """``theta' = M/B, M' = -P theta`` with ``B = 1 + tanh((s - 0.786)/1e-4) / 2``, by Runge and Kutta."""
    place = lambda s: (s - STEEP) / WIDTH  # noqa: E731

    def moment(P: float) -> float:
        y, ends = np.array([0.0, 1.0]), (0.0, STEEP - 40 * WIDTH, STEEP + 40 * WIDTH, 1.0)
        for a, b in pairwise(ends):
            slope = lambda s, y: [y[1] / (1 + 0.5 * np.tanh(place(s))), -P * y[0]]  # noqa: E731
            y = solve_ivp(slope, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
        return float(y[1])

    load = brentq(moment, 1.0, 2.5, xtol=1e-11)
    steep = scene(lambda s: 1 + 0.5 * ufl.tanh(place(s)))
    blind = trace(steep, Discretization("reduced", 14, 3), Plan(depth=0))
    found = blind.special("branch point")[0]
    assert abs(found.point.load - load) > 1e5 * found.error_estimate
    assert any("stored energy changes too sharply about s = 0.78" in said for said in blind.warnings)
    close = STEEP + WIDTH * np.array([-16, -8, -4, -2, 0, 2, 4, 8, 16])
    vertices = tuple(float(s) for s in (0.0, 0.35, 0.65, *close, 0.86, 1.0))
    seeing = trace(steep, Discretization("reduced", len(vertices) - 1, 8, vertices), Plan(depth=0))
    found = seeing.special("branch point")[0]
    assert abs(found.point.load - load) < found.error_estimate < 1e-7
    assert seeing.warnings == []


@pytest.mark.few(3)
@pytest.mark.parametrize(
    ("f", "elements", "said"),
    [
        (lambda s: 1 - 0.4 * s**3, 2, False),
        (lambda s: 1 + 0.5 * ufl.cos(2 * pi * s), 5, False),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 0.1), 8, False),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-3), 8, True),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-3), 400, False),
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-9), 8, True),  # not told from a jump, but no comparison
        (lambda s: ufl.conditional(ufl.lt(s, STEEP), 1.0, 2.0), 8, False),  # a jump, said otherwise
        (lambda s: 1 + abs(s - STEEP), 8, True),
        (lambda s: 1 + 0 * abs(s - STEEP) + s**2, 8, False),
        (lambda s: 1 / (1 + 999 * ufl.exp(-(((s - STEEP) / 2e-4) ** 2))), 8, True),  # a notch beside all points
        (lambda s: 1 + ufl.exp(-(((s - STEEP) / 2e-5) ** 2)), 8, True),
        (lambda s: 1 + ufl.max_value(0, 1 - abs(s - STEEP) / 1e-6), 8, True),
        (lambda s: ufl.conditional(ufl.lt(abs(s - STEEP), 1e-4), 1e-3, 1.0), 8, False),  # jumps, said otherwise
        (lambda s: 1 + 0.5 * ufl.tanh((s - STEEP) / 1e-3) * ufl.conditional(ufl.lt(s, 0.7), 1.0, 0.9), 8, True),
    ],
)  # fmt: skip
def test_what_is_sharp(f: Callable[[Any], Any], elements: int, said: bool) -> None:
    sentence = unresolved(scene(f), equal(elements), RULES)
    assert ("about s = 0.786" in sentence or "about s = 0.785" in sentence) == said == bool(sentence)


def test_a_layer_that_strains_follow_in_part() -> None:
    """On 20 cubic elements the moments of the stiffness are known; a load was 1.3e-4 off, with a bar of 4e-5."""
    layer = lambda s: 1 + 0.0447015 * ufl.erf((s - 0.1512839) / 3.135095e-3)  # noqa: E731
    coarse, fine = Rules(4, 5, 0.5**4, strains=(2, 3)), Rules(9, 10, 0.5**9, strains=(7, 8))
    assert "for the element from 0.1" in unresolved(scene(layer), equal(20), coarse)
    assert unresolved(scene(layer), equal(400), fine) == ""


def test_a_load_that_is_sharp_in_another_unit() -> None:
    """A force along a rod of a kilometre, between two beds that end at a break."""
    bed = lambda x, c: 1e-9 * ufl.conditional(ufl.lt(x.s, 500.0), 1.0, 3.0) * x.r[0] ** 2  # noqa: E731
    push = lambda c: (0.0, 0.0, -c.P * (1 + ufl.tanh((c.s - 710.0) / 0.3)))  # noqa: E731
    long = column(
        "long", SUPPORTS["clamped-free"], (0.0, 1e-6), interval=(0.0, 1e3), breaks=(500.0,), potential=bed,
        distributed=push,
    )  # fmt: skip
    halves = [(i * 125.0, (i + 1) * 125.0) for i in range(8)]
    sentence = unresolved(long, lambda s: [e for e in halves if e[0] <= s <= e[1]], RULES)
    assert "distributed force changes too sharply about s = 7" in sentence and "from 625 to 750" in sentence


@pytest.mark.few(1)
@pytest.mark.parametrize("kink", [0.751, 0.7503])
def test_a_kink_beside_the_end_of_an_element(kink: float) -> None:
    """No point of the quadrature is between the kink and the end at 0.75: 2e-11 was the bar of 6e-7 (0.751)."""
    assert f"about s = {kink}" in unresolved(scene(lambda s: 1 + 0.5 * abs(s - kink)), equal(8), RULES)

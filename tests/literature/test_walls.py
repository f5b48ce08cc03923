"""A strut between two smooth walls, as barriers that are large, or not defined, far away from it."""

from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

import pytest
import ufl
from classics import SUPPORTS, column

from rodfem import Ordinate, Plan, trace

HALF, STEEP, WEAK = 0.05, 0.001, 1e-4
EXPONENTIAL = pi**2, lambda x, c: STEEP * (ufl.exp((x.r[0] - HALF) / STEEP) + ufl.exp((-x.r[0] - HALF) / STEEP))
LOGARITHM = pi**2 + 2 * WEAK / (pi * HALF) ** 2, lambda x, c: -WEAK * ufl.ln(1 - (x.r[0] / HALF) ** 2)


@pytest.mark.parametrize(("load", "wall"), [EXPONENTIAL, LOGARITHM], ids=["exponential", "logarithm"])
def test_a_strut_between_walls(load: float, wall: Callable[[Any, Any], Any]) -> None:
    """``P = pi^2 + w''/pi^2`` for the stiffness ``w''`` of the walls at rest, 1e-18 and ``2 WEAK/HALF^2``.

    Pressed to a wall in its middle, ``y = A (sin k s - k s cos(k/2))``, ``k^2 = P``; rigid walls are within 5 %.
    """
    strut = column(
        "walls", SUPPORTS["pinned-pinned"], (0.0, 20.0), planar="e2", constants={"B2": 1.0}, potential=wall,
        ordinate=Ordinate("quarter", s=0.25, of=lambda r, q: r[0]),
    )  # fmt: skip
    diagram = trace(strut, plan=Plan(depth=1, at=(15.0,)))
    found, pressed = diagram.special("branch point")[0], diagram[1]
    assert abs(found.point.load - load) <= found.error_estimate < 1e-9
    k = 15.0**0.5
    shape = (sin(k / 4) - k / 4 * cos(k / 2)) / (sin(k / 2) - k / 2 * cos(k / 2))
    (quarter,) = [abs(p.ordinate) for p in pressed.points if p.load == 15.0]
    assert quarter == pytest.approx(HALF * shape, rel=0.05) and pressed.ended == "end of range"

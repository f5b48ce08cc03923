"""Two branch points, of which one is at a row, the first and the last included, and the other in a step beside it."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from classics import column

from forms.energy import bending_and_twist
from rodfem import Diagram, Discretization, Plan, clamped, free, trace

pytestmark = pytest.mark.alone
EULER = pi**2 / 4
FIRST, LAST, HALF = 0.25, 2.3, 0.005


def traced(middle: float, sign: float) -> Diagram:
    """A cantilever under Euler's load times ``1 + sign (HALF^2 - (P - middle)^2)``: critical at ``middle -+ HALF``."""
    ends = clamped(), free(lambda c: (0.0, 0.0, -EULER * (1 + sign * (HALF**2 - (c.P - middle) ** 2))))
    rod = column("pair", ends, (FIRST, LAST), energy=lambda v, k, c: bending_and_twist(k, (1.0, 9.0, 1.0)), planar="e1")
    return trace(rod, Discretization("auto", 6, 6), Plan(depth=0, error_bars=False))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("row", [0, 3, -1])
@pytest.mark.parametrize("off", [0.0, 1e-6, -1e-6])
def test_one_of_two_branch_points_is_at_a_row(row: int, side: float, sign: float, off: float) -> None:
    """The rod is stable between them, or unstable there alone: the row itself does not tell which of both."""
    load = [p.load for p in traced(10.0, -1.0)[0].points][row]
    middle = load + off + side * HALF
    exact = [p for p in (middle - HALF, middle + HALF) if FIRST + 1e-8 < p < LAST - 1e-8]
    diagram = traced(middle, sign)
    found = [s.point.load for s in diagram.special("branch point") if FIRST + 1e-8 < s.point.load < LAST - 1e-8]
    np.testing.assert_allclose(found, exact, rtol=0, atol=3e-9)
    for point in diagram[0].points:
        if abs(abs(point.load - middle) - HALF) > 1e-4:
            assert point.negative == (
                (abs(point.load - middle) < HALF) if sign > 0 else (abs(point.load - middle) > HALF)
            )

"""A column in units in which its stiffness is a very large, or a very small number: the same diagram."""

from __future__ import annotations

from math import pi

import pytest

from rodfem import Ordinate, Plan, Scene, pinned, trace
from rodfem.forms.energy import bending_and_twist

pytestmark = pytest.mark.alone


@pytest.mark.long
@pytest.mark.parametrize(("stiffness", "push"), [(1.0, 1.0), (1e-20, 1e-15), (1e20, 1e15), (1e20, 1e20)])
def test_a_column_buckles_in_any_units(stiffness: float, push: float) -> None:
    """At ``pi^2``, with ``P = pi^2 (1 + (pi x)^2 / 8)`` for the amplitude ``x`` in the middle, in lengths.

    Reactions that vanish are round-off of forces of the size of the stiffness.
    """
    one = stiffness / push
    scene = Scene(
        "column",
        (0.0, 1.0),
        "unshearable and inextensible",
        lambda v, k, c: bending_and_twist(k, (9 * stiffness, stiffness, stiffness)),
        {"P": 0.0},
        "P",
        (pinned(), pinned(lambda c: (0.0, 0.0, None), lambda c: (0.0, 0.0, -c.P * push))),
        Ordinate("middle", s=0.5, of=lambda r, q: r[0]),
        (8 * one, 11 * one),
        planar="e2",
    )
    found = trace(scene, plan=Plan(depth=1))
    (special,) = found.special("branch point")
    assert abs(special.point.load - pi**2 * one) <= special.error_estimate < 1e-8 * one
    assert special.law is not None
    assert special.law.coefficient == pytest.approx(pi**4 / 8 * one, rel=1e-6)
    assert [branch.ended for branch in found] == ["end of range"] * 2
    assert found.warnings == []

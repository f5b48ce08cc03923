"""A ball on a circle: a column whose tip runs on one buckles at tan k = k (1 - R/v3), k^2 = N v3, N = EA (1 - v3)."""

from math import pi, tan

import pytest
from scipy.optimize import brentq

import rodfem
from rodfem import Ordinate, Scene, SceneError, circular_guide, clamped

EA = 500.0


def column(radius: float, planar: str | None = None) -> Scene:
    """Pushed by its circle, whose centre is below the tip and moves down by e."""
    return Scene(
        "ball", (0.0, 1.0), "unshearable",
        lambda v, k, c: 0.5 * EA * (v[2] - 1) ** 2 + 0.5 * (k[0] ** 2 + k[1] ** 2 + k[2] ** 2), {"e": 0.0}, "e",
        (clamped(), circular_guide(radius, "e1", lambda c: (0.0, 0.0, 1.0 - radius - c.e))),
        Ordinate("tip", s=1.0, of=lambda r, q: r[1]), (0.0, 0.03), planar=planar,
    )  # fmt: skip


def determinant(e: float, radius: float) -> float:
    k = (EA * e * (1 - e)) ** 0.5
    return tan(k) - k * (1 - radius / (1 - e))


@pytest.mark.parametrize("radius", [1.0, 5.0])
def test_a_column_whose_tip_runs_on_a_circle(radius: float) -> None:
    """R = 1 is the force through the foot: pi^2."""
    exact = brentq(determinant, 1.01 * pi**2 / 4 / EA, 12.0 / EA, (radius,), xtol=1e-15)
    diagram = rodfem.trace(column(radius), depth=1)
    (buckling,) = diagram.special("branch point")
    assert abs(buckling.point.load - exact) < buckling.error_estimate and not diagram.warnings
    assert diagram[0].points[2].reactions.right.force[2] == pytest.approx(-EA * diagram[0].points[2].load, rel=1e-9)
    bent = diagram["branch 1"].points[-1]
    assert bent.r[-1, 1] ** 2 + (bent.r[-1, 2] - 1 + radius + bent.load) ** 2 == pytest.approx(radius**2, rel=1e-9)


def test_mistakes() -> None:
    with pytest.raises(SceneError, match="radius -1"):
        circular_guide(-1.0)
    with pytest.raises(SceneError, match="across 'z'"):
        circular_guide(1.0, "z")
    with pytest.raises(SceneError, match="leaves the plane across e2"):
        column(1.0, "e2")

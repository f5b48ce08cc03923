"""Rods on a surface: the force of the surface, and that and the moment in the rod, against closed forms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import ufl
from classics import column

import rodfem
from rodfem import Discretization, Ordinate, Plan, clamped, everywhere, free, hinged, pinned, sliding, tabulated

pytestmark = pytest.mark.ranks

R, RADIUS, PRESSURE = 0.8, 0.01, 10.0
LOW = (-RADIUS, 0.0, 0.0)


def push(c: Any) -> tuple[float, float, Any]:
    return (0.0, 0.0, -c.F)


TUBE = column(
    "tube", (pinned(LOW), pinned((*LOW[:2], None), force=push)), (0.0, 66.0), load="F",
    constants={"F": 0.0, "B2": 1.0}, distributed=lambda c: (-PRESSURE, 0.0, 0.0),
    constraints=(
        everywhere(lambda x, c: (x.r[0] ** 2 + x.r[1] ** 2 - RADIUS**2) / (2 * RADIUS), strain=False),
    ),
    ordinate=Ordinate("y", s=0.5, of=lambda r, q: r[1]),
)  # fmt: skip
AXIS = (1.0, 0.0, 0.0)
ENDS = {
    "sliding": (sliding((*LOW[:2], 0.0)), sliding((None, None, None), force=push)),
    "free across": (sliding((None, 0.0, 0.0)), sliding((None, None, None), force=push)),
    "clamped": (clamped(LOW), sliding((*LOW[:2], None), force=push)),
    "pinned": TUBE.ends,
    "hinged": (hinged(AXIS, LOW), hinged(AXIS, (*LOW[:2], None), force=push)),
    "free": (clamped(LOW), free(force=push)),
}


@pytest.mark.parametrize("ends", ENDS)
def test_a_straight_rod_presses_by_its_weight(ends: str) -> None:
    """On the lowest line, or the highest one, of a tube: whatever holds its ends no shear force is in it."""
    tube, across = replace(TUBE, ends=ENDS[ends], span=(0.0, 1.0)), 1.0 if ends == "free across" else 0.0
    moved = everywhere(lambda x, c: ((x.r[0] + across * RADIUS) ** 2 + x.r[1] ** 2 - RADIUS**2) / 0.02, strain=False)
    diagram = rodfem.trace(replace(tube, constraints=(moved,)), Discretization("pointwise", 4, 3), Plan(depth=0))
    point = diagram[0].points[0]
    pressure = diagram.solvers[0].shape.sample(point.x)["p1"][:, 0]
    assert np.allclose(abs(pressure), PRESSURE, rtol=1e-9)
    assert abs(point.force_in_space[:, 0]).max() < 1e-9
    assert not diagram.warnings


LEFT = {"clamped": clamped(), "hinge in the surface": hinged(AXIS), "hinge across it": hinged((0.0, 1.0, 0.0))}


@pytest.mark.parametrize("left", LEFT)
def test_a_rod_pulled_over_a_sphere(left: str) -> None:
    """It has the curvature of the sphere to its free end, where the sphere holds it by a couple ``B / R``.

    That moves along the sphere with the end: it does the work of a force ``B / R^2`` against the pull.
    """

    def arc(s: Any) -> np.ndarray:
        return np.stack([np.cos(s / R / 2), 0 * s, np.sin(s / R / 2), 0 * s], axis=1)

    def height(x: Any, c: Any) -> Any:
        return ufl.sqrt((x.r[0] - R) ** 2 + x.r[1] ** 2 + x.r[2] ** 2) - R

    tangent = np.sin(1 / R), 0.0, np.cos(1 / R)
    sphere = replace(
        TUBE, start=arc, distributed=None, span=(2.0, 3.0),
        ends=(LEFT[left], free(force=lambda c: tuple(c.F * t for t in tangent))),
        constraints=(everywhere(height, strain=False),),
    )  # fmt: skip
    diagram = rodfem.trace(sphere, Discretization("pointwise", 4, 6), Plan(depth=0))
    point = diagram[0].points[-1]
    tension = 3.0 - 1 / R**2
    assert np.allclose(diagram.solvers[0].shape.sample(point.x)["p1"], -tension / R, rtol=1e-6)
    assert np.allclose(point.force, (0.0, 0.0, tension), atol=1e-7)
    assert np.allclose(point.moment, (0.0, 1 / R, 0.0), atol=1e-7)
    assert np.allclose(point.reactions.left.force, (0.0, 0.0, -tension), atol=1e-7)
    assert np.allclose(point.reactions.right.force, -np.multiply(tangent, 1 / R**2), atol=1e-7)


WAVE, ROWS = 0.05, np.linspace(0.0, 1.0, 41)
TABLE = tabulated(ROWS, WAVE * np.sin(np.pi * ROWS) ** 2, order=3)
HEIGHTS = {"formula": (lambda s: WAVE * ufl.sin(np.pi * s) ** 2, 1e-6), "table": (TABLE, 2e-3)}


@pytest.mark.parametrize("height", HEIGHTS)
def test_a_surface_along_the_rod(height: str) -> None:
    """Its curvature at the crest, where the height has no slope, is the second derivative of that."""
    of, accuracy = HEIGHTS[height]
    origin = (0.0, 0.0, 0.0)
    bent = replace(
        TUBE, distributed=None, ends=(clamped(origin), sliding((0.0, 0.0, None), force=push)), span=(0.0, 1.0),
        constraints=(everywhere(lambda x, c: x.r[0] - of(c.s), strain=False),),
    )  # fmt: skip
    point = rodfem.trace(bent, Discretization("pointwise", 8, 4), Plan(depth=0))[0].points[-1]
    middle = len(point.s) // 2
    assert point.r[middle, 0] == pytest.approx(WAVE, rel=accuracy)
    assert point.moment[middle, 1] == pytest.approx(-2 * np.pi**2 * WAVE, rel=accuracy)

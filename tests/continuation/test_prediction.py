"""Predictions of branches whose states are on orbits of a symmetry."""

from __future__ import annotations

from math import pi

import pytest
from hard.writhing import clamped_rod

from rodfem import Discretization, Plan, trace


@pytest.mark.long
@pytest.mark.alone
@pytest.mark.parametrize("formulation", ["auto", "pointwise"])
def test_no_part_along_an_orbit_is_handed_on(formulation: str) -> None:
    """The loop of a turned rod: 350 rows, each of which may turn about the axis.

    A rod turned by 4 pi has the states of one that is not: the loads of the folds have the sum 4 pi, and the branch
    goes from the planar elastica to itself.
    """
    scene = clamped_rod(1.0, "phi", 0.45, (0.0, 4 * pi))
    (branch,) = trace(scene, Discretization(formulation, 10, 6), Plan(depth=0, error_bars=False))
    assert branch.ended == "end of range"
    first, last = (s.point.load for s in branch.special if s.kind == "fold")
    assert first + last == pytest.approx(4 * pi, abs=1e-9)
    assert branch.points[-1].energy == pytest.approx(branch.points[0].energy, rel=1e-9)

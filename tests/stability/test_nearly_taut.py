"""Frequencies of a rod that cannot stretch and is nearly pulled taut, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hard.fuzz import wider
from hard.fuzz.oracle import Oracle

from rodfem import Discretization, Plan, trace

pytestmark = pytest.mark.alone


@pytest.mark.parametrize("number", [172, 175])
def test_a_sweep_ends_where_the_rod_is_taut(number: int) -> None:
    """The tension of a taut rod is any, and so are its frequencies: 115.9 and -21.7 were recorded for one state."""
    scene = wider.scene(15, number)[0]
    diagram = trace(scene, Discretization("auto", 5, 6), Plan(error_bars=False))
    (branch,) = diagram
    assert branch.ended.startswith("no frequencies at P = 0: Constraints depend on one another")
    assert branch.ended in diagram.warnings
    oracle = Oracle(diagram.solvers[0].system)
    for point in branch.points[-3:]:  # of some of their motions the forces are the largest part
        dense = np.sort(oracle.squares(point.x).real)
        found = np.array([value for value, _ in point.omega2])
        assert abs(found - dense[: len(found)]).max() < 1e-6 * dense[len(found) - 1]

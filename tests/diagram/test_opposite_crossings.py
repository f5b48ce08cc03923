"""Eigenvalues that pass zero together in opposite directions; `tests/hard/planes.py` has them at random."""

from __future__ import annotations

import pytest
from hard.planes import MESH, Draw, Plane

from rodfem import Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT

pytestmark = pytest.mark.alone


@pytest.mark.long
def test_both_modes_leave_a_branch_point_of_opposite_crossings() -> None:
    """The null vectors bend the rod in one plane each, and branches of both planes leave there."""
    draw = Draw((Plane((0.5532544,), (1.65,), 0.139), Plane((0.5532544,), (0.147,), -0.336)), 1.0)
    diagram = trace(draw.scene(), MESH, Plan(depth=1, error_bars=False))
    (special,) = [s for s in diagram[0].special if s.kind == BRANCH_POINT]
    assert special.multiplicity == 2 and special.negative_before == special.negative_after == 1
    assert special.point.load == pytest.approx(draw.planes[0].zeros[0], abs=1e-9)
    assert len([branch for branch in diagram if branch.parent]) == 2

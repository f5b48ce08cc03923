"""The motion of a ring along itself: one of the drifts where the state breaks it, and none where only the mesh does."""

from __future__ import annotations

import pytest
from hard.published import pressed

from rodfem import Discretization, Plan, trace
from rodfem.continuation.kinds import BRANCH_POINT


@pytest.mark.long
@pytest.mark.alone
def test_a_ring_that_is_bent_a_little_moves_along_itself() -> None:
    """Translations apart, a circle has its rotation in the plane alone, which is its motion along itself, too.

    With two waves of an amplitude from 1e-5 on these are two motions; one of round-off is none.
    """
    diagram = trace(pressed("dead", (0.3, 4.5)), Discretization("pointwise", 16, 6), Plan(depth=0, error_bars=False))
    (special,) = [s for s in diagram[0].special if s.kind == BRANCH_POINT]
    system, drifts = diagram.solvers[0].system, {}
    for amplitude in (0.0, 1e-8, 3e-5, 1e-4, 1e-2):
        x = special.point.x + amplitude * special.null_vectors[0]
        system.set_phase(x)
        drifts[amplitude] = system.active_drifts(x)
    circle = drifts[0.0]
    assert drifts == {0.0: circle, 1e-8: circle, 3e-5: circle + 1, 1e-4: circle + 1, 1e-2: circle + 1}

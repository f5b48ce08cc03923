"""Events: zeros of a number of the state along a branch are special points with error bars."""

from __future__ import annotations

import classics
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import rodfem
from rodfem import Discretization, Event, InputError, Plan

pytestmark = pytest.mark.alone


@pytest.mark.parametrize("apart", [0.5, 0.0, -0.1])
def test_the_distance_of_the_ends_of_an_elastica(apart: float) -> None:
    """That of a pinned column is ``2 E(m)/K(m) - 1`` at ``P = 4 K(m)^2``; where they meet the loop may turn, too."""
    m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - apart, 0.01, 0.99)
    meet = Event("apart", of=lambda state: state.r[-1, 2] - state.r[0, 2] - apart)
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 25.0), planar="e1")
    found = rodfem.trace(rod, Discretization("auto", 8, 6), Plan(depth=1, events=(meet,)))
    (event,) = found.special("event")
    assert event in found["branch 1"].special
    assert event.note.startswith("apart")
    assert event.negative_before == event.negative_after == event.point.index
    error = abs(event.point.load - 4 * ellipk(m) ** 2)
    assert error <= event.error_estimate
    assert error < 1e-6
    assert event.error_estimate < 1e-6 or not apart  # at a branch point the richer mesh may be on its other branch
    assert [s.kind for s in found["straight"].special].count("event") == 0


def test_an_event_that_fails_is_named() -> None:
    rod = classics.column("pinned", classics.SUPPORTS["pinned-pinned"], (0.0, 5.0), planar="e1")
    wrong = Plan(depth=0, events=(Event("tip", of=lambda state: state.tip),))
    with pytest.raises(InputError, match=r"The event 'tip' fails with AttributeError, .*: it receives a state with"):
        rodfem.trace(rod, plan=wrong)
    with pytest.raises(InputError, match="give Events, as in"):
        Plan(events=(np.sin,))  # type: ignore[arg-type]

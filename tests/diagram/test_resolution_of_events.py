"""What an event that is not seen may hide in is said, and only where events are asked for."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from classics import column, push

from rodfem import Discretization, Event, Plan, clamped, free, trace


@pytest.mark.long
@pytest.mark.alone
def test_how_far_apart_the_states_are_is_in_a_note() -> None:
    """The widest of five places in the longest step: 0.46 (1 - 0.46) or 0.54^2 of it."""
    scene = column("looked at", (clamped(), free(push)), (0.0, 2.0), planar="e2")
    given: dict[str, Any] = {"depth": 0, "error_bars": False}
    mesh = Discretization("auto", 2, 4)
    assert not trace(scene, mesh, Plan(**given)).notes
    diagram = trace(scene, mesh, Plan(events=(Event("tip", of=lambda state: state.r[-1, 2] - 0.5),), **given))
    loads = [p.load for p in diagram[0].points]
    widest = 0.54**2 * max(b - a for a, b in pairwise(loads))
    (note,) = diagram.notes
    assert f"up to {widest:.2g} in P apart, is not seen" in note

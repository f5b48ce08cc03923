"""Files of another rod: what no number of a scene tells, its equations do; and the plan of a diagram that is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from classics import column

import rodfem
from rodfem import Attachment, Discretization, Drag, Event, Inertia, Plan, Scene, clamped, free
from rodfem.continuation.kinds import EVENT
from rodfem.errors import InputError
from rodfem.fem.fingerprint import fingerprint, same
from rodfem.fem.system import System

MESH = Discretization("auto", 4, 4)


def loaded(mass: float = 1.0, tip: float = 1.0) -> Scene:
    """Pflueger's column, of a mass along it and one at its tip."""
    ends = (clamped(), free(follower=lambda c: (0.0, 0.0, -c.P)))
    carried = (Attachment(1.0, mass=lambda c: tip),)
    return column("carried", ends, (0.0, 6.0), inertia=Inertia(rho_A=lambda c: mass), attachments=carried)


def crooked(e: float) -> Scene:
    """A cantilever with a force across it that is zero at both ends of its range."""
    return column("crooked", (clamped(), free(lambda c: (e * c.P * (6.0 - c.P), 0.0, -c.P))), (0.0, 6.0))


@pytest.mark.ranks
@pytest.mark.parametrize(
    ("rod", "other"),
    [
        (loaded(), loaded(mass=1.1)),
        (loaded(), loaded(tip=0.1)),
        (crooked(0.05), crooked(0.0)),
        (replace(crooked(0.05), inertia=Drag()), replace(crooked(0.05), inertia=Inertia(rho_I=(0.0, 0.0, 0.0)))),
    ],
    ids=["mass along it", "mass at its tip", "between the ends", "drag or mass"],
)
def test_another_rod_has_another_fingerprint(rod: Scene, other: Scene) -> None:
    """Its inertia, and what differs between the ends of the range alone."""
    first, again, last = (fingerprint(System(scene, MESH), (0.0, 6.0)) for scene in (rod, rod, other))
    assert same(first, again) and not same(first, last)


@pytest.mark.long
@pytest.mark.usefixtures("few_loads")
def test_a_diagram_that_is_read_keeps_its_plan(folder: Path) -> None:
    """Depth, loads asked for, and what else a file holds; of steps and events it says that it has them not."""
    plan = Plan((0.0, 6.0), at=(1.0,), depth=0, error_bars=False)
    rodfem.run(crooked(0.0), MESH, plan, folder, figures=False, quiet=True)
    read = rodfem.load(folder, crooked(0.0))
    assert read.plan == plan
    assert [b.name for b in read.again()] == ["straight"]
    tip = Event("tip", of=lambda s: s.r[-1, 0] - 0.1)
    rodfem.run(crooked(0.05), MESH, replace(plan, events=(tip,)), folder, figures=False, quiet=True)
    read = rodfem.load(folder, crooked(0.05))
    with pytest.raises(InputError, match="had events of its own, which no file holds"):
        read.again()
    assert read.again(events=(tip,)).special(EVENT)

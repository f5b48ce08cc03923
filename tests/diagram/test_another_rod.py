"""Files of another rod, or of another event: what no number of a scene tells, its equations do."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import ufl
from classics import column

import rodfem
from rodfem import Attachment, Discretization, Event, Inertia, Plan, Scene, clamped, free
from rodfem.continuation.kinds import EVENT
from rodfem.errors import InputError
from rodfem.fem.fingerprint import OLDER, fingerprint, same, same_event
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


def beyond(e: float) -> Scene:
    """A cantilever with a force across it above its own range."""
    ends = clamped(), free(lambda c: (e * ufl.max_value(c.P - 1.0, 0.0), 0.0, -c.P))
    return column("beyond", ends, (0.0, 1.0))


OTHERS: dict[str, tuple[Callable[[], Scene], Callable[[], Scene], Plan]] = {
    "mass along it": (loaded, lambda: loaded(mass=1.1), Plan((0.0, 6.0), error_bars=False)),
    "mass at its tip": (loaded, lambda: loaded(tip=0.1), Plan((0.0, 6.0), error_bars=False)),
    "between the ends": (lambda: crooked(0.05), lambda: crooked(0.0), Plan((0.0, 6.0), depth=0, error_bars=False)),
}


@pytest.mark.long
@pytest.mark.alone
@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.usefixtures("few_loads")
def test_files_of_another_rod(folder: Path, name: str) -> None:
    """Its inertia, and what differs between the ends of the range alone; the rod itself is read."""
    scene, other, plan = OTHERS[name]
    rodfem.run(scene(), MESH, plan, folder, figures=False, quiet=True)
    assert len(rodfem.load(folder, scene())) == 1
    assert len(rodfem.resume(folder, scene(), quiet=True, figures=False)) == 1
    for read in (rodfem.load, lambda *a: rodfem.resume(*a, quiet=True, figures=False)):
        with pytest.raises(InputError, match="was run with other equations than those of the scene"):
            read(folder, other())


def test_a_fingerprint_of_an_older_file() -> None:
    """It has residual, energy and ordinate at both ends of the range of the scene: these are compared."""
    numbers = {e: fingerprint(System(crooked(e), MESH), (0.0, 6.0)) for e in (0.0, 0.05)}
    older = numbers[0.05][: 2 * OLDER]
    assert same(older, numbers[0.05]) and same(older, numbers[0.0])
    assert not same(numbers[0.05], numbers[0.0])
    assert not same([1.01 * x if x is not None else x for x in older], numbers[0.05])


@pytest.mark.long
def test_loads_beyond_the_range_of_the_scene() -> None:
    """Of a plan with a wider range that is seen, too."""
    for high, alike in ((1.0, True), (6.0, False)):
        first, second = (fingerprint(System(beyond(e), MESH), (0.0, high)) for e in (0.0, 0.05))
        assert same(first, second) == alike


# --- events ----------------------------------------------------------------------------------------------------------


def reaching(x: float, name: str = "reaches") -> Plan:
    """A plan with an event: the tip is at ``x``."""
    return Plan((0.0, 1.0), depth=0, error_bars=False, events=(Event(name, of=lambda s: s.r[-1, 0] - x),))


@pytest.mark.long
@pytest.mark.alone
def test_another_event_of_one_name(folder: Path) -> None:
    """A complete run and one that goes on tell it from that of the run; of an older file names are compared."""
    scene = column("pulled", (clamped(), free(lambda c: (c.P, 0.0, 0.0))), (0.0, 1.0))
    silent: dict[str, Any] = {"quiet": True, "figures": False}
    rodfem.run(scene, MESH, reaching(0.1), folder, **silent)
    kept = rodfem.resume(folder, scene, MESH, reaching(0.1), **silent)
    assert [s.note for s in kept.special("reaches")] == ["reaches"]
    with pytest.raises(InputError, match="was run with another event 'reaches'"):
        rodfem.resume(folder, scene, MESH, reaching(0.05), **silent)
    data = json.loads((folder / "diagram.json").read_text())
    del data["asked"]["events"]
    (folder / "diagram.json").write_text(json.dumps(data))
    assert len(rodfem.resume(folder, scene, MESH, reaching(0.1), **silent)) == 1
    with pytest.raises(InputError, match="was run with events"):
        rodfem.resume(folder, scene, MESH, reaching(0.1, "arrives"), **silent)


def test_values_of_events() -> None:
    """Round-off of zero is no difference; a value where the other has none is one."""
    for first, second, alike in (
        ([1.0, 2.0], [1.0, 2.0 + 1e-12], True),
        ([1.0, 2.0], [1.0, 2.0 + 1e-6], False),
        ([1e-17, 0.0], [0.0, -1e-16], True),
        ([None, 2.0], [None, 2.0], True),
        ([None, 2.0], [1.0, 2.0], False),
        ([None, None], [None, None], True),
        ([None, None], [1.0, 2.0], False),
        ([1.0], [1.0, 2.0], True),
    ):
        assert same_event(first, second) == same_event(second, first) == alike


@pytest.mark.long
@pytest.mark.alone
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

"""Files of another rod: what no number of a scene tells, its equations do; and the plan of a diagram that is read."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import pytest
import ufl
from classics import column

import rodfem
from rodfem import (
    Attachment,
    Discretization,
    Drag,
    Event,
    Inertia,
    Plan,
    Scene,
    clamped,
    everywhere,
    free,
    hinged,
    sliding,
    trace,
)
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


def test_a_fingerprint_of_an_older_file() -> None:
    """It has residual, energy and ordinate at both ends of the range of the scene: these are compared."""
    numbers = {e: fingerprint(System(crooked(e), MESH), (0.0, 6.0)) for e in (0.0, 0.05)}
    older = numbers[0.05][:6]
    assert same(older, numbers[0.05]) and same(older, numbers[0.0])
    assert not same([1.01 * x if x is not None else x for x in older], numbers[0.05])


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


@pytest.mark.alone
def test_files_of_version_1(folder: Path) -> None:
    """They have the multiplier ``p0`` for ``p1``, twice the moments at the ends, and residuals with these."""
    end = sliding((0.0, None, None), lambda c: (ufl.cos(c.P / 2), 0.0, 0.0, ufl.sin(c.P / 2)))
    kept = (everywhere(lambda x, c: x.k[0], strain=True),)
    scene = column("turned", (hinged((1.0, 0.0, 0.0)), end), (0.0, 0.5), constants={"C": 2.0}, constraints=kept)
    diagram = trace(scene, plan=Plan(error_bars=False, depth=0), discretization=MESH)
    diagram.save(folder)
    data = json.loads((folder / "diagram.json").read_text())
    data["format"]["version"] = 1
    data["asked"]["equations"] = fingerprint(diagram.solvers[0].system, (0.0, 0.5), 1)
    (folder / "diagram.json").write_text(json.dumps(data))
    with h5py.File(folder / "states.h5", "a") as file:
        file.attrs["format_version"], states = 1, file["branches/straight"]
        states.move("p1", "p0")
        assert states["mb3"][-1] == pytest.approx(-1.0)  # the rod exerts it, C = 2 at half a radian
        for name in ("ma1", "ma2", "mb1", "mb2", "mb3"):
            states[name][...] = 2.0 * states[name][...]
    before, now = (d["straight"].points[-1] for d in (diagram, rodfem.load(folder, scene)))
    assert (now.x - before.x).norm() < 1e-12

"""Many rods: shared among ranks, kept in files, and taken up again."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import classics
import numpy as np
import pytest
from demo_cases import scene
from mpi4py import MPI

from rodfem import Attachment, Ordinate, at, clamped, free
from rodfem.app.code_digest import digest_of
from rodfem.app.many import many
from rodfem.errors import InputError, SceneError
from rodfem.forms.energy import bending_and_twist
from rodfem.problem.scene import Scene

COMM = MPI.COMM_WORLD


@pytest.mark.versions
@pytest.mark.short
def test_shared_kept_and_taken_up_again(folder: Path) -> None:
    rods = [scene("cord", turns=float(turns)) for turns in (1.0, 1.5, 2.0, 2.5, 3.0)]
    done: list[float] = []

    def work(rod: Scene) -> dict[str, Any]:
        k0 = rod.parameters["k0"].value
        done.append(k0)
        if k0 > 18:
            raise SceneError("too many turns")
        return {"square": k0**2}

    results = many(rods, work, folder / "many")
    assert [round(r["square"], 6) for r in results[:4]] == [round(r.parameters["k0"].value ** 2, 6) for r in rods[:4]]
    assert results[4] == {"error": "too many turns"}
    assert len(done) == len(rods[COMM.rank :: COMM.size])
    assert COMM.allreduce(len(done)) == 5
    (folder / "many" / "rod-00001.json").write_text("{ cut off")
    COMM.barrier()
    changed = [replace(rods[0], span=(50.0, 0.0)), *rods[1:]]
    done.clear()
    assert many(changed, work, folder / "many") == results
    assert COMM.allreduce(len(done)) == 2  # the one that was cut off, the one that has changed


class Material:
    """A bending stiffness: its method has the same code whatever that is."""

    def __init__(self, stiffness: float) -> None:
        self.stiffness = stiffness

    def energy(self, v: Any, k: Any, c: Any) -> Any:
        return bending_and_twist(k, (self.stiffness, 2.0, 1.0))


def thrust(c: Any) -> tuple[Any, ...]:
    return (0.0, 0.0, -c.P)


PAIRS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "method of an object": ({"energy": Material(1.0).energy}, {"energy": Material(1.2).energy}),
    "partial": tuple({"energy": partial(Material.energy, Material(x))} for x in (1.0, 1.2)),  # type: ignore[dict-item]
    "length": ({}, {"interval": (0.0, 1.1)}),
    "planar": ({}, {"planar": "e1"}),
    "ordinate": ({}, {"ordinate": Ordinate("tip", s=0.5, of=lambda r, q: r[0])}),
    "attachment": tuple({"attachments": (Attachment(s, force=thrust),)} for s in (0.5, 0.6)),  # type: ignore[dict-item]
    "constraint": tuple({"constraints": (at(s, lambda x, c: x.r[1]),)} for s in (0.5, 1.0)),  # type: ignore[dict-item]
    "clamp": ({}, {"ends": (clamped(rotation=(0.0, 1.0, 0.0, 0.0)), free(thrust))}),
}


@pytest.mark.few(3)
@pytest.mark.parametrize("what", PAIRS)
def test_scenes_that_state_other_rods_have_other_digests(what: str) -> None:
    """Each pair has the same name, load, range and constants, and functions of the same code."""
    rod = replace(classics.euler("clamped-free"), energy=Material(1.0).energy)
    one, other, again = (replace(rod, **changes) for changes in (*PAIRS[what], PAIRS[what][0]))
    assert digest_of(one) == digest_of(again) != digest_of(other)


@pytest.mark.alone
def test_another_energy_or_other_work_is_computed_anew(folder: Path) -> None:
    def softer(v: Any, k: Any, c: Any) -> Any:
        return 0.5 * given(v, k, c)

    rods, done = [scene("cord", turns=1.0)], [0]
    given = rods[0].energy

    def work(rod: Scene) -> dict[str, Any]:
        done[0] += 1
        return {"name": rod.name}

    for others, count in ((rods, 1), (rods, 1), ([replace(rods[0], energy=softer)], 2), (rods, 3)):
        many(others, work, folder, MPI.COMM_SELF if COMM.size == 1 else COMM)
        assert COMM.allreduce(done[0]) == count
    assert many(rods, lambda rod: {"name": rod.name.upper()}, folder) == [{"name": "CORD"}]
    for loads in (np.array([1.0, 2.0]), np.array([3.0])):
        assert many(rods, lambda rod, loads=loads: {"last": loads[-1]}, folder) == [{"last": loads[-1]}]


@pytest.mark.alone
def test_a_result_of_a_newer_format_is_kept(folder: Path) -> None:
    """It is refused on every rank, and not written over."""
    rods = [scene("cord", turns=float(turns)) for turns in (1.0, 1.5, 2.0)]
    many(rods, lambda rod: {"span": list(rod.span)}, folder)
    file = folder / "rod-00001.json"
    if COMM.rank == 0:
        data = json.loads(file.read_text())
        file.write_text(json.dumps(data | {"format": data["format"] | {"version": 2, "program": "rodfem 9.1"}}))
    COMM.barrier()
    text = file.read_text()
    with pytest.raises(InputError, match=r"rod-00001.json was written by rodfem 9.1, in version 2 of the format"):
        many(rods, lambda rod: {}, folder)
    assert file.read_text() == text

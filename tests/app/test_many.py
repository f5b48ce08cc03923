"""Many rods: shared among ranks, kept in files, and taken up again."""

import csv
import json
import re
from dataclasses import replace
from math import pi
from pathlib import Path
from time import process_time
from typing import Any

import closed_form_hemitropic
import hemitropic_cases
import numpy as np
import pytest
from demo_cases import scene
from mpi4py import MPI

import rodfem.app.many as many_rods
from rodfem import InputError, Plan, Scene, SceneError, family, many
from rodfem.app.console import main

COMM = MPI.COMM_WORLD


@pytest.mark.ranks
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


STRUT = """
from rodfem import Ordinate, Parameter, Scene, clamped, free
from rodfem.forms.energy import bending_and_twist

def strut(B: float = 1.0) -> Scene:
    return Scene(
        "strut", (0.0, 1.0), "unshearable and inextensible", lambda v, k, c: bending_and_twist(k, (c.B, 2 * c.B, 0.8)),
        {"P": Parameter(0.0), "B": Parameter(B)}, "P", (clamped(), free(force=lambda c: (0, 0, -c.P))),
        Ordinate("tip", s=1.0, of=lambda r, q: r[1]), (2.0, 4.0),
    )
"""


def test_a_table_has_a_rod_in_each_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Columns are constants, options and fields of a plan; Euler's load is B pi^2/4."""
    file, table = folder / "strut.py", folder / "rods.csv"
    file.write_text(STRUT)
    table.write_text("B,elements,steps,depth,at\n1.0,4,0.3,0,2.1 2.2\n1.5,,,0,\n3.0,,,0,\n")
    main(["many", str(file), str(table), "--output", str(folder / "many")])
    assert capsys.readouterr().out.strip() == str(folder / "many" / "many.csv")
    lines = list(csv.DictReader((folder / "many" / "many.csv").read_text().splitlines()))
    assert [(x["B"], x["load"]) for x in lines if x["kind"] == "user"] == [("1.0", "2.1"), ("1.0", "2.2")]
    for line in (x for x in lines if x["kind"] == "branch point"):
        assert abs(float(line["load"]) - float(line["B"]) * pi**2 / 4) <= float(line["error_estimate"])
    saved = [json.loads((folder / "many" / f"rod-0000{i}" / "diagram.json").read_text()) for i in range(3)]
    assert [x["discretization"]["elements"] for x in saved] == [4, 8, 8]
    assert "largest=0.3" in saved[0]["asked"]["plan"]["steps"] and len(saved[2]["branches"][0]["special"]) == 1


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "B,elemnts\n1,4\n",
            "has a column 'elemnts': a column is a constant, an option of rodfem run .* --help lists them",
        ),
        ("B,at\n1,3\n1,77\n", "rod 1: The load 77 asked for is outside the range 2 to 4"),
        ("B\n", "has no line of a rod"),
    ],
)
def test_a_table_is_refused_before_any_rod_is_traced(
    folder: Path, capsys: pytest.CaptureFixture[str], text: str, sentence: str
) -> None:
    (folder / "strut.py").write_text(STRUT)
    (folder / "rods.csv").write_text(text)
    with pytest.raises(SystemExit):
        main(["many", str(folder / "strut.py"), str(folder / "rods.csv"), "--output", str(folder / "many")])
    assert re.search(sentence, capsys.readouterr().err) and not (folder / "many").exists()


def test_a_family_has_the_critical_loads_of_every_rod(folder: Path) -> None:
    """The cord of N turns: 4 pi^2 (N^2 - 1); one has a second point, where the other has nan."""
    turns, plan = np.array([1.2, 1.5]), Plan(depth=0, error_bars=False)
    found = family(scene("cord"), {"k0": 2 * pi * turns}, folder, plan)
    assert np.allclose(found.first_loss, 4 * pi**2 * (turns**2 - 1), rtol=1e-10)
    assert np.isfinite(found.critical_load).sum("point").values.tolist() == [1, 2]
    again = family(scene("cord"), {"k0": 2 * pi * turns}, folder, plan)
    assert again.identical(found)
    with pytest.raises(InputError, match="constants other than the load"):
        family(scene("cord"), {"lam": (1.0,)}, folder)


def assert_closed_form(found: Any) -> None:
    """Compare all critical loads of straight hemitropic rods, with what their indices are in between."""
    for rod in (found.isel(A=i, C=j) for i in range(found.A.size) for j in range(found.C.size)):
        exact = closed_form_hemitropic.loads(float(rod.A), 1.0, float(rod.C), 3.0)
        own = rod.critical_load.values
        assert own[np.isfinite(own)] == pytest.approx(exact, abs=1e-7)  # of this mesh: 2e-8 of the third load
        assert float(rod.first_loss) == own[0] and rod.trouble == ""
        beyond = 0.5 * (exact[0] + [*exact, 0.95][1])
        steps = closed_form_hemitropic.index(beyond, float(rod.A), 1.0, float(rod.C), 3.0)
        assert rod.index_after.values[0] == steps


def test_rods_of_a_family_are_continued_from_their_neighbours(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 30 rods with two to four critical loads few are traced, and all have those of the closed form."""
    traced = list[float]()
    follow = many_rods.trace
    monkeypatch.setattr(many_rods, "trace", lambda rod, *a, **k: traced.append(1) or follow(rod, *a, **k))
    over = {"A": np.linspace(-3.0, 0.0, 15), "C": [1.0, 1.02]}
    found = family(hemitropic_cases.scene(), over, folder, Plan(depth=0, error_bars=False), comm=MPI.COMM_SELF)
    assert {*np.isfinite(found.critical_load).sum("point").values.ravel()} == {2, 3, 4}
    assert_closed_form(found)
    assert len(traced) <= 8


def test_errors_of_a_family_are_bounds(folder: Path) -> None:
    """Of rods that were traced and of those that were continued."""
    found = family(hemitropic_cases.scene(), {"A": np.linspace(-3.0, -2.6, 4), "C": [1.0]}, folder)
    for rod in (found.isel(A=i, C=0) for i in range(4)):
        exact = closed_form_hemitropic.loads(float(rod.A), 1.0, 1.0, 3.0)
        assert (abs(rod.critical_load.values[:2] - exact) <= rod.error.values[:2] + 1e-14).all()


@pytest.mark.long
def test_a_thousand_rods_in_a_minute(folder: Path) -> None:
    """On one core, with the closed form of each."""
    over, begun = {"A": np.linspace(-3.0, 0.0, 40), "C": np.linspace(0.8, 1.2, 25)}, process_time()
    found = family(hemitropic_cases.scene(), over, folder, Plan(depth=0, error_bars=False), comm=MPI.COMM_SELF)
    assert process_time() - begun < 60.0
    assert_closed_form(found.isel(A=slice(None, None, 3), C=slice(None, None, 4)))

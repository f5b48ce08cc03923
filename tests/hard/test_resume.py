"""Runs that are interrupted at any moment and go on: their diagrams are those of runs that were not."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import demo_cases
import hemitropic_cases
import numpy as np
import pytest
from classics import column
from hard.folders import HOME, alike, check_states, contents
from mpi4py import MPI

import rodfem
import rodfem.app.run
from rodfem import clamped, free
from rodfem.app.run_terminal import Terminal
from rodfem.codim2 import follow
from rodfem.continuation.branch import Branch
from rodfem.diagram.bookkeeper import Bookkeeper, Recalled
from rodfem.diagram.journal import Journal
from rodfem.diagram.record import CLASSES, Record
from rodfem.errors import InputError
from rodfem.output.checkpoint import path_of
from rodfem.problem.scene import Scene

COMM = MPI.COMM_WORLD
MESH = rodfem.Discretization("auto", 6, 6)
CLOSE = 1e-8
"""Difference of two diagrams that were computed by different numbers of ranks."""


def cord(span: tuple[float, float] = (60.0, 20.0)) -> Scene:
    """The telephone cord."""
    return demo_cases.scene("cord", span=span)


def beck() -> Scene:
    """A rod under a follower force, with frequencies."""
    return demo_cases.scene("follower", span=(0.0, 22.0))


def crooked() -> Scene:
    """A cantilever under its thrust and a small force across: its branch point is a gap."""
    return column("crooked", (clamped(), free(lambda c: (0.0, 1e-6, -c.P))), (0.0, 4.0))


CASES: dict[str, tuple[Callable[[], Scene], rodfem.Plan]] = {
    "hemitropic": (hemitropic_cases.scene, rodfem.Plan((0.0, 0.3), error_bars=False)),
    "search": (cord, rodfem.Plan((60.0, 30.0), at=(40.0,), tries=3, error_bars=False)),
    "accuracy": (cord, rodfem.Plan((60.0, 40.0), accuracy=1e-5)),
    "family": (lambda: demo_cases.scene("cord", turns=1, span=(30.0, 0.0)), rodfem.Plan((30.0, 0.0), error_bars=False)),
    "crooked": (crooked, rodfem.Plan((0.0, 4.0), error_bars=False)),
    "sweep": (beck, rodfem.Plan((0.0, 22.0), error_bars=False)),
}


class Struck(KeyboardInterrupt):
    """An interrupt at a chosen moment."""


def interrupted_at(monkeypatch: pytest.MonkeyPatch, moment: int) -> None:
    """Interrupt the run at that one of all points and special points; -1: never."""
    left = [moment]

    def strike(self: Terminal, *what: object) -> None:
        left[0] -= 1
        if left[0] == -1:
            raise Struck

    for event in ("progress", "special"):
        monkeypatch.setattr(Terminal, event, strike)


def run_of(scene: Scene, plan: rodfem.Plan, folder: Path, comm: MPI.Comm = COMM) -> rodfem.Diagram:
    """Run without pictures or words."""
    return rodfem.run(scene, MESH, plan, folder, figures=False, quiet=True, comm=comm)


RECALLED = ("family", "crooked")
"""Cases all of whose steps are recalled, and compared, in another test that is not long."""


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(x, marks=[pytest.mark.alone] * (x != "hemitropic") + [pytest.mark.long] * (x in RECALLED))
        for x in CASES
    ],
)
@pytest.mark.usefixtures("few_loads")
def test_interrupted_at_any_moment(folder: Path, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twice, at random moments: in the middle third of the points, and in the first quarter after that."""
    scene, plan = CASES[name][0](), CASES[name][1]
    whole = run_of(scene, plan, folder / "whole")
    assert not list((folder / "whole").glob("resume-*"))
    points = sum(len(branch.points) for branch in whole)
    moments = np.random.default_rng(len(name)).integers([points // 3, 1], [2 * points // 3, points // 4])
    for i, moment in enumerate(moments.tolist()):
        with monkeypatch.context() as patch:
            interrupted_at(patch, moment)
            with pytest.raises(Struck):
                go_on = rodfem.resume if i else lambda *a, **k: run_of(scene, plan, a[0])
                go_on(folder / "cut", scene, MESH, plan, figures=False, quiet=True)
    found = rodfem.resume(folder / "cut", scene, MESH, plan, figures=False, quiet=True)
    assert contents(folder / "cut") == contents(folder / "whole")
    check_states(folder / "cut", folder / "whole")
    assert (found.warnings, found.notes) == (whole.warnings, whole.notes)
    assert {file.name for file in (folder / "cut").iterdir()} == {"diagram.json", "states.h5"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a run on one rank, with all of its steps."""
    folder, alone = Path(COMM.bcast(str(tmp_path_factory.mktemp("steps") / "whole"))), COMM.Split(COMM.rank)
    if COMM.rank == 0:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rodfem.app.run, "remove_steps", lambda folder: None)
            found = run_of(CASES["hemitropic"][0](), CASES["hemitropic"][1], folder, alone)
        assert len(list(folder.glob("resume-*"))) == len(found)
    COMM.barrier()
    alone.Free()
    return folder


@pytest.mark.few(1)
@pytest.mark.versions
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_every_step_is_recalled(folder: Path, whole: Path, steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """After each step, and on another number of ranks."""
    monkeypatch.setattr(rodfem.app.run, "remove_steps", lambda folder: None)
    if COMM.rank == 0:
        shutil.copytree(whole, folder / "cut")
        path_of(folder / "cut", steps + 1).unlink(missing_ok=True)
    COMM.barrier()
    rodfem.resume(folder / "cut", CASES["hemitropic"][0](), figures=False, quiet=True)
    assert alike(contents(folder / "cut"), contents(whole), 0.0 if COMM.size == 1 else CLOSE)


@pytest.mark.alone
def test_loci_are_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted after the first; that is read, and the others are followed."""
    scene = cord((60.0, 5.0))
    plan = rodfem.Plan((60.0, 5.0), depth=0, error_bars=False, locus=("k0", 9.0, 9.8))
    run_of(scene, plan, folder / "whole")
    followed: list[str] = []
    really = follow.locus

    def counted(*arguments: Any) -> rodfem.Locus:
        if len(followed) == 1 and not (folder / "again").exists():
            raise Struck
        followed.append("locus")
        return really(*arguments)

    monkeypatch.setattr(follow, "locus", counted)
    with pytest.raises(Struck):
        run_of(scene, plan, folder / "cut")
    assert not contents(folder / "cut")["complete"]
    COMM.barrier()
    (folder / "again").mkdir(exist_ok=True)
    rodfem.resume(folder / "cut", scene, MESH, plan, figures=False, quiet=True)
    files = sorted(file.name for file in (folder / "whole").glob("locus-*.json"))
    assert len(files) > 1
    assert len(followed) == len(files)
    for name in files:
        assert json.loads((folder / "cut" / name).read_text()) == json.loads((folder / "whole" / name).read_text())
    assert contents(folder / "cut") == contents(folder / "whole")


@pytest.mark.alone
def test_classes_of_all_that_is_recorded() -> None:
    """A class that a field of a recorded one has is one of them; a cluster belongs to a sweep, which begins anew."""
    plain = {"int", "float", "bool", "str", "list", "tuple", "None", "PETSc", "Vec", "np", "ndarray"}
    others = plain | {"Kind", "Event", "Cluster"}
    for kind in CLASSES.values():
        named = {name for field in fields(kind) for name in re.findall(r"\w+", str(field.type))}
        assert named <= {*CLASSES, *others}, kind


# --- what is refused, and what there is nothing to do for -----------------------------------------------------------


@pytest.fixture
def cut(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of a run that was interrupted on its second branch."""
    with monkeypatch.context() as patch:
        patch.setattr(rodfem.app.run, "remove_steps", lambda folder: None)
        run_of(hemitropic_cases.scene(), rodfem.Plan((0.0, 0.2), error_bars=False, depth=1), folder / "cut")
    if COMM.rank == 0:
        path_of(folder / "cut", 2).unlink()
    COMM.barrier()
    return folder / "cut"


@pytest.mark.long
def test_another_run_is_refused(cut: Path) -> None:
    """By the first entry that differs; equations are compared where all numbers agree.  Nothing is written."""
    scene, plan = hemitropic_cases.scene(), rodfem.Plan((0.0, 0.2), error_bars=False, depth=1)
    before = {file.name: file.read_bytes() for file in cut.iterdir()}
    COMM.barrier()
    others = {name: replace(p, value=p.value + (name != scene.load)) for name, p in scene.parameters.items()}
    other = replace(scene, parameters=others)
    stiffer = replace(scene, energy=lambda v, k, c: 1.0001 * scene.energy(v, k, c))
    refused: list[tuple[str, Callable[[], Any]]] = [
        (r"was run with name = 'hemitropic', not 'beck'", lambda: rodfem.resume(cut, replace(scene, name="beck"))),
        (r"was run with depth = 1, not 2", lambda: rodfem.resume(cut, scene, None, replace(plan, depth=2))),
        (r"was run with elements = 6, not 7", lambda: rodfem.resume(cut, scene, replace(MESH, elements=7), plan)),
        (
            r"was run with \w+ = [-\d.]+, not [-\d.]+: give",
            lambda: rodfem.resume(cut, other),
        ),
        (r"was run with other equations than those of the scene", lambda: rodfem.resume(cut, stiffer, quiet=True)),
    ]
    for sentence, resume in refused:
        with pytest.raises(InputError, match=sentence):
            resume()
    COMM.barrier()
    assert {file.name: file.read_bytes() for file in cut.iterdir()} == before


def test_a_damaged_step(cut: Path) -> None:
    scene, step = hemitropic_cases.scene(), path_of(cut, 1)
    whole = step.read_bytes()
    for damaged, sentence in (
        (whole[: len(whole) // 2], r"resume-1.h5 is no rodfem step .*: remove it, or run the scene anew"),
        (whole.replace(b"rodfem 0", b"rodfem 9"), r"resume-1.h5 was written by rodfem 9\.1\.0, not rodfem 0\.1\.0"),
    ):
        COMM.barrier()
        if COMM.rank == 0:
            step.write_bytes(damaged)
        COMM.barrier()
        with pytest.raises(InputError, match=sentence):
            rodfem.resume(cut, scene, figures=False, quiet=True)


@pytest.mark.long
@pytest.mark.alone
def test_nothing_to_do(folder: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder: the run begins.  A complete one: it says so.  One of an older version: it is refused."""
    scene, plan = hemitropic_cases.scene(), rodfem.Plan((0.0, 0.1), error_bars=False, depth=0)
    first = rodfem.resume(folder / "new", scene, MESH, plan, figures=False, quiet=True)
    before = (folder / "new" / "diagram.json").read_bytes()
    monkeypatch.setattr("rodfem.app.resume.carry_out", lambda *a: pytest.fail("computed"))
    capfd.readouterr()
    again = rodfem.resume(folder / "new", scene, figures=False)
    assert [branch.name for branch in again] == [branch.name for branch in first]
    assert ("is complete (1 branch): nothing is left to compute" in capfd.readouterr().out) == (COMM.rank == 0)
    assert (folder / "new" / "diagram.json").read_bytes() == before
    stiffer = replace(scene, energy=lambda v, k, c: 1.0001 * scene.energy(v, k, c))
    with pytest.raises(InputError, match="was run with other equations"):
        rodfem.resume(folder / "new", stiffer, figures=False, quiet=True)
    COMM.barrier()
    if COMM.rank == 0:
        data = json.loads(before)
        del data["asked"]
        (folder / "new" / "diagram.json").write_text(json.dumps(data))
    COMM.barrier()
    with pytest.raises(InputError, match=r"diagram.json does not tell what was asked for, .*: run the scene anew"):
        rodfem.resume(folder / "new", scene, figures=False, quiet=True)


@pytest.mark.long
@pytest.mark.alone
def test_same_input_same_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Byte for byte, but for times, their date among them, and the name of the run."""
    monkeypatch.setattr("rodfem.app.run_terminal.uuid4", lambda: type("name", (), {"hex": "one"}))
    for name in ("first", "second"):
        run_of(*(x() if callable(x) else x for x in CASES["hemitropic"]), folder / name)  # type: ignore[arg-type]
    first, second = (json.loads((folder / name / "diagram.json").read_text()) for name in ("first", "second"))
    times = {"timing": {}, "origin": {}}
    assert json.dumps(first | times) == json.dumps(second | times)
    assert (folder / "first" / "states.h5").read_bytes() == (folder / "second" / "states.h5").read_bytes()


@pytest.mark.alone
def test_a_program_that_is_killed(folder: Path) -> None:
    """By SIGKILL on its second branch; the same command with --resume ends with the same diagram."""
    command = [sys.executable, "demos/hemitropic.py", "--no-figures", "--depth", "1", "--range", "0", "0.3", "--output"]
    subprocess.run([*command, str(folder / "whole")], cwd=HOME, check=True, capture_output=True)
    with subprocess.Popen([*command, str(folder / "cut")], cwd=HOME, stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert any("branch 1 from" in line for line in program.stdout)
        os.kill(program.pid, signal.SIGKILL)
    assert [branch["name"] for branch in contents(folder / "cut")["branches"]] == ["straight"]
    ended = subprocess.run([*command, str(folder / "cut"), "--resume"], cwd=HOME, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert f"goes on in {folder / 'cut'}/ after 1 branch\n" in ended.stdout
    assert contents(folder / "cut") == contents(folder / "whole")
    refused = subprocess.run(
        [*command[:-2], "0.25", "--output", str(folder / "cut"), "--resume"], cwd=HOME, capture_output=True, text=True
    )
    assert refused.returncode == 2
    assert "was run with span = [0.0, 0.3], not [0.0, 0.25]: give what was run" in refused.stderr


@pytest.mark.alone
def test_steps_come_in_their_order() -> None:
    """A step that is a later one of the run that was interrupted is of another run; one that is none is new."""
    journal = Journal([Record({"name": name}, []) for name in ("straight", "branch 1", "branch 2")])
    first = journal.next("straight")
    assert first is not None and first.text["name"] == "straight"
    with pytest.raises(InputError, match="came to 'branch 1' where this one comes to 'branch 2'"):
        journal.next("branch 2")
    assert journal.next("found 1") is None


@pytest.mark.few(1)
@pytest.mark.alone
@pytest.mark.parametrize("name", ["hemitropic", "accuracy", "family", "crooked"])
def test_a_step_that_is_recalled_leaves_what_it_left(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Meshes, bands, gaps, branch points that were met: a record of it after its recall is the record that was kept."""
    scene, plan = CASES[name][0](), CASES[name][1]
    kept, again, record, recall = list[Record](), list[Record](), Bookkeeper._record, Bookkeeper.recall

    def keeping(self: Bookkeeper, *what: Any) -> Record:
        kept.append(record(self, *what))
        return kept[-1]

    def recalling(self: Bookkeeper, name: str) -> Recalled | None:
        if self.journal.done < len(self.journal.known):  # whatever a solver has in it when a step is recalled
            for solver in self.meshes.solvers:
                solver.inertia.resolution, solver.inertia.tolerance, solver.system.damping = 0.1, 0.2, 0.3
                solver.system.verification.dropped, solver.system.verification.norm = {99}, 0.4
            for special in (s for branch in self.branches for s in branch.special):
                special.switched = not special.switched
        found = recall(self, name)
        if found is not None:
            before = self.branches
            self.branches = [*before, found.found] if isinstance(found.found, Branch) else before
            again.append(record(self, name, found.found, found.left))
            self.branches = before
        return found

    monkeypatch.setattr(rodfem.app.run, "remove_steps", lambda folder: None)
    with monkeypatch.context() as patch:
        patch.setattr(Bookkeeper, "_record", keeping)
        run_of(scene, plan, folder)
    monkeypatch.setattr(Bookkeeper, "recall", recalling)
    rodfem.resume(folder, scene, MESH, plan, figures=False, quiet=True)
    assert len(kept) == len(again) > 1
    for one, other in zip(kept, again, strict=True):
        for key in ("found", "left", "meshes", "memory", "gaps", "switched"):
            assert json.dumps(one.text[key]) == json.dumps(other.text[key]), key  # nan is nan there
        for a, b in zip(one.vectors, other.vectors, strict=False):  # those of richer meshes, which come last, not yet
            np.testing.assert_array_equal(a, b)
    assert name != "crooked" or kept[-1].text["gaps"]

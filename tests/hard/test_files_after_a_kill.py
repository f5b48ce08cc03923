"""Files of a folder in which a run was killed at any moment, or the disk was full, or another run goes on."""

import json
import os
import resource
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import h5py
import pytest
from hemitropic_cases import scene
from mpi4py import MPI

import rodfem
from rodfem import Diagram, InputError, load_json
from rodfem.app.run import Terminal, run
from rodfem.output.states import check_run
from rodfem.whole_files import DRAFTS, LOCK, locked

COMM = MPI.COMM_WORLD
MESH, PLAN = rodfem.Discretization("reduced", 4, 6), rodfem.Plan((0.0, 0.2), error_bars=False, depth=1)
FILE_EVENTS = {"open", "os.rename", "os.remove", "os.truncate"}
KILLED = -signal.SIGKILL


@pytest.fixture(scope="module")
def diagrams() -> tuple[Diagram, Diagram]:
    """An earlier run and a later one."""
    earlier = rodfem.trace(scene(), MESH, PLAN)
    return earlier, rodfem.trace(scene(), MESH, replace(PLAN, span=(0.0, 0.25)))


def in_copy(work: Callable[[int], None], killed_before: int | None = None) -> tuple[int, bytes]:
    """Work in a copy of this process, killed before its n-th event of a file; how it ends, and what it wrote."""
    ours, its = os.pipe()
    copy = os.fork()
    if copy == 0:
        status, count = 1, 0

        def strike(event: str, arguments: object) -> None:
            nonlocal count
            if event in FILE_EVENTS:
                if count == killed_before:
                    os.kill(os.getpid(), signal.SIGKILL)
                count += 1

        try:
            sys.addaudithook(strike)
            work(its)
            status = 0
        finally:
            os._exit(status)
    os.close(its)
    with os.fdopen(ours, "rb") as pipe:
        wrote = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1]), wrote


def saved_by(diagram: Diagram, folder: Path, its: int) -> None:
    """Save branch after branch, as a run does, and tell each that is finished."""
    with locked(folder, COMM):
        terminal = Terminal(diagram.plan, folder, COMM, str, quiet=True, verbose=False)
        for n in range(1, len(diagram) + 1):
            part = Diagram(diagram.scene, diagram.plan, diagram.branches[:n], diagram.solvers)
            part.run, part.asked = diagram.run, diagram.asked
            terminal.complete(part)
            os.write(its, b".")


def test_a_kill_at_any_moment(folder: Path, diagrams: tuple[Diagram, Diagram]) -> None:
    """Files are those of one run, all that was finished is there, and the next run finds no drafts."""
    earlier, later = diagrams
    earlier.save(folder / "earlier")
    named = load_json(folder / "earlier" / "diagram.json") | {"files": ["diagram.png", "notes.txt", "../x.png"]}
    (folder / "earlier" / "diagram.json").write_text(json.dumps(named))
    own = ("notes.txt", "modes-mine.png", "locus-1.json", ".mine.part.tex", "report.html")
    for name in ("diagram.png", *own):
        (folder / "earlier" / name).write_bytes(b"an earlier picture, or a file of a person")
    status, moment, states, between = KILLED, 0, set(), 0
    while status == KILLED:
        here = folder / "killed"
        shutil.rmtree(here, ignore_errors=True)
        shutil.copytree(folder / "earlier", here)
        status, finished = in_copy(lambda its, here=here: saved_by(later, here, its), moment)
        moment += 1
        data = load_json(here / "diagram.json")
        assert len(data["branches"]) >= len(finished)
        try:
            check_run(data, here / "states.h5")
        except InputError:  # between the two steps that follow one another at once
            between += 1
            continue
        assert data["run"] == (later.run if finished else data["run"])
        assert (here / "diagram.png").exists() <= (data["run"] == earlier.run)
        assert all((here / name).exists() for name in own)
        with h5py.File(here / "states.h5") as file:
            for branch in data["branches"]:
                assert file[f"branches/{branch['name']}/load"][:].tolist() == branch["columns"]["load"]
            if data["run"] == earlier.run:
                assert len(file["branches"]) == len(earlier)
        states.add((data["run"] == later.run, len(data["branches"])))
        with locked(here, COMM):
            assert not list(here.glob(DRAFTS))
    assert status == 0
    assert states == {(False, len(earlier)), *((True, n + 1) for n in range(len(later)))}
    assert between == 1
    assert len(rodfem.load(here, later.scene).branches) == len(later)
    assert not list(here.glob(LOCK))


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """A disk on which no file can be larger."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.ranks
@pytest.mark.versions
@pytest.mark.short
def test_a_full_disk(folder: Path, diagrams: tuple[Diagram, Diagram]) -> None:
    """One sentence on every rank; what was saved stays, and nothing is left over."""
    earlier, later = diagrams
    run(later.scene, MESH, later.plan, folder.with_name("whole"), figures=False, quiet=True)  # compiles what it needs
    earlier.save(folder)
    COMM.barrier()  # the first rank removes its lock last
    room = (folder / "states.h5").stat().st_size // 2  # less than a file of states needs; a compiled form has it
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    COMM.barrier()
    with (
        files_of_at_most(room),
        pytest.raises(
            InputError, match=r"^The output folder \S+ cannot be written \(File too large\): choose [^()]+\S+$"
        ),
    ):
        later.save(folder)
    with (
        files_of_at_most(room),
        pytest.raises(InputError, match=r"cannot be written \(File too large\)") as trouble,
    ):
        run(later.scene, MESH, later.plan, folder, figures=False, quiet=True)
    assert [branch.name for branch in trouble.value.diagram] == ["straight"]
    COMM.barrier()
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.ranks
def test_files_of_two_runs(folder: Path, diagrams: tuple[Diagram, Diagram]) -> None:
    for diagram in diagrams:
        diagram.save(folder / diagram.scene.name)
        if COMM.rank == 0 and diagram is diagrams[0]:
            shutil.copy(folder / diagram.scene.name / "states.h5", folder / "states.h5")
    if COMM.rank == 0:
        os.replace(folder / "states.h5", folder / diagrams[1].scene.name / "states.h5")
    COMM.barrier()
    with pytest.raises(InputError, match=r"states.h5 and the diagram.json next to it are of different runs: keep"):
        rodfem.load(folder / diagrams[1].scene.name, diagrams[1].scene)


@pytest.mark.long
def test_same_input_same_files(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Byte for byte, but for times, their date among them, and the name of the run."""
    monkeypatch.setattr("rodfem.diagram.diagram.uuid4", lambda: type("name", (), {"hex": "one"}))
    for name in ("first", "second"):
        run(scene(), rodfem.Discretization("auto", 6, 6), rodfem.Plan((0.0, 0.3), error_bars=False), folder / name,
            figures=False, quiet=True)  # fmt: skip
    first, second = (json.loads((folder / name / "diagram.json").read_text()) for name in ("first", "second"))
    times = {"timing": {}, "origin": {}}
    assert json.dumps(first | times) == json.dumps(second | times)
    assert (folder / "first" / "states.h5").read_bytes() == (folder / "second" / "states.h5").read_bytes()


@pytest.mark.ranks
@pytest.mark.short
def test_a_second_run_in_a_folder(folder: Path, diagrams: tuple[Diagram, Diagram]) -> None:
    """It is refused on every rank while the first one lives, and goes on when that was killed."""
    holder = 0
    if COMM.rank == 0:
        holder = os.fork()
        if holder == 0:
            with locked(folder, MPI.COMM_SELF):
                time.sleep(100)
            os._exit(0)
        while not (folder / LOCK).exists() or not (folder / LOCK).read_text():
            time.sleep(0.01)
    holder = COMM.bcast(holder)
    for refused in (
        lambda: run(diagrams[0].scene, MESH, PLAN, folder, figures=False, quiet=True),
        lambda: rodfem.many([diagrams[0].scene], lambda scene: {}, folder),
        lambda: diagrams[0].save(folder),
    ):
        with pytest.raises(InputError, match=rf"^The output folder \S+ is in use by process {holder} on"):
            refused()
    if COMM.rank == 0:
        os.kill(holder, signal.SIGKILL)
        os.waitpid(holder, 0)
    COMM.barrier()
    diagrams[0].save(folder)
    assert {file.name for file in folder.iterdir()} >= {"diagram.json", "states.h5"}

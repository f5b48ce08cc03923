"""Programs that are interrupted, or one of their ranks: a sentence, a status, nothing left running or half written."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import h5py
import pytest

from rodfem.app.interrupts import KEPT, held

HOME = Path(__file__).parents[2]
MPIRUN = ("/usr/bin/mpirun.openmpi", "--oversubscribe", "-n", "2")
HEMITROPIC = ("demos/hemitropic.py", "--no-figures", "--output")
MAP = ("demos/map.py", "--couplings", "200", "--output")
OF_MPI = ("OMPI_", "PMI")
GIVEN = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_btl", "OMPI_MCA_mpi_yield_when_idle")
"""Variables that make a process part of these tests' own job, and those that people set."""
LIMIT = 30
SECOND_BRANCH, ROD = "branch 1 from", "rods"
pytestmark = pytest.mark.alone


@dataclass
class Ended:
    """A program that has ended, and its ranks that have not."""

    status: int
    errors: str
    left: list[int]


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def struck(command: tuple[str, ...], ranks: int, line: str, whom: str, number: int) -> Ended:
    """Run a program, and send a signal to ``whom`` as soon as it has printed ``line``."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(OF_MPI) or name in GIVEN}
    whole = [*(MPIRUN if ranks > 1 else ()), sys.executable, *command]
    with subprocess.Popen(
        whole, cwd=HOME, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        assert any(line in printed for printed in program.stdout), program.stderr and program.stderr.read()
        children = Path(f"/proc/{program.pid}/task/{program.pid}/children").read_text().split()
        processes = [int(child) for child in children] if ranks > 1 else [program.pid]
        target = {"first": processes[:1], "last": processes[-1:], "all": processes, "mpirun": [program.pid]}[whom]
        for process in target:
            os.kill(process, number)
        try:
            _, errors = program.communicate(timeout=LIMIT)
        finally:
            time.sleep(0.2)
            left = [process for process in processes if alive(process)]
            for process in {*left, program.pid} if left else ():
                os.kill(process, signal.SIGKILL)
    return Ended(program.returncode, errors, left)


def branches_in(folder: Path) -> list[str]:
    """Branches that both files of a folder have, which holds nothing else but the steps of a run that goes on."""
    rest = {file.name for file in folder.iterdir() if not file.match("resume-*.h5")}
    assert rest - {".lock"} == {"diagram.json", "states.h5"}
    data = json.loads((folder / "diagram.json").read_text())
    with h5py.File(folder / "states.h5") as file:
        assert file.attrs["run"] == data["run"]
        for branch in data["branches"]:
            assert file[f"branches/{branch['name']}/load"][:].tolist() == branch["columns"]["load"]
    return [branch["name"] for branch in data["branches"]]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_process(folder: Path, number: int) -> None:
    ended = struck((*HEMITROPIC, str(folder)), 1, SECOND_BRANCH, "first", number)
    assert ended.status == 130
    assert ended.errors == f"\ninterrupted; the branches that were finished are in {folder}: --resume goes on there\n"
    assert branches_in(folder)[0] == "straight"
    assert not (folder / ".lock").exists()


@pytest.mark.parametrize(
    ("whom", "number", "status"),
    [
        ("last", signal.SIGINT, 130),
        ("all", signal.SIGINT, 130),
        ("mpirun", signal.SIGINT, 1),  # its own status
        ("mpirun", signal.SIGKILL, -signal.SIGKILL),
    ],
)
def test_two_ranks(folder: Path, whom: str, number: int, status: int) -> None:
    ended = struck((*HEMITROPIC, str(folder)), 2, SECOND_BRANCH, whom, number)
    assert ended.left == []
    assert ended.status == status
    assert ended.errors.count("interrupted; the branches that were finished are in") == (number != signal.SIGKILL)
    assert branches_in(folder)[0] == "straight"


@pytest.mark.parametrize(("ranks", "whom"), [(1, "first"), (2, "last")])
def test_many_rods(folder: Path, ranks: int, whom: str) -> None:
    ended = struck((*MAP, str(folder)), ranks, ROD, whom, signal.SIGINT)
    assert (ended.left, ended.status, ended.errors.count(KEPT)) == ([], 130, 1)
    files = [file for file in folder.iterdir() if file.name != ".lock"]
    assert files and all("stable" in json.loads(file.read_text())["result"] for file in files)


ALONE = """
import sys
from mpi4py import MPI
sys.path.insert(0, "tests")
from hemitropic_cases import scene
import rodfem

class Failing(rodfem.Observer):
    def special(self, branch, special):
        print("found", flush=True)
        if MPI.COMM_WORLD.rank == 1:
            raise ValueError("a mistake of one rank")

rodfem.trace(scene(), rodfem.Discretization("reduced", 16, 6), observer=Failing())
"""


def test_a_rank_that_fails_alone() -> None:
    """It ends the other one, which would wait for it for ever."""
    ended = struck(("-c", ALONE), 2, "found", "mpirun", 0)
    assert (ended.left, ended.status) == ([], 1)
    assert "ValueError: a mistake of one rank" in ended.errors


def test_interrupts_wait_while_files_are_saved() -> None:
    done: list[str] = []
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(KeyboardInterrupt), held():
        signal.raise_signal(signal.SIGINT)
        done.append("saved")
    assert done == ["saved"]
    assert signal.getsignal(signal.SIGTERM) is before

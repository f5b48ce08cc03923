"""Programs that are interrupted, or one of their ranks: a sentence, a status, nothing left running or half written."""

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

from rodfem.ranks import KEPT

HOME = Path(__file__).parents[2]
MPIRUN = ("/usr/bin/mpirun.openmpi", "--oversubscribe", "-n", "2")
OF_MPI = ("OMPI_", "PMI")
GIVEN = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_btl", "OMPI_MCA_mpi_yield_when_idle")
"""Variables that make a process part of these tests' own job, and those that people set."""
HEMITROPIC = ("demos/hemitropic.py", "--no-figures", "--verbose", "--output")
MAP = ("demos/map.py", "--couplings", "200", "--output")
LIMIT = 30
SECOND_BRANCH, ROD = "branch 1 from", "rods"


def surroundings() -> dict[str, str]:
    """Environment of a program that is no part of these tests' own job."""
    return {name: value for name, value in os.environ.items() if not name.startswith(OF_MPI) or name in GIVEN}


def children_of(process: int) -> list[int]:
    return [int(child) for child in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def alive(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False


def branches_in(folder: Path) -> list[str]:
    """Branches that both files of a folder have, which holds nothing else."""
    rest = {file.name for file in folder.iterdir()}
    assert rest - {".lock"} == {"diagram.json", "states.h5"}, rest
    data = json.loads((folder / "diagram.json").read_text())
    with h5py.File(folder / "states.h5") as file:
        assert file.attrs["run"] == data["run"]
        for branch in data["branches"]:
            assert file[f"branches/{branch['name']}/load"][:].tolist() == branch["columns"]["load"]
    return [branch["name"] for branch in data["branches"]]


@dataclass
class Ended:
    """A program that has ended, and its ranks that have not."""

    status: int
    errors: str
    left: list[int]


def struck(command: tuple[str, ...], ranks: int, line: str, whom: str, number: int) -> Ended:
    """Run a program, and send a signal to ``whom`` as soon as it has printed ``line``."""
    whole = [*(MPIRUN if ranks > 1 else ()), sys.executable, *command]
    with subprocess.Popen(
        whole, cwd=HOME, env=surroundings(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as program:
        assert program.stdout is not None
        assert any(line in printed for printed in program.stdout), program.stderr and program.stderr.read()
        processes = children_of(program.pid) if ranks > 1 else [program.pid]
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


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_one_process(folder: Path, number: int) -> None:
    ended = struck((*HEMITROPIC, str(folder)), 1, SECOND_BRANCH, "first", number)
    assert ended.status == 130
    assert ended.errors == f"\ninterrupted; the branches that were finished are in {folder}\n"
    assert branches_in(folder)[0] == "straight"
    assert not (folder / ".lock").exists()


@pytest.mark.long
@pytest.mark.parametrize(
    ("whom", "number", "status"),
    [
        ("all", signal.SIGINT, 130),
        ("mpirun", signal.SIGINT, 1),  # its own status
        ("mpirun", signal.SIGKILL, -signal.SIGKILL),
    ],
)
def test_two_ranks(folder: Path, whom: str, number: int, status: int) -> None:
    fine = ("--elements", "80") if whom == "mpirun" else ()  # its ranks hear of it a second later, still at work
    ended = struck((*HEMITROPIC, str(folder), *fine), 2, SECOND_BRANCH, whom, number)
    assert ended.left == []
    assert ended.status == status
    assert ended.errors.count("interrupted; the branches that were finished are in") == (number != signal.SIGKILL)
    assert branches_in(folder)[0] == "straight"


@pytest.mark.long
@pytest.mark.parametrize(("ranks", "whom"), [(1, "first"), (2, "all")])
def test_many_rods(folder: Path, ranks: int, whom: str) -> None:
    ended = struck((*MAP, str(folder)), ranks, ROD, whom, signal.SIGINT)
    assert (ended.left, ended.status, ended.errors.count(KEPT)) == ([], 130, 1)
    files = [file for file in folder.iterdir() if file.name != ".lock"]
    assert files and all("points" in json.loads(file.read_text())["result"] for file in files)


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

"""What runs leave in their folders; programs that are interrupted."""

import json
import os
from pathlib import Path

import h5py

HOME = Path(__file__).parents[2]
MPIRUN = ("/usr/bin/mpirun.openmpi", "--oversubscribe", "-n", "2")
OF_MPI = ("OMPI_", "PMI")
GIVEN = ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_btl", "OMPI_MCA_mpi_yield_when_idle")
"""Variables that make a process part of these tests' own job, and those that people set."""


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

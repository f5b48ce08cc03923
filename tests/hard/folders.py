"""What runs leave in their folders, and whether two of them left the same; programs that are killed."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

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


def branches_in(folder: Path, drafts: bool = False) -> list[str]:
    """Branches that both files of a folder have, which holds nothing else but, after a kill, ``drafts`` of files."""
    rest = {file.name for file in folder.iterdir()}
    rest -= {name for name in rest if drafts and ".part." in name}
    assert rest - {".lock"} == {"diagram.json", "states.h5"}, rest
    data = json.loads((folder / "diagram.json").read_text())
    with h5py.File(folder / "states.h5") as file:
        assert file.attrs["run"] == data["run"]
        for branch in data["branches"]:
            assert file[f"branches/{branch['name']}/load"][:].tolist() == branch["columns"]["load"]
    return [branch["name"] for branch in data["branches"]]


def contents(folder: Path) -> dict[str, Any]:
    """Diagram of a run, but for times, origin and the name of the run."""
    data: dict[str, Any] = json.loads((folder / "diagram.json").read_text())
    return {name: value for name, value in data.items() if name not in ("timing", "origin", "run")}


def alike(a: Any, b: Any, close: float) -> bool:
    """Whether two diagrams are the same but for numbers that are ``close``."""
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(alike(a[name], b[name], close) for name in a)
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(alike(p, q, close) for p, q in zip(a, b, strict=True))
    if isinstance(a, float) and isinstance(b, float):
        return abs(a - b) <= close * max(1.0, abs(a))
    return bool(a == b)

"""What all benchmarks share: the machine they run on, processes of their own for what they measure, tables."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
MPIRUN = "/usr/bin/mpirun.openmpi"
MPI_SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_btl": "self,vader",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "HWLOC_HIDE_ERRORS": "2",
    "UCX_LOG_LEVEL": "fatal",
}


def machine() -> str:
    """Name of the processor and number of cores, memory, system."""
    names = [
        line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines() if "model name" in line
    ]
    processor = f"{names[0]}, {len(names)} cores" if names else platform.processor()
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{processor}, {memory:.0f} GB, {platform.system()} {platform.release()}"


def versions(*names: str) -> str:
    """Versions of Python and of the packages named, which are PETSc's own where it has them."""
    found = [f"Python {platform.python_version()}"]
    for name in names:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} (no version)")
    return ", ".join(found)


def load() -> float:
    """Processes that wanted a core in the last minute."""
    return os.getloadavg()[0]


def environment(**more: str) -> dict[str, str]:
    """Clean environment for a process: one thread, no display, nothing of an MPI run around it."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("OMPI_", "PMIX_", "PMI_", "PRTE_"))}
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return kept | MPI_SETTINGS | {"OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg", "PYTHONPATH": ":".join(paths)} | more


def measured(module: str, *arguments: object, limit: float = 300.0) -> Iterator[dict[str, Any]]:
    """What a module prints as lines of JSON when it is run in a process of its own, as it comes.

    A process that fails, or takes longer than ``limit`` seconds, ends with ``{"failed": why}``.
    """
    command = ["timeout", "--foreground", "-k", "5", f"{limit:g}", sys.executable, "-m", module, *map(str, arguments)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(), cwd=ROOT
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        for line in process.stdout:
            if line.startswith("{"):
                yield json.loads(line)
        trouble = process.stderr.read()
    if process.returncode == 124:
        yield {"failed": f"stopped after {limit:g} s"}
    elif process.returncode:
        words = [line for line in trouble.splitlines() if any(letter.isalpha() for letter in line)]
        yield {"failed": (words or [f"status {process.returncode}"])[-1].strip()}


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(row) + " |" for row in [head, ["---"] * len(head), *rows]]
    return "\n".join(lines) + "\n"


def digits(value: float | None, number: int = 3) -> str:
    """So many digits of a number, nothing for None."""
    return "" if value is None else f"{float(f'{value:.{number}g}'):g}"


def milliseconds(seconds: float) -> str:
    """Three digits of a time in ms."""
    return digits(1e3 * seconds)


def exponent(sizes: Sequence[float], values: Sequence[float], least: float) -> float:
    """Slope of log value over log size from the size ``least`` on; nan where there are not two such."""
    far = [(n, v) for n, v in zip(sizes, values, strict=True) if n >= least and v > 0]
    if len(far) < 2:
        return float("nan")
    n, v = np.log(far).T
    return float(np.polyfit(n, v, 1)[0])

"""What a person waits for: the first special point on the terminal, and a map of many rods."""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

from benchmarks.common import MPIRUN, ROOT, environment

HEAVY = ("numpy", "scipy.sparse", "mpi4py.MPI", "petsc4py.PETSc", "slepc4py.SLEPc")
PROCESSES = {"hemitropic": 1.2, "cord": 1.2, "ruler": 1.2, "ring": 1.8}
"""Demos, and the seconds that are aimed at."""
IMPORTS = (*HEAVY, "rodfem.forms", "rodfem.compat", "h5py", "rodfem.app.run")
"""Modules imported one after the other to see what each adds."""


def first_point(cache: Path | None, output: Path) -> dict[str, float]:
    """Seconds from the start of the process to the first printed special point, and to its end.

    Raises :class:`subprocess.SubprocessError` where the demo fails.
    """
    command = [sys.executable, "demos/hemitropic.py", "--no-figures", "--output", str(output)]
    more = {} if cache is None else {"XDG_CACHE_HOME": str(cache)}
    started = perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=ROOT, env=environment(**more)
    ) as process:
        assert process.stdout is not None
        seconds = float("nan")
        for line in process.stdout:
            if line.lstrip().startswith("BP") and seconds != seconds:
                seconds = perf_counter() - started
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return {"first": seconds, "end": perf_counter() - started}


def imports() -> dict[str, float]:
    """Seconds that importing adds, module by module in the order of :data:`IMPORTS`; ``python`` is the start."""
    code = (
        "from time import perf_counter as t\nimport importlib\n"
        f"for name in {IMPORTS!r}:\n    a = t(); importlib.import_module(name); print(name, t() - a)\n"
    )
    started = perf_counter()
    subprocess.run([sys.executable, "-c", "pass"], check=True, env=environment(), cwd=ROOT)
    found = {"python": perf_counter() - started}
    done = subprocess.run([sys.executable, "-c", code], check=True, env=environment(), cwd=ROOT, capture_output=True)
    for line in done.stdout.decode().splitlines():
        name, seconds = line.split()
        found[name] = float(seconds)
    return found


def first_minute(runs: int) -> dict[str, Any]:
    """Cold (an empty cache of compiled forms), warm, and what the imports take; medians, but for the cold one."""
    with tempfile.TemporaryDirectory() as folder:
        cache, output = Path(folder) / "cache", Path(folder) / "output"
        cold = first_point(cache, output)
        warm = [first_point(cache, output) for _ in range(runs)]
    added = [imports() for _ in range(runs)]
    return {
        "cold": cold,
        "warm": {key: median(w[key] for w in warm) for key in cold},
        "imports": {name: median(a[name] for a in added) for name in added[0]},
        "runs": runs,
    }


def processes(runs: int) -> list[dict[str, Any]]:
    """Processor time of whole demos without figures, with warm caches; medians."""
    out = []
    with tempfile.TemporaryDirectory() as folder:
        for name, goal in PROCESSES.items():
            command = [sys.executable, f"demos/{name}.py", "--no-figures", "--output", folder]
            seconds = []
            for _ in range(runs + 1):
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                subprocess.run(command, check=True, cwd=ROOT, env=environment(), capture_output=True, timeout=600)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                seconds.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            out.append({"demo": name, "goal": goal, "seconds": median(seconds[1:])})
    return out


def map_of_rods(couplings: int, ranks: int) -> dict[str, float]:
    """Seconds of a small stability map on so many ranks, started anew and taken up again when it is finished."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "demos/map.py", "--couplings", str(couplings), "--output", folder]
        if ranks > 1:
            command = [MPIRUN, "--oversubscribe", "-n", str(ranks), *command]
        seconds = []
        for _ in range(2):
            started = perf_counter()
            subprocess.run(command, check=True, cwd=ROOT, env=environment(), capture_output=True, timeout=600)
            seconds.append(perf_counter() - started)
    return {"ranks": ranks, "couplings": couplings, "seconds": seconds[0], "again": seconds[1]}

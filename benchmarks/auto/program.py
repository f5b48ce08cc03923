"""Compiling a problem with AUTO, and running it: time, and AUTO's constants."""

from __future__ import annotations

import atexit
import math
import os
import shutil
import statistics
import subprocess
import tempfile
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from benchmarks.auto.output import AutoError
from benchmarks.auto.problems import PROBLEMS, Branch, Problem

HERE = Path(__file__).resolve().parent
AUTO = Path(os.environ.get("AUTO_LIB", "/usr/lib/auto-07p/lib"))
FLAGS = ("-O3", "-fopenmp")
LIMIT = 20
"""Seconds for one run of AUTO."""


@cache
def folder() -> Path:
    """Where programs and AUTO's files go; removed in the end."""
    path = Path(tempfile.mkdtemp(prefix="rodfem-auto-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


def require_auto() -> None:
    """Raise :class:`AutoError` that says what to install if something is missing."""
    if not (AUTO / "main.o").exists():
        raise AutoError(f"AUTO-07p was not found in {AUTO}: install Debian's package auto-07p, or set AUTO_LIB.")
    if shutil.which("gfortran") is None:
        raise AutoError("gfortran was not found: install Debian's package gfortran.")


def compiled(problem: Problem, *more: str, link: Iterable[Path]) -> Path:
    """A program from the problem's Fortran, and the objects given."""
    work = folder() / "-".join((problem.name, *more))
    work.mkdir(exist_ok=True)
    sources = [str(HERE / f"{name}.f90") for name in (*problem.sources, "unused", *more)]
    done = subprocess.run(
        ["gfortran", *FLAGS, "-w", *sources, *map(str, link), "-o", "program"], cwd=work, capture_output=True, text=True
    )
    if done.returncode:
        raise AutoError(f"gfortran could not compile {problem.name}: {done.stderr.strip()}")
    return work / "program"


@cache
def program(name: str) -> Path:
    """The problem linked with AUTO."""
    require_auto()
    return compiled(PROBLEMS[name], link=sorted(AUTO.glob("*.o")))


def check(problem: Problem) -> list[float]:
    """Largest deviations of df/du, df/dp, db/du, db/dp from central differences, relative to the matrix."""
    executable = compiled(problem, "check", link=())
    arguments = [str(executable), str(problem.ndim), str(problem.nbc), str(problem.free)]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    return [float(word) for word in done.stdout.split()]


def processor_time(executable: Path, cwd: Path) -> float:
    """Run on one core; processor time in seconds.

    That of the user and of the system together: the kernel splits them by ticks of the clock, too coarsely for runs of
    some milliseconds.  A run that loses its way on a coarse mesh is stopped by the system.
    """
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    with open(cwd / "log", "w") as log:
        command = ["sh", "-c", f"ulimit -t {LIMIT}; exec {executable}"]
        process = subprocess.Popen(command, cwd=cwd, stdout=log, stderr=log, env=environment)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode < 0:
        raise AutoError(f"AUTO was stopped by signal {-process.returncode} in {cwd.name}.")
    return usage.ru_utime + usage.ru_stime


@cache
def start_time(executable: Path) -> float:
    """Processor time of starting the process: AUTO without its constants stops at once."""
    cwd = folder() / "start"
    cwd.mkdir(exist_ok=True)
    return statistics.median(processor_time(executable, cwd) for _ in range(15))


def constants(
    problem: Problem, branch: Branch, label: int, mesh: tuple[int, int, float], dsmax: float, following: int = 0
) -> str:
    """AUTO's constants file; ``mesh`` is NTST, NCOL and the tolerance.

    With ``following`` AUTO only follows the branch, for so many points, and looks for nothing on it.
    """
    ntst, ncol, tol = mesh
    crossings = {target.at for target in branch.targets if target.at is not None}
    load = problem.icp[0]
    lines = [
        f"NDIM={problem.ndim}, IPS=4, IRS={label}, ILP={0 if following else 1}, NPAR=12",
        f"ICP={list(problem.icp)}",
        f"NTST={ntst}, NCOL={ncol}, IAD=3, ISP={0 if following else 2}, ISW={-1 if label else 1}",
        f"IPLT=0, NBC={problem.nbc}, NINT=0",
        f"NMX={following or 400}, NPR=500, MXBF=0, IID=0, ITMX=9, ITNW=7, NWTN=3, JAC=1",
        f"EPSL={tol}, EPSU={tol}, EPSS={10 * tol}",
        f"DS={math.copysign(min(abs(branch.ds), dsmax), branch.ds)}, DSMIN=1e-6, DSMAX={dsmax}, IADS=1",
    ]
    if not following:
        lines += [f"UZR={{{load}: {sorted(crossings)}}}"] if crossings else []
        lines += [f"UZSTOP={{{load}: {list(branch.stop)}}}"] if branch.stop else []
        lines += [f"SP=['{branch.until}']"] if branch.until else []
    return "\n".join(lines) + "\n"

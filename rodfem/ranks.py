"""Ranks of one job: what they do together, how they fail, and how they end, with each other and with mpirun.

A fault of a numerical library that all ranks have is a failure, as that of an iteration which does not converge; one
that a rank has alone ends all of them.  An interrupt of a program is one sentence of its first rank, and
status 130.
"""

from __future__ import annotations

import ctypes
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from math import inf
from types import TracebackType
from typing import TYPE_CHECKING, NoReturn

from rodfem.errors import INTERRUPTED, ConvergenceError, InputError

if TYPE_CHECKING:
    from mpi4py import MPI

KEPT = "interrupted; what was finished is kept"
RANK = ("PMIX_RANK", "OMPI_COMM_WORLD_RANK", "PMI_RANK")  # variables of the environment, one of which every rank has
ADDRESS = re.compile(r" at 0x\w+|(?<=\bvar)\d+|(?<=\bi_\{)\d+")  # an object's place in memory, and numbers of UFL
PATIENCE, PAUSE, SHORTEST = 30.0, 0.01, 1e-4
"""Seconds after which a rank that others do not join failed alone; between two looks for them at last, and at first."""


def on_first(comm: MPI.Comm, check: Callable[[], object]) -> None:
    """Do something on the first rank, and raise its :class:`InputError` on every rank.

    The others sleep meanwhile: waiting for a message they would keep a processor busy.
    """
    trouble: InputError | None = None
    if comm.rank == 0:
        try:
            check()
        except InputError as error:
            trouble = error
    all_come(comm, inf)
    trouble = comm.bcast(trouble)
    if trouble is not None:
        raise trouble


def agree(comm: MPI.Comm, **given: object) -> None:
    """Raise :class:`InputError` on every rank of ``comm`` where their texts of what is ``given`` differ; collective."""
    every = comm.allgather({name: ADDRESS.sub("", str(value)) for name, value in given.items()})
    if other := [name for name in given if len({texts[name] for texts in every}) > 1]:
        raise InputError(f"The ranks of this job have different input ({', '.join(other)}): give all of them the same.")


def all_come(comm: MPI.Comm, patience: float = PATIENCE) -> bool:
    """Whether all ranks come here, as they do where they raise the same error; False for one that waits in vain."""
    here, end, pause = comm.Ibarrier(), time.monotonic() + patience, SHORTEST
    while not here.Test():
        if time.monotonic() > end:
            return False
        time.sleep(pause)
        pause = min(2.0 * pause, PAUSE)
    return True


# --- faults


@contextmanager
def as_failure(comm: MPI.Comm) -> Iterator[None]:
    """Raise :class:`ConvergenceError`, with the reason, for a fault that all ranks of ``comm`` have.

    One that a rank has alone stays what it is: nobody goes on without that rank.
    """
    from numpy.linalg import LinAlgError
    from petsc4py import PETSc

    try:
        yield
    except (PETSc.Error, MemoryError, LinAlgError, ArithmeticError) as fault:
        if comm.size > 1 and not all_come(comm):
            raise
        raise ConvergenceError(in_words(fault)) from fault


@contextmanager
def guard(what: str, comm: MPI.Comm, warn: Callable[[str], None]) -> Iterator[None]:
    """Go on where the block fails, on all ranks of ``comm``, and ``warn`` of ``what`` did not happen and why."""
    try:
        with as_failure(comm):
            yield
    except ConvergenceError as trouble:
        warn(f"{what}: {trouble}")


def in_words(fault: BaseException) -> str:
    """Sentence for a fault."""
    from petsc4py import PETSc

    PETSC_ERR_MEM = 55
    if isinstance(fault, MemoryError) or (isinstance(fault, PETSc.Error) and fault.ierr == PETSC_ERR_MEM):
        return "Memory is exhausted: use fewer elements or a lower degree."
    if isinstance(fault, PETSc.Error):
        reason = str(fault).splitlines()[-1].partition("] ")  # the last line, after the number of the rank
        remedy = "use smaller steps, another discretisation, or other options of PETSc"
        return f"PETSc gave up ({reason[2] or reason[0]}): {remedy}."
    return f"Numbers allow no answer ({fault}): use smaller steps or another discretisation."


# --- the end of a job


def launched() -> bool:
    """Whether this process is a rank of a job."""
    return any(name in os.environ for name in RANK)


def end_with_launcher() -> None:
    """Have the system end this process with its parent, where that started it as a rank, and the system is Linux."""
    if sys.platform == "linux" and launched():
        PR_SET_PDEATHSIG = 1  # the signal that this process gets at the end of its parent
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def listen() -> None:
    """Interrupt this program where it is asked to end, as by Ctrl-C; to be called before anything that takes time."""
    end_with_launcher()
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    report = sys.excepthook

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        if issubclass(kind, KeyboardInterrupt):
            leave(str(error) or KEPT)
        report(kind, error, trace)

    sys.excepthook = hook


def leave(sentence: str) -> NoReturn:
    """Print a sentence on the first rank, and leave with status 130; other ranks, which may know of nothing, end."""
    for each in (signal.SIGINT, signal.SIGTERM):
        signal.signal(each, signal.SIG_IGN)  # once is enough
    if not launched() or "0" in map(os.environ.get, RANK):
        sys.stderr.write(f"\n{sentence}\n")
        sys.stderr.flush()
    if launched():
        if "mpi4py.MPI" in sys.modules:
            from mpi4py import MPI

            MPI.COMM_WORLD.Abort(INTERRUPTED)
        os._exit(INTERRUPTED)  # the end of MPI would wait for ranks that do not come
    sys.exit(INTERRUPTED)


def end_quietly() -> None:
    """Have the system end this process if nobody reads what it prints, as ``head``; PETSc has no handler of its own."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)


@cache
def end_together() -> None:
    """From now on a rank that fails alone, or the death of mpirun, leaves no other rank waiting for a message.

    An error that nobody catches is shown as ever, and ends all ranks.  Nothing changes where there is one rank.
    """
    from mpi4py import MPI

    if MPI.COMM_WORLD.size == 1:
        return
    end_with_launcher()
    report = sys.excepthook

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        report(kind, error, trace)
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(INTERRUPTED if issubclass(kind, KeyboardInterrupt) else 1)

    sys.excepthook = hook

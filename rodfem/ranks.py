"""What ranks do together: a check on the first one that all hear of, and their end."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import cache
from types import TracebackType

from mpi4py import MPI

from rodfem.errors import INTERRUPTED, InputError
from rodfem.launcher import end_with_launcher

PATIENCE, PAUSE, SHORTEST = 30.0, 0.01, 1e-4
"""Seconds after which a rank that others do not join failed alone; between two looks for them at last, and at first."""


def on_first(comm: MPI.Comm, check: Callable[[], object]) -> None:
    """Do something on the first rank, and raise its :class:`InputError` on every rank.

    The others sleep meanwhile: waiting for a message they would keep a processor busy that the first one can use.
    """
    trouble: InputError | None = None
    if comm.rank == 0:
        try:
            check()
        except InputError as error:
            trouble = error
    done, pause = comm.Ibarrier(), SHORTEST
    while not done.Test():
        time.sleep(pause)
        pause = min(2.0 * pause, PAUSE)
    trouble = comm.bcast(trouble)
    if trouble is not None:
        raise trouble


def all_come(comm: MPI.Comm) -> bool:
    """Whether all ranks come here, as they do where they raise the same error; False for one that waits in vain."""
    here, end = comm.Ibarrier(), time.monotonic() + PATIENCE
    while not here.Test():
        if time.monotonic() > end:
            return False
        time.sleep(PAUSE)
    return True


@cache
def end_together() -> None:
    """From now on a rank that fails alone, or the death of mpirun, leaves no other rank waiting for a message.

    An error that nobody catches is shown as ever, and ends all ranks.  Nothing changes where there is one rank.
    """
    if MPI.COMM_WORLD.size == 1:
        return
    end_with_launcher()
    report = sys.excepthook

    def hook(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        report(kind, error, trace)
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(INTERRUPTED if issubclass(kind, KeyboardInterrupt) else 1)

    sys.excepthook = hook

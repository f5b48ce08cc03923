"""Work in a copy of this process, beside it, that leaves nothing but files: compilers that fill a cache.

The copy shares no object with this process, runs no clean-up of its own, and calls neither MPI nor PETSc.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import NoReturn


class Job:
    """``work`` in a copy of this process, whose own end awaits it."""

    def __init__(self, work: Callable[[], object]) -> None:
        """Start it."""
        with warnings.catch_warnings():  # MPI's threads are no part of the copy, and it does not need them
            warnings.simplefilter("ignore", DeprecationWarning)
            self._copy = os.fork()
        if self._copy == 0:
            _work(work)
        atexit.register(self.wait)

    def wait(self) -> None:
        """Return when it is done, with or without success."""
        atexit.unregister(self.wait)
        with suppress(ChildProcessError):  # awaited already
            os.waitpid(self._copy, 0)


def _work(work: Callable[[], object]) -> NoReturn:
    """Work, silently and to the end whatever keys are pressed, and leave."""
    status = 1
    try:
        gc.disable()  # nothing of MPI or PETSc is destroyed here
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        work()
        status = 0
    finally:
        os._exit(status)

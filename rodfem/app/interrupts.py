"""Signals to programs: an interrupt is one sentence and status 130, whichever rank gets it; a closed pipe is no word.

A rank that is interrupted ends the others, too: they wait for it in a message, where Python hears no signal.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import NoReturn

from rodfem.errors import INTERRUPTED
from rodfem.ranks import end_with_launcher, first_of_job, launched

SIGNALS = (signal.SIGINT, signal.SIGTERM)
KEPT = "interrupted; what was finished is kept"


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
    """Print a sentence, once, and leave with status 130; other ranks, which may know of nothing, end, too."""
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)  # once is enough
    if first_of_job("interrupted"):
        sys.stderr.write(f"\n{sentence}\n")
        sys.stderr.flush()
    if launched():
        if "mpi4py.MPI" in sys.modules:
            from mpi4py import MPI

            MPI.COMM_WORLD.Abort(INTERRUPTED)
        os._exit(INTERRUPTED)  # the end of MPI would wait for ranks that do not come
    sys.exit(INTERRUPTED)


@contextmanager
def held() -> Iterator[None]:
    """Interrupts wait for the end of the block."""
    if threading.current_thread() is not threading.main_thread():  # signals go to another one
        yield
        return
    late: list[int] = []

    def wait(number: int, frame: FrameType | None) -> None:
        late.append(number)

    before = {each: signal.signal(each, wait) for each in SIGNALS}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, signal.SIG_DFL if handler is None else handler)
        if late:
            signal.raise_signal(late[0])


def end_quietly() -> None:
    """Have the system end this process if nobody reads what it prints, as ``head``; PETSc has no handler of its own."""
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)

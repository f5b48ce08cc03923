"""What started this process as one of several ranks, where something did: its end is theirs."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

RANK = ("PMIX_RANK", "OMPI_COMM_WORLD_RANK", "PMI_RANK")
"""Variables of the environment, one of which every rank has."""
JOB = "PMIX_SERVER_TMPDIR"
"""Variable of the folder that all ranks of a job on one machine share, and that goes with the job."""
SET_PDEATHSIG = 1
"""Request of Linux's prctl: the signal that this process gets at the end of its parent."""


def launched() -> bool:
    """Whether this process is a rank of a job."""
    return any(name in os.environ for name in RANK)


def end_with_launcher() -> None:
    """Have the system end this process with its parent, where that started it as a rank, and the system is Linux.

    It could not do so itself: a rank that waits for another one in a message hears nothing.
    """
    if sys.platform == "linux" and launched():
        ctypes.CDLL(None).prctl(SET_PDEATHSIG, signal.SIGKILL)


def first_of_job(word: str) -> bool:
    """Whether no other rank of this job, on this machine, has asked so for ``word``; yes where that is unknown."""
    if not launched():  # a variable may be left from the job of a parent
        return True
    try:
        os.close(os.open(Path(os.environ[JOB]) / f"rodfem-{word}", os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return False
    except (KeyError, OSError):
        pass
    return True

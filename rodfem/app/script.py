"""A file that states a rod, run as a program: without options a lesson, with options ``rodfem run FILE OPTIONS``.

A demo states its rod, and ends with a cell that traces it, which ``rodfem run`` leaves out::

    if script.lesson(__name__):
        diagram = rodfem.trace(cord(), mesh())
"""

from __future__ import annotations

import os
import sys

from rodfem.app import console
from rodfem.ranks import end_quietly


def lesson(name: str) -> bool:
    """Whether the cell of a file of this ``__name__`` is to run: it is the program, or a notebook, without options."""
    if name != "__main__":
        return False
    file, options = getattr(sys.modules[name], "__file__", None), sys.argv[1:]
    if file is None or "ipykernel" in sys.modules:
        return True
    if options:
        console.main(["run", file, *options])
        return False
    from mpi4py import MPI

    end_quietly()
    if MPI.COMM_WORLD.rank:
        sys.stdout = open(os.devnull, "w")
    return True

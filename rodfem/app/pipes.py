"""A reader of what a program prints may leave, as ``head`` does: the program ends there, without a word."""

from __future__ import annotations

import signal


def end_quietly() -> None:
    """Have the system end this process when nobody reads what it prints, and not PETSc, which it loads."""
    from petsc4py import PETSc  # noqa: F401

    signal.signal(signal.SIGPIPE, signal.SIG_DFL)

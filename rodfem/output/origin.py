"""Origin of a run: the command, the date, and the versions of what computed it."""

from __future__ import annotations

import ctypes
import platform
import shlex
import sys
from datetime import UTC, datetime
from typing import Any

import numpy as np

from rodfem import compat


def origin() -> dict[str, Any]:
    """Entry ``origin`` of ``diagram.json``: what reproduces the run."""
    return {
        "command": shlex.join(sys.orig_argv),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": versions(),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that compute, each by its name in lower case.

    That of MUMPS is absent where PETSc has it in another form than a shared library.
    """
    from slepc4py import SLEPc  # after what compat loads first

    found = {
        "python": platform.python_version(),
        "dolfinx": compat.dolfinx.__version__,
        "petsc": ".".join(map(str, compat.PETSc.Sys.getVersion())),
        "slepc": ".".join(map(str, SLEPc.Sys.getVersion())),
        "mumps": _mumps(),
        "numpy": np.__version__,
    }
    return {name: version for name, version in found.items() if version}


def _mumps() -> str:
    """Version of the MUMPS that PETSc is linked with, or nothing where that cannot be asked.

    It is asked of MUMPS's own Fortran subroutine ``MUMPS_SET_VERSION(VERSION_STR)``, with the length of the text as its
    hidden last argument.
    """
    try:
        ask = ctypes.CDLL(compat.PETSc.__file__).mumps_set_version_
    except (AttributeError, OSError):
        return ""
    text = ctypes.create_string_buffer(b" " * 31, 32)
    ask(text, ctypes.c_size_t(31))
    return text.value.decode("ascii").strip()

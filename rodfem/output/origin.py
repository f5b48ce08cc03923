"""Origin of a run: the command, the date, and the versions of what computed it."""

from __future__ import annotations

import platform
import shlex
import sys
from datetime import UTC, datetime
from typing import Any

import dolfinx
import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc


def origin() -> dict[str, Any]:
    """Entry ``origin`` of ``diagram.json``: what reproduces the run."""
    return {
        "command": shlex.join(sys.orig_argv),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "versions": {
            "python": platform.python_version(),
            "dolfinx": dolfinx.__version__,
            "petsc": ".".join(map(str, PETSc.Sys.getVersion())),
            "slepc": ".".join(map(str, SLEPc.Sys.getVersion())),
            "numpy": np.__version__,
        },
    }

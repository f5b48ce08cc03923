"""The folder that keeps compiled code from run to run, beside the kernels of FFCx."""

from __future__ import annotations

import os
import platform
from functools import cache
from pathlib import Path

HOMELESS = (
    "This user has no home folder, in which compiled code would be kept: set XDG_CACHE_HOME to a folder that can be "
    "written."
)


def folder() -> Path:
    """Folder in which FFCx keeps its kernels; raises :class:`RuntimeError` where there is no home folder to have it."""
    given = os.environ.get("XDG_CACHE_HOME")
    return (Path(given) if given else Path.home() / ".cache") / "fenics"


@cache
def processor() -> str:
    """Name and abilities of the processor, on which code compiled with -march=native depends."""
    try:
        lines = Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines()
        return "".join(line for line in lines if line.startswith(("model name", "flags", "Features")))
    except OSError:
        return platform.processor()


def refused(error: OSError) -> str:
    """Sentence on what the system says to who writes into the folder."""
    return (
        f"The folder {folder()}, which keeps compiled code, cannot be written ({error.strerror or error}): set "
        "XDG_CACHE_HOME to a folder that can be written."
    )


def have_home() -> None:
    """Have a home folder, which dolfinx asks for even where XDG_CACHE_HOME says where its kernels are.

    Raises :class:`RuntimeError` where there is neither.
    """
    try:
        Path.home()
    except RuntimeError:
        os.environ["HOME"] = str(folder().parent)

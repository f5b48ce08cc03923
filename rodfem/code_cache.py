"""The folder that keeps compiled code from run to run, beside the kernels of FFCx: what is broken in it is made anew.

A full disk or a power cut leaves modules that are cut short.  Loading one ends the process: the system finds no file
behind what the header promises.
"""

from __future__ import annotations

import os
import platform
import struct
from functools import cache
from pathlib import Path

ELF = b"\x7fELF"
"""Beginning of a shared object."""
HOMELESS = (
    "This user has no home folder, in which compiled code would be kept: set XDG_CACHE_HOME to a folder that can be "
    "written."
)
WIDE, BIG = 2, 2
"""Values of the bytes that tell 64 from 32 bits, and the order of bytes."""


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


def is_whole(file: Path) -> bool:
    """Whether a compiled module is no shorter than its header says; of other formats than ELF, whether it is a file.

    The last part of a shared object is the table of its sections, of which the header has place, entry size, number.
    """
    try:
        with file.open("rb") as opened:
            header, size = opened.read(64), os.fstat(opened.fileno()).st_size
    except OSError:
        return False
    if not header.startswith(ELF):
        return size >= len(ELF) and not ELF.startswith(header)
    if len(header) < 64:
        return False
    order = ">" if header[5] == BIG else "<"
    wide = header[4] == WIDE
    (place,) = struct.unpack_from(order + ("Q" if wide else "I"), header, 0x28 if wide else 0x20)
    entry, number = struct.unpack_from(f"{order}HH", header, 0x3A if wide else 0x2E)
    return bool(size >= place + entry * number)


def have_home() -> None:
    """Have a home folder, which dolfinx asks for even where XDG_CACHE_HOME says where its kernels are.

    Raises :class:`RuntimeError` where there is neither.
    """
    try:
        Path.home()
    except RuntimeError:
        os.environ["HOME"] = str(folder().parent)

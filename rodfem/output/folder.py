"""Places of files: whether a folder or a picture can be written, told before anything is computed or drawn."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from mpi4py import MPI

from rodfem.errors import Argument, InputError, Remedy

ANOTHER_FOLDER = Remedy("choose another one with {}", Argument("run", "output"))
PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".eps", ".ps", "")
"""Suffixes of pictures of diagrams; without one it is PNG."""


def on_first(comm: MPI.Comm, check: Callable[[], object]) -> None:
    """Do a check on the first rank, and raise its :class:`InputError` on every rank."""
    trouble: InputError | None = None
    if comm.rank == 0:
        try:
            check()
        except InputError as error:
            trouble = error
    trouble = comm.bcast(trouble)
    if trouble is not None:
        raise trouble


def writable(folder: Path) -> None:
    """Make ``folder``; raises :class:`InputError` where it cannot be written."""
    probe = folder / f".probe-{os.getpid()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe.write_text("")
        probe.unlink()
    except (OSError, ValueError) as error:  # ValueError for a zero byte in a name
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The output folder {folder} cannot be written ({reason})", ANOTHER_FOLDER) from error


def picture_at(path: Path, suffixes: Sequence[str]) -> None:
    """Make the folder of a picture; raises :class:`InputError` where it cannot be written, or has another suffix."""
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"The picture {path} has an unknown format: choose one of {', '.join(filter(None, suffixes))}."
        )
    if path.is_dir():
        raise InputError(f"The picture {path} is a folder: give a name in it, as in {path / 'picture.png'}.")
    writable(path.parent)

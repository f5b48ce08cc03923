"""The folder of a run: one process writes into it at a time, and what killed ones left behind goes."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from mpi4py import MPI

from rodfem.errors import InputError
from rodfem.ranks import on_first
from rodfem.whole_files import ANOTHER_FOLDER, DRAFTS, writing

LOCK = ".lock"
"""File whose lock says that the folder is in use; it has the process and the host in words."""
MOST = 300
"""Bytes of the lock that are read."""
PICTURES_OF_A_RUN = ("locus.png", "diagram.png", "shape.png", "modes-*.png", "modes-*.gif", "report.html")
OF_A_RUN = ("modes.h5", "locus*.json", *PICTURES_OF_A_RUN)
"""Files that a run may leave beside its diagram and states."""
PICTURES = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".tif", ".tiff", ".webp", ".eps", ".ps", "")
"""Suffixes of pictures of diagrams; without one it is PNG."""
HELD: set[Path] = set()
"""Folders that this process holds."""


@contextmanager
def locked(folder: Path, comm: MPI.Comm) -> Iterator[None]:
    """Make ``folder``, and keep other processes from writing into it; collective over ``comm``.

    The system frees the lock with the end of the process, however it ends.  Drafts of processes that were killed are
    removed.  Raises :class:`InputError` on every rank where the folder cannot be written, or is in use.
    """
    place = folder.resolve()
    if comm.bcast(place in HELD):
        yield
        return
    files: list[int] = []
    on_first(comm, lambda: files.append(_acquired(folder)))
    HELD.update([place] if files else [])
    try:
        yield
        comm.barrier()  # all have written what they write
    finally:
        HELD.discard(place)
        for file in files:
            with suppress(OSError):  # the folder is gone
                (folder / LOCK).unlink()
            os.close(file)
    comm.barrier()  # nobody sees the lock any more


def _acquired(folder: Path) -> int:
    """Descriptor of the lock of a folder, which is made, and in which there are no drafts any more."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        while (file := _lock(folder)) is None:
            pass
        os.truncate(file, 0)
        os.pwrite(file, f"process {os.getpid()} on {socket.gethostname()}".encode(), 0)
        for draft in folder.glob(DRAFTS):
            draft.unlink()
    return file


def _lock(folder: Path) -> int | None:
    """Descriptor of the lock; None where who held it has just removed it."""
    file = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(file), os.stat(folder / LOCK)):
            return file
    except FileNotFoundError:
        pass
    except (BlockingIOError, PermissionError):
        holder = os.pread(file, MOST, 0).decode(errors="replace") or "another process"
        os.close(file)
        raise InputError(f"The output folder {folder} is in use by {holder}", ANOTHER_FOLDER) from None
    os.close(file)
    return None


def remove_earlier(folder: Path) -> None:
    """Remove what an earlier run left beside its diagram and states, which the next save replaces."""
    with writing(folder):
        for pattern in OF_A_RUN:
            for file in folder.glob(pattern):
                file.unlink()


def writable(folder: Path) -> None:
    """Make ``folder``; raises :class:`InputError` where it cannot be written."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".probe-{os.getpid()}"
        probe.write_text("")
        probe.unlink()


def picture_at(path: Path, suffixes: Sequence[str]) -> None:
    """Make the folder of a picture; raises :class:`InputError` where it cannot be written, or has another suffix."""
    if path.suffix.lower() not in suffixes:
        raise InputError(
            f"The picture {path} has an unknown format: choose one of {', '.join(filter(None, suffixes))}."
        )
    if path.is_dir():
        raise InputError(f"The picture {path} is a folder: give a name in it, as in {path / 'picture.png'}.")
    writable(path.parent)

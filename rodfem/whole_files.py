"""Files that are written whole: a kill at any moment, or a full disk, leaves the old file or the new one, readable.

A file is written as a draft next to its place, and then takes that place in one step.  Numbers are flushed to the disk
before, so that a power cut does not lose them; pictures can be drawn again.  One process writes into a folder at a
time, and removes the drafts that killed ones left.

HDF5 files are made in memory: the library does not recover from a full disk, and a file to which it appends is
unreadable where it is killed.  An addition therefore costs a copy of the file, some 4 ms for each MB.
"""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING

from rodfem.errors import InputError
from rodfem.ranks import on_first

if TYPE_CHECKING:
    import h5py
    from mpi4py import MPI

DRAFTS = ".*.rodfem-part*"  # names of drafts: that of the file, whose suffix says what it is to those who write it
LOCK = ".lock"  # file whose lock says that the folder is in use; it has the process and the host in words
OF_A_RUN = ("modes.h5", "locus-*.json", "locus.png", "diagram.png", "shape.png")
"""Names of the files that a run may write next to its diagram and states."""
FOLDERS: set[Path] = set()  # folders whose lock this process has
ANOTHER_FOLDER = "choose another one with run(output=...)"


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Raise :class:`InputError` where the system lets nobody write into a folder."""
    try:
        yield
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError for a zero byte in a name
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The output folder {folder} cannot be written ({reason}): {ANOTHER_FOLDER}.") from error


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Yield the path of a draft, which takes the place of ``path`` at the end, and goes where the block fails."""
    draft = path.with_name(f".{path.stem}.rodfem-part{path.suffix}")
    with writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.unlink(missing_ok=True)  # it may be a link to another file
        try:
            yield draft
            os.replace(draft, path)
        except BaseException:
            draft.unlink(missing_ok=True)
            raise


def write_whole(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together: all are written before the last one, then the others, take their places."""
    with ExitStack() as drafts:
        for path, data in contents.items():
            with drafts.enter_context(draft_of(path)).open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())


def with_added(path: Path, add: Callable[[h5py.File], None], *, first: bool) -> bytes:
    """Contents of an HDF5 file to which ``add`` adds, a new one if ``first``; the file itself stays as it is."""
    import h5py

    with h5py.File(path, "w" if first else "r+", driver="core", backing_store=False) as file:
        add(file)
        file.flush()
        image: bytes = file.id.get_file_image()
    return image


# --- the folder of a run


@contextmanager
def locked(folder: Path, comm: MPI.Comm) -> Iterator[None]:
    """Make ``folder``, and keep other processes from writing into it; collective over ``comm``."""
    place = folder.resolve()
    if comm.bcast(place in FOLDERS):
        yield
        return
    files: list[int] = []
    on_first(comm, lambda: files.append(_acquired(folder)))
    FOLDERS.update([place] if files else [])
    try:
        yield
        comm.barrier()  # all have written what they write
    finally:
        FOLDERS.discard(place)
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
    """Descriptor of the lock; None if another process has just removed it."""
    file = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    try:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(file), os.stat(folder / LOCK)):
            return file
    except FileNotFoundError:
        pass
    except (BlockingIOError, PermissionError):
        holder = os.pread(file, 300, 0).decode(errors="replace") or "another process"
        os.close(file)
        raise InputError(f"The output folder {folder} is in use by {holder}: {ANOTHER_FOLDER}.") from None
    os.close(file)
    return None


def remove_earlier(folder: Path, names: Iterable[str]) -> None:
    """Remove from a folder what its diagram names as the files of a run: the next save replaces diagram and states."""
    with writing(folder):
        for name in names:
            if Path(name).name == name and any(fnmatch(name, pattern) for pattern in OF_A_RUN):
                (folder / name).unlink(missing_ok=True)

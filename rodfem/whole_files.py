"""Files that are written whole: a kill at any moment, or a full disk, leaves the old file or the new one, readable.

A file is written as a draft beside its place, and then takes that place in one step.  Numbers are flushed to the disk
before, so that a power cut does not lose them; pictures can be drawn again.  A draft that a killed process left is
removed by the next run in its folder (:mod:`rodfem.output.folder`).

HDF5 files are made in memory: the library does not recover from a full disk, and a file to which it appends is
unreadable where it is killed.  An addition therefore costs a copy of the file, some 4 ms for each MB.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rodfem.errors import Argument, InputError, Remedy

if TYPE_CHECKING:
    import h5py

DRAFTS = ".*.part.*"
"""Names of drafts: that of the file, whose suffix says what it is to those who write it."""
NO_MEMORY = "unable to allocate memory"
"""Words of the HDF5 library."""
ANOTHER_FOLDER = Remedy("choose another one with {}", Argument("run", "output"))


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Raise :class:`InputError` where the system lets nobody write into a folder."""
    try:
        yield
    except (OSError, ValueError) as error:  # ValueError for a zero byte in a name
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"The output folder {folder} cannot be written ({reason})", ANOTHER_FOLDER) from error


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Yield the path of a draft, which takes the place of ``path`` at the end, and goes where the block fails.

    Folders on the way are made.  Raises :class:`InputError` where it cannot be written.
    """
    draft = path.with_name(f".{path.stem}.part{path.suffix}")
    with writing(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield draft
            os.replace(draft, path)
        except BaseException:
            draft.unlink(missing_ok=True)
            raise


def write_whole(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together: all are written before the first takes its place.

    They take their places one right after the other, the last one first.  Raises :class:`InputError` where one of them
    cannot be written.
    """
    with ExitStack() as drafts:
        for path, data in contents.items():
            with drafts.enter_context(draft_of(path)).open("wb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())


def with_added(path: Path, add: Callable[[h5py.File], None], *, first: bool) -> bytes:
    """Contents of an HDF5 file to which ``add`` adds, a new one if ``first``; the file itself stays as it is.

    Raises :class:`MemoryError` where there is no room for it.
    """
    import h5py

    try:
        with h5py.File(path, "w" if first else "r+", driver="core", backing_store=False) as file:
            add(file)
            file.flush()
            image: bytes = file.id.get_file_image()
    except OSError as error:  # as the library calls it
        if NO_MEMORY in str(error):
            raise MemoryError(str(error)) from error
        raise
    return image

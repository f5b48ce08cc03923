"""Formats of the files that rodfem writes: names and versions, the mark that a file carries, and its check.

A JSON file carries its mark in the entry ``format``, with ``name``, ``version`` and ``program``; an HDF5 file in the
attributes ``format``, ``format_version`` and ``program``.  The version of a format rises where a reader of the last one
would misread a file, or miss what it needs; entries that are merely added do not raise it.  ``docs/files.md`` describes
each entry, group and column.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem import __version__
from rodfem.errors import InputError

if TYPE_CHECKING:
    import h5py

PROGRAM = f"rodfem {__version__}"  # name and version of the program, as files have it
KEYS = {"name": "format", "version": "format_version", "program": "program"}
"""Entries of a mark, and the attributes that an HDF5 file has for them."""


@dataclass(frozen=True)
class Format:
    """Format of a kind of file: its name, which file of a run has it, in words, and its version as written now."""

    name: str
    file: str
    version: int = 1

    def mark(self) -> dict[str, Any]:
        """Entry ``format`` of a JSON file."""
        return {"name": self.name, "version": self.version, "program": PROGRAM}

    def mark_attributes(self) -> dict[str, Any]:
        """Attributes of an HDF5 file."""
        return {KEYS[key]: value for key, value in self.mark().items()}

    def check(self, data: Any, where: Path | str, needs: Sequence[str] = ()) -> None:
        """Raise :class:`InputError` for another format or version, or what lacks what a reader ``needs``."""
        if not isinstance(data, Mapping):
            raise InputError(f"{where} has no entries by name, so it is no {self.name}: give {self.file}.")
        self._check(data.get("format") or {}, data, where, needs)

    def check_hdf5(self, file: h5py.File, needs: Sequence[str] = ()) -> None:
        """Check an open HDF5 file, as :meth:`check` does a JSON file; ``needs`` are names of groups or attributes."""
        mark = {key: file.attrs.get(name) for key, name in KEYS.items()}
        self._check(mark, {*file.attrs, *file}, file.filename, needs)

    @contextmanager
    def opened(self, path: Path | str, needs: Sequence[str] = (), unfit: str = "") -> Iterator[h5py.File]:
        """Open an HDF5 file; raises :class:`InputError` for what cannot be read inside of the block, too."""
        import h5py

        with refusal(unfit or f"{path} is no {self.name} ({{}}): give {self.file}."):
            check_regular(path)
            with h5py.File(path, "r") as file:
                self.check_hdf5(file, needs)
                if hollow := file.visititems(_hollow):
                    raise OSError(f"of the array {hollow} a part only is stored")
                yield file

    def _check(self, mark: Mapping[str, Any], entries: Any, where: Path | str, needs: Sequence[str]) -> None:
        if mark.get("name") != self.name:
            raise InputError(f"{where} is no {self.name}, its format is {mark.get('name')!r}: give {self.file}.")
        if mark["version"] > self.version:
            raise InputError(
                f"{where} was written by {mark['program']}, in version {mark['version']} of the format {self.name!r}, "
                f"and {PROGRAM} reads versions up to {self.version}: read it with that program, or run the scene again."
            )
        if missing := [name for name in needs if name not in entries]:
            raise InputError(f"{where} has no {', '.join(missing)}, so it is no {self.name}: give {self.file}.")


DIAGRAM = Format("rodfem diagram", "the diagram.json of a run", 2)
STATES = Format("rodfem states", "the states.h5 of a run", 2)
MODES = Format("rodfem modes", "the modes.h5 of a run with Plan(modes=...)")
LOCUS = Format("rodfem locus", "a locus-1.json, locus-2.json ... of a run with Plan(locus=...)")
RESULT = Format("rodfem result", "a rod-00000.json, rod-00001.json ... of rodfem.many")
FORMATS = (DIAGRAM, STATES, MODES, LOCUS, RESULT)

CONTROL = re.compile(r"\\(?:\\|u00(?:0[0-8bcef]|[189][0-9a-f]|7f))|[\x7f-\x9f]", re.IGNORECASE)
"""Characters of a JSON text that a terminal obeys, as JSON writes them, and a backslash, which is none."""
UNREADABLE = (
    *(OSError, LookupError, ValueError, TypeError, AttributeError, RuntimeError, MemoryError, ArithmeticError),
    np.linalg.LinAlgError,
)
"""Errors of h5py and numpy for a file that holds something else than was expected."""


@contextmanager
def refusal(unfit: str) -> Iterator[None]:
    """Raise :class:`InputError` with a sentence, in which ``{}`` stands for the reason, where a file is unreadable."""
    try:
        yield
    except InputError:
        raise
    except UNREADABLE as trouble:
        reason = (str(trouble).splitlines() or [type(trouble).__name__])[0]
        raise InputError(unfit.replace("{}", reason)) from trouble


def check_regular(path: Path | str) -> None:
    """Raise :class:`OSError` for a pipe or a device, on which a reader would wait for ever."""
    if not S_ISREG(os.stat(path).st_mode):
        raise OSError("it is no regular file")


def _hollow(name: str, item: Any) -> str | None:
    """Name of an array that is larger than what its file stores of it, which a reader would fill in memory."""
    return name if getattr(item, "nbytes", 0) and item.nbytes > item.id.get_storage_size() else None


def read_json(path: Path, form: Format, needs: Sequence[str] = ()) -> dict[str, Any]:
    """Contents of a JSON file, whose texts have no characters that a terminal obeys but ends of lines and tabs.

    Raises :class:`InputError` if it cannot be read, and as :meth:`Format.check` does.
    """
    try:
        check_regular(path)
        text = CONTROL.sub(lambda found: found[0] if found[0] == r"\\" else "\ufffd", path.read_text(encoding="utf-8"))
        data: dict[str, Any] = json.loads(text)
    except FileNotFoundError as trouble:
        also = ", or the folder of one: rodfem list names those below a folder" if form is DIAGRAM else ""
        raise InputError(f"There is no {path}: give {form.file}{also}.") from trouble
    except (OSError, ValueError, RecursionError) as trouble:
        raise InputError(f"{path} is no {form.name} ({trouble}): give {form.file}.") from trouble
    form.check(data, path, needs)
    return data

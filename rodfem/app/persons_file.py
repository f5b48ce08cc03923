"""A person's Python file, run by a command of the program: the module that it is, or one sentence on where it fails.

It may import what stands next to it.  Its folder is the last one in which modules are looked for: a file ``json.py`` or
``h5py.py`` there is no module of those that compute.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from rodfem.errors import InputError

RUN = "__run__"  #: name in a module of the mesh and the plan with which it runs its rod itself
_read: list[Path] = []  # the files that are read for the rod that they state


class RunsItselfError(BaseException):
    """A file that is read for its rod asks for a run of its own: reading it ends there, the rod is stated."""


def leave_the_run(*own: object) -> None:
    """Raise :class:`RunsItselfError` with its ``own`` mesh and plan if a file is read for its rod: not to run twice."""
    if _read:
        raise RunsItselfError(*own)


@contextmanager
def as_sentence(file: Path, remedy: str) -> Iterator[None]:
    """Raise :class:`~rodfem.errors.InputError` with the last line of a ``file`` that ran, and a ``remedy``."""
    try:
        yield
    except InputError:
        raise
    except (Exception, SystemExit) as trouble:  # whatever the file does
        frames = [f for f in extract_tb(trouble.__traceback__) if f.filename == str(file.resolve())]
        line = trouble.lineno if isinstance(trouble, SyntaxError) else frames[-1].lineno if frames else None
        where = f"{file}, line {line}" if line else f"{file}"
        raise InputError(f"{where}: {type(trouble).__name__}: {trouble}; {remedy}.") from trouble


def load(file: Path, name: str | None = None) -> ModuleType:
    """Module of a file, read for the rod that it states, or by another ``name``.

    The name of the file gets a stroke that no other module has.  Where the file runs its rod itself, the rod is stated,
    and reading ends: the range and the options are the command line's.  Raises :class:`~rodfem.errors.InputError` where
    it is missing, ends the program, or fails: with the last of its own lines that ran.
    """
    if not file.is_file():
        raise InputError(f"{file} is no file: give the path of a Python program.")
    path = file.resolve()
    for_its_rod = [] if name else [path]
    name = name or f"{file.stem}_"
    spec = spec_from_loader(name, SourceFileLoader(name, str(path)))
    assert spec is not None and spec.loader is not None
    module, before = module_from_spec(spec), sys.modules.get(name)
    sys.modules[name] = module  # where pickling, and dataclasses, look
    sys.path.append(str(path.parent))
    _read.extend(for_its_rod)
    try:
        with as_sentence(file, f"run {sys.executable} {file} to see more"):
            spec.loader.exec_module(module)
    except RunsItselfError as run:
        vars(module)[RUN] = run.args
    finally:
        del _read[len(_read) - len(for_its_rod) :]
        if before is not None:
            sys.modules[name] = before
    return module

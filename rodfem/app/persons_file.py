"""A person's Python file, run by a command of the program: the module that it is, or one sentence on where it fails."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from rodfem.errors import InputError

_read: list[Path] = []
"""The files that are read for the rod that they state."""


class RunsItselfError(BaseException):
    """A file that is read for its rod asks for a run of its own: reading it ends there, the rod is stated."""


@contextmanager
def for_its_rod(file: Path) -> Iterator[None]:
    """Read a ``file`` up to where it runs its rod itself: the range and the options are the command line's."""
    _read.append(file)
    try:
        yield
    except RunsItselfError:
        pass
    finally:
        _read.pop()


def leave_the_run() -> None:
    """Raise :class:`RunsItselfError` where a file is read for its rod: it would be run twice."""
    if _read:
        raise RunsItselfError


def load(file: Path, name: str | None = None) -> ModuleType:
    """Module of a file, by its own name or another one.

    Raises :class:`~rodfem.errors.InputError` where it is missing, fails, or ends the program: with the last of its own
    lines that ran.
    """
    if not file.is_file():
        raise InputError(f"{file} is no file: give the path of a Python program.")
    path = file.resolve()
    spec = spec_from_loader(name or file.stem, SourceFileLoader(name or file.stem, str(path)))
    assert spec is not None and spec.loader is not None
    module, before = module_from_spec(spec), sys.modules.get(spec.name)
    sys.modules[spec.name] = module  # where pickling, and dataclasses, look
    sys.path.insert(0, str(path.parent))
    try:
        with for_its_rod(path) if name is None else nullcontext():
            spec.loader.exec_module(module)
    except InputError:
        raise
    except (Exception, SystemExit) as trouble:  # whatever the file does
        line = getattr(trouble, "lineno", None) if isinstance(trouble, SyntaxError) else _last_line(path, trouble)
        where = f"{file}, line {line}" if line else f"{file}"
        words = f"{where}: {type(trouble).__name__}: {trouble}{_there_are(trouble)}{_hides(path, trouble)}"
        raise InputError(f"{words}; run {_python()} {file} to see more.") from trouble
    finally:
        if before is not None:
            sys.modules[spec.name] = before
    return module


def _hides(path: Path, trouble: BaseException) -> str:
    """Say of a file with the name of a package that it was imported in the place of that."""
    if not isinstance(trouble, ImportError) or trouble.path != str(path):
        return ""
    return f": {path.name} hides the package {path.stem}, so give it another name"


def _last_line(path: Path, trouble: BaseException) -> int | None:
    """Last line of a file that ran before it failed."""
    return next((f.lineno for f in reversed(extract_tb(trouble.__traceback__)) if f.filename == str(path)), None)


def _there_are(trouble: BaseException) -> str:
    """Public functions and classes of a module of rodfem in which a name was looked for in vain."""
    module = getattr(trouble, "obj", None)
    if not isinstance(trouble, AttributeError) or not isinstance(module, ModuleType):
        return ""
    here = module.__name__
    if not here.startswith(("rodfem", "forms")):
        return ""
    names = [n for n, x in vars(module).items() if not n.startswith("_") and getattr(x, "__module__", "") == here]
    return f": there are {', '.join(sorted(names))}" if names else ""


def _python() -> str:
    """Path of the interpreter, relative to the folder in which it is typed if it is below that."""
    path = Path(sys.executable)
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)

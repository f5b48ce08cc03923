"""Cache of compiled code: its folder, and compilers that fill it in copies of this process.

A copy shares no object with this process, runs no clean-up of its own, and calls neither MPI nor PETSc.
"""

from __future__ import annotations

import atexit
import gc
import os
import platform
import signal
import warnings
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, NoReturn

_LOADED: dict[Path, Any] = {}
"""Modules by their files."""
UNLOADABLE = "What was compiled in {} cannot be loaded: set XDG_CACHE_HOME to a folder from which programs may run."


def folder() -> Path:
    """Folder in which FFCx keeps its kernels."""
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


def load(name: str, file: Path) -> Any:
    """The compiled module of a ``file``, the same each time; None for a damaged one, which is removed."""
    if file in _LOADED:
        return _LOADED[file]
    spec = spec_from_file_location(name, file)
    assert spec is not None and spec.loader is not None
    try:
        module = module_from_spec(spec)
        spec.loader.exec_module(module)
    except ImportError:
        with suppress(OSError):
            file.unlink()
        return None
    return _LOADED.setdefault(file, module)


class Job:
    """``work`` in a copy of this process, whose own end awaits it."""

    def __init__(self, work: Callable[[], object]) -> None:
        with warnings.catch_warnings():  # MPI's threads are no part of the copy, and it does not need them
            warnings.simplefilter("ignore", DeprecationWarning)
            self._copy = os.fork()
        if self._copy == 0:
            _work(work)
        atexit.register(self.wait)

    def wait(self) -> None:
        """Return when it is done, with or without success."""
        atexit.unregister(self.wait)
        with suppress(ChildProcessError):  # awaited already
            os.waitpid(self._copy, 0)


def _work(work: Callable[[], object]) -> NoReturn:
    """Work, silently and to the end whatever keys are pressed, and leave."""
    status = 1
    try:
        gc.disable()  # nothing of MPI or PETSc is destroyed here
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        work()
        status = 0
    finally:
        os._exit(status)

"""C code of the package, compiled once with cffi, by the compiler and beside the kernels of FFCx."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import tempfile
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any

from rodfem import code_cache
from rodfem.beside import Job
from rodfem.errors import SetupError

FLAGS = ["-O3", "-march=native"]
"""Of the compiler: fast loops, and no -ffast-math, which would hide what is no number."""
_HERE = Path(__file__).parent
_JOBS: dict[str, Job] = {}
"""What is compiled beside this process, by name."""


def compile_ahead(name: str, declarations: str, beside: Path = _HERE) -> None:
    """Begin to compile in another process what :func:`module` finds then in the cache, unless that has it."""
    full, code = _named(name, declarations, beside)
    if full not in _JOBS and _found(full) is None:
        _JOBS[full] = Job(lambda: _compile(full, code, declarations))


@cache
def module(name: str, declarations: str, beside: Path = _HERE) -> Any:
    """The compiled module of ``name.c`` in the folder ``beside``, with ``lib`` and ``ffi`` of cffi.

    ``declarations`` are its functions in C.  Raises what the compiler raises, and :class:`SetupError` where the cache
    lacks the module and cannot be written.
    """
    full, code = _named(name, declarations, beside)
    if full in _JOBS:
        _JOBS.pop(full).wait()
    found = _found(full) or _compile(full, code, declarations)
    spec = importlib.util.spec_from_file_location(full, found)
    assert spec is not None and spec.loader is not None
    out = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(out)
    return out


def _named(name: str, declarations: str, beside: Path) -> tuple[str, str]:
    """Name in the cache, which tells all that the compiled code depends on, and the code of ``name.c``."""
    code = (beside / f"{name}.c").read_text()
    depends = [code, declarations, *FLAGS, sys.version, code_cache.processor()]
    key = hashlib.sha1("\n".join(depends).encode()).hexdigest()[:16]
    return f"rodfem_{name}_{key}", code


def _found(full: str) -> Path | None:
    """Compiled module in the cache, by its name: to list that folder takes long where it has thousands of files."""
    place = code_cache.folder()
    files = (place / f"{full}{suffix}" for suffix in EXTENSION_SUFFIXES)
    return next((file for file in files if code_cache.is_whole(file)), None)


def _compile(full: str, code: str, declarations: str) -> Path:
    """Compile in a folder of its own; what is moved to the cache is whole, whoever else compiles it meanwhile."""
    from cffi import FFI

    builder = FFI()
    builder.cdef(declarations)
    builder.set_source(full, code, extra_compile_args=FLAGS, libraries=["m"])
    folder = code_cache.folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        room = tempfile.TemporaryDirectory(dir=folder)
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error
    with room as inside:
        made = Path(builder.compile(tmpdir=inside))
        return made.replace(folder / made.name)

"""C code of the package, compiled once with cffi, by the compiler and beside the kernels of FFCx."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

FLAGS = ["-O3", "-march=native"]
"""Of the compiler: fast loops, and no -ffast-math, which would hide what is no number."""


def _cache() -> Path:
    """Folder in which FFCx keeps its kernels."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fenics"


def _processor() -> str:
    """Name and abilities of the processor, which code compiled for it depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines()
        return "".join(line for line in lines if line.startswith(("model name", "flags", "Features")))
    except OSError:
        return platform.processor()


@cache
def module(name: str, declarations: str, beside: Path = Path(__file__).parent) -> Any:
    """The compiled module of ``name.c`` in the folder ``beside``, with ``lib`` and ``ffi`` of cffi.

    ``declarations`` are its functions in C.  Raises what the compiler raises.
    """
    code = (beside / f"{name}.c").read_text()
    key = hashlib.sha1("\n".join([code, declarations, *FLAGS, sys.version, _processor()]).encode()).hexdigest()[:16]
    full, folder = f"rodfem_{name}_{key}", _cache()
    found = next(folder.glob(f"{full}*.so"), None)
    if found is None:
        found = _compile(full, code, declarations, folder)
    spec = importlib.util.spec_from_file_location(full, found)
    assert spec is not None and spec.loader is not None
    out = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(out)
    return out


def _compile(full: str, code: str, declarations: str, folder: Path) -> Path:
    """Compile in a folder of its own; what is moved to the cache is whole, whoever else compiles it meanwhile."""
    from cffi import FFI

    builder = FFI()
    builder.cdef(declarations)
    builder.set_source(full, code, extra_compile_args=FLAGS, libraries=["m"])
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as room:
        made = Path(builder.compile(tmpdir=room))
        return made.replace(folder / made.name)

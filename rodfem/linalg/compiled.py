"""C code of the package: built with the wheel, or compiled once with cffi next to the kernels of FFCx; and its memory.

A file of C has structures, and functions marked ``PUBLIC``, which Python calls.  Like all others they are ``static``:
cffi compiles them in one unit with what calls them, so that the only name a module exports is its init function.  An
exported name can be taken over: the dynamic linker binds the module's own calls to the first library that has the name
(the C library has an ``advance``, for one).

The code is compiled for the processor that it is compiled on, and the module's name says for which.  A wheel that was
built on another processor serves all the same: its modules are not found, and the code is compiled when it is needed.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import re
import shlex
import shutil
import sys
import sysconfig
import tempfile
from collections.abc import Hashable
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rodfem import code_cache
from rodfem.errors import SetupError

if TYPE_CHECKING:
    import numpy as np

FLAGS = ["-O3", "-march=native", "-fvisibility=hidden"]
"""Of the compiler: fast loops, and no -ffast-math, which would hide what is no number."""
LINKED = ["-Wl,-Bsymbolic"] if sys.platform == "linux" else []
"""Of the linker: a module's names are its own."""
PACKAGE = Path(__file__).parents[1]
STRUCTURE = re.compile(r"^typedef struct[^{;]*(?:\{.*?^\})?[^;]*;", re.MULTILINE | re.DOTALL)
FUNCTION = re.compile(r"^PUBLIC (.*?)\s*\{", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"^#define \w+ \d+(?=\s)", re.MULTILINE)


class Memory:
    """What the pointers in a structure of C point to: the only addresses that C keeps from one call to the next.

    C counts no references.  Each array is kept here under the name of the pointer, until another takes its place or the
    object that has the structure goes, which has this as well.  An array that is handed over for one call alone needs
    no more than :func:`buffer`.
    """

    def __init__(self, ffi: Any) -> None:
        self._ffi = ffi
        self._kept: dict[Hashable, Any] = {}

    def array(self, name: Hashable, values: np.ndarray) -> Any:
        """Pointer to ``values``, as for :func:`buffer`, which are kept under ``name``."""
        return self.keep(name, buffer(self._ffi, values))

    def point(self, structure: Any, **arrays: np.ndarray) -> None:
        """Let pointers of a ``structure``, by their names, point to ``arrays``, which are kept."""
        for name, array in arrays.items():
            setattr(structure, name, self.array((structure, name), array))

    def keep(self, name: Hashable, owner: Any) -> Any:
        """Keep the ``owner`` of what a pointer points to under ``name``, and return it."""
        self._kept[name] = owner
        return owner


def buffer(ffi: Any, values: np.ndarray) -> Any:
    """Pointer to contiguous ``values`` of float64 or int32, which live as long as it does; others raise ValueError."""
    kind = {"d": "double[]", "i": "int[]"}.get(values.dtype.char)
    if kind is None:
        raise ValueError(f"C has no numbers of type {values.dtype}: hand over float64 or int32.")
    return ffi.from_buffer(kind, values if values.flags.c_contiguous else values.T)


def addresses(compiled: Any, *names: str) -> list[int]:
    """Addresses of functions of a compiled module, for other compiled code."""
    return [int(compiled.ffi.cast("uintptr_t", compiled.ffi.addressof(compiled.lib, name))) for name in names]


@cache
def module(name: str) -> Any:
    """The compiled module of the file ``name.c`` in the package, with ``lib`` and ``ffi`` of cffi."""
    full = _full_name(name)
    # next to its code, from the wheel, or in the cache: to list that takes long, it has many files
    places = ((PACKAGE / name).parent, code_cache.folder())
    files = (place / f"{full}{suffix}" for place in places for suffix in EXTENSION_SUFFIXES)
    found = next((file for file in files if file.is_file()), None)
    out = (code_cache.load(full, found) if found else None) or code_cache.load(full, _compile(name))
    if out is None:
        raise SetupError(code_cache.UNLOADABLE.format(code_cache.folder()))
    return out


def interface(code: str) -> str:
    """What Python knows of a file of C: its constants, its structures, and the functions that are marked PUBLIC."""
    functions = (f"{function};" for function in FUNCTION.findall(code))
    return "\n".join([*NUMBER.findall(code), *STRUCTURE.findall(code), *functions])


def builder(name: str, package: str = "") -> Any:
    """Cffi's builder of the module of ``name.c``, in a ``package``."""
    from cffi import FFI

    code, ffi = _code(name), FFI()
    ffi.cdef(interface(code))
    arguments = {"extra_compile_args": FLAGS, "extra_link_args": LINKED, "libraries": ["m"]}
    ffi.set_source(f"{package}{_full_name(name)}", code, **arguments)
    return ffi


def _code(name: str) -> str:
    return (PACKAGE / f"{name}.c").read_text()


def _full_name(name: str) -> str:
    """Name of the module, which tells all that its compiled code depends on."""
    depends = [_code(name), *FLAGS, *LINKED, sys.version, code_cache.processor()]
    key = hashlib.sha1("\n".join(depends).encode()).hexdigest()[:16]
    return f"rodfem_{Path(name).name}_{key}"


def _compile(name: str) -> Path:
    """Compile in a folder of its own; what is moved to the cache is whole, whoever else compiles it meanwhile."""
    require_compiler()
    folder = code_cache.folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        room = tempfile.TemporaryDirectory(dir=folder)
    except OSError as error:
        raise SetupError(code_cache.refused(error)) from error
    with room as inside:
        made = Path(builder(name).compile(tmpdir=inside))
        return made.replace(folder / made.name)


OTHERS = ("cc", "gcc", "clang")
"""Programs that serve if the compiler of this Python is not there."""
NO_COMPILER = (
    "There is no C compiler, which the equations of a rod are compiled with: install one with 'apt install gcc' (as "
    "root), or with 'pip install \"rodfem[cc]\"' (ziglang, without root), or name yours in the variable CC."
)

NO_HEADERS = (
    "This Python has no header files ({} is missing), which compiled code needs: install them with 'apt install "
    "python3-dev' (as root), or use a Python that has them, as those of uv, pyenv and conda do."
)


def require_compiler() -> None:
    """Have a C compiler for cffi and FFCx; raises :class:`SetupError` if there is none."""
    if missing_compiler():
        raise SetupError(missing_compiler())


@cache
def missing_compiler() -> str:
    """Sentence on what lacks for compiling C; empty if nothing does."""
    given = os.environ.get("CC") or sysconfig.get_config_var("CC") or OTHERS[0]
    if shutil.which(shlex.split(given)[0]) is None:
        if os.environ.get("CC"):
            return f"There is no C compiler {given!r}, which the variable CC names: unset CC, or correct it."
        command = next((name for name in OTHERS if shutil.which(name)), None)
        if command is None and importlib.util.find_spec("ziglang"):
            command = shlex.join([sys.executable, "-m", "ziglang", "cc"])
        if command is None:
            return NO_COMPILER
        os.environ |= {"CC": command, "LDSHARED": f"{command} -shared"}
    return missing_header()


def missing_header() -> str:
    """Sentence on a Python without header files; empty for one that has them."""
    header = Path(sysconfig.get_path("include"), "Python.h")
    return "" if header.is_file() else NO_HEADERS.format(header)

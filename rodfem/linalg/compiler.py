"""The C compiler: it compiles forms when a scene first runs, and rodfem's own code unless that came with a wheel."""

from __future__ import annotations

import os
import shlex
import shutil
import sys
import sysconfig
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from rodfem.errors import SetupError

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


def require() -> None:
    """Have a C compiler for cffi and FFCx; raises :class:`SetupError` if there is none."""
    if missing():
        raise SetupError(missing())


@cache
def missing() -> str:
    """Sentence on what lacks for compiling C; empty if nothing does.

    The compiler is that of the variable CC, of this Python, another one on the path, or that of ziglang.
    """
    given = os.environ.get("CC") or sysconfig.get_config_var("CC") or OTHERS[0]
    if shutil.which(shlex.split(given)[0]) is None:
        if os.environ.get("CC"):
            return f"There is no C compiler {given!r}, which the variable CC names: unset CC, or correct it."
        command = next((name for name in OTHERS if shutil.which(name)), None)
        if command is None and find_spec("ziglang"):
            command = shlex.join([sys.executable, "-m", "ziglang", "cc"])
        if command is None:
            return NO_COMPILER
        os.environ |= {"CC": command, "LDSHARED": f"{command} -shared"}
    header = Path(sysconfig.get_path("include"), "Python.h")
    return "" if header.is_file() else NO_HEADERS.format(header)

"""The libraries that compute, of one build: what has to be loaded before any of them.

PyPI's dolfinx-solver-real has dolfinx, PETSc, SLEPc and their bindings in one wheel, and takes MPI from another one,
which has to be loaded first: importing ``dolfinx_solver`` does that.  Debian's packages need nothing of the kind.  Each
package of rodfem that computes imports this module before anything else.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from types import ModuleType


def _load() -> None:
    """Load MPI first if the libraries come from PyPI; raises :class:`SetupError` if they are of several builds."""
    if find_spec("dolfinx_solver") is None:
        return
    try:
        import_module("dolfinx_solver")
    except ImportError as mixed:
        from rodfem.errors import SetupError  # the first of all modules needs no other until then

        raise SetupError(
            f"The libraries here are of several builds ({str(mixed).partition('. ')[0]}): install rodfem in a new "
            "virtual environment, by 'pip install \"rodfem[pip]\"', which brings dolfinx-solver-real."
        ) from mixed


def optional(name: str, extra: str) -> ModuleType:
    """Import a library that only a part of rodfem needs, of an ``extra``; raises :class:`SetupError` without it."""
    try:
        return import_module(name)
    except ImportError as missing:
        from rodfem.errors import SetupError

        how = f'apt install python3-{name}, or pip install "rodfem[{extra}]"'
        raise SetupError(f"{name} is not installed: {how}.") from missing


_load()

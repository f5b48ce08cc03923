"""UFL without the package manager that it asks for its own version.

UFL 2022.2 and FFCx 0.5 import ``pkg_resources`` for that, which reads the metadata of all installed packages: as long
as everything else that they import.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.metadata import distribution
from types import ModuleType
from typing import Any

NAME = "pkg_resources"


@contextmanager
def without_pkg_resources() -> Iterator[None]:
    """Have a stand-in for ``pkg_resources`` inside the block, unless that is loaded already.

    It knows versions; whoever asks it for anything else gets that of the real one, which is loaded then.
    """
    stand_in = ModuleType(NAME)

    def real(name: str) -> Any:
        if sys.modules.get(NAME) is stand_in:
            del sys.modules[NAME]
        return getattr(import_module(NAME), name)

    stand_in.__dict__.update(get_distribution=distribution, __getattr__=real)
    sys.modules.setdefault(NAME, stand_in)
    try:
        yield
    finally:
        if sys.modules[NAME] is stand_in:
            del sys.modules[NAME]


with without_pkg_resources():
    import ufl  # noqa: F401

"""Methods to decide stability: a module each, whose class has its name (``shift_invert``: ``ShiftInvert``).

A module added here is a method: the names that errors and the command line list are those of the modules.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from rodfem.errors import InputError
from rodfem.lazy import attributes

if TYPE_CHECKING:
    from rodfem.stability.method import Method

AUTO = "auto"
"""Not a method: one is chosen."""
METHODS = tuple(module.name.replace("_", "-") for module in iter_modules(__path__))

__getattr__ = attributes("rodfem.stability.methods")


def find(name: str) -> type[Method]:
    """Class of a method; raises :class:`InputError` where there is none of that name."""
    if name not in METHODS:
        raise InputError(f"Unknown method {name!r}: choose one of {', '.join((AUTO, *METHODS))}.")
    module = import_module(f"{__name__}.{name.replace('-', '_')}")
    found: type[Method] = getattr(module, name.title().replace("-", ""))
    return found

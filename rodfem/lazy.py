"""Modules of a package as its attributes, loaded when they are used: ``help(rodfem.modes)``."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType


def submodule(package: str, name: str) -> ModuleType | None:
    """Module ``package.name``, loaded; None where there is none."""
    if name.startswith("_") or find_spec(f"{package}.{name}") is None:
        return None
    return import_module(f"{package}.{name}")


def attributes(package: str) -> Callable[[str], ModuleType]:
    """Return the ``__getattr__`` of a package that has nothing but modules."""

    def find(name: str) -> ModuleType:
        module = submodule(package, name)
        if module is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return module

    return find

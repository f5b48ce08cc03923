"""Names of the methods that decide stability, and where each has its class (``shift-invert``: ``ShiftInvert``)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from rodfem.errors import InputError

if TYPE_CHECKING:
    from rodfem.stability.methods import Method

AUTO = "auto"
"""Not a method: one is chosen."""
MODULES = {
    "cayley": "rodfem.kumar_healey.reduction",
    "count": "rodfem.stability.methods",
    "dense": "rodfem.stability.methods",
    "reduction": "rodfem.kumar_healey.reduction",
    "shift-invert": "rodfem.stability.methods",
    "slicing": "rodfem.stability.methods",
}
"""Module of each method, loaded when it is used."""
METHODS = tuple(MODULES)


def find(name: str) -> type[Method]:
    """Class of a method; raises :class:`InputError` where there is none of that name."""
    if name not in METHODS:
        raise InputError(f"Unknown method {name!r}: choose one of {', '.join((AUTO, *METHODS))}.")
    found: type[Method] = getattr(import_module(MODULES[name]), name.title().replace("-", ""))
    return found

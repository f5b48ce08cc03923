"""Is an equilibrium stable?  Inertia, eigensolvers, the paper's reduction, and one interface to all methods."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from rodfem import libraries  # noqa: F401, before all that computes
from rodfem.errors import InputError

if TYPE_CHECKING:
    from rodfem.stability.assessment import Method

AUTO = "auto"
"""Not a method: one is chosen."""
METHODS = {
    "cayley": "rodfem.kumar_healey.reduction",
    "count": "rodfem.stability.assessment",
    "dense": "rodfem.stability.assessment",
    "reduction": "rodfem.kumar_healey.reduction",
    "shift-invert": "rodfem.stability.assessment",
    "slicing": "rodfem.stability.assessment",
}
"""Methods that decide stability, and where each has its class (``ShiftInvert``), loaded when it is used."""


def find(name: str) -> type[Method]:
    """Class of a method; raises :class:`InputError` where there is none of that name."""
    if name not in METHODS:
        raise InputError(f"Unknown method {name!r}: choose one of {', '.join((AUTO, *METHODS))}.")
    found: type[Method] = getattr(import_module(METHODS[name]), name.title().replace("-", ""))
    return found

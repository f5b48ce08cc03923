"""Functions that a person states: what goes wrong in one of them becomes a sentence about the scene."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any

from rodfem.errors import SceneError
from rodfem.problem.roles import Role

HINTS = {
    "ordinate": "it receives arrays r (3,) and q (4,), and returns a number",
    "start": "it receives an array of arclengths (m,), and returns one (m, 4)",
}
UFL = "write it with UFL (ufl.cosh, ufl.conditional), without math, numpy and if"
RETURNS: dict[str, Callable[[Any], Any]] = {"ordinate": float}
"""Conversions of returned values, which may fail too."""


def guarded(what: str, function: Callable[..., Any], role: Role) -> Callable[..., Any]:
    """Return ``function`` such that all it raises is a :class:`SceneError` that names it."""
    if hasattr(function, "guards"):
        return function
    returns = RETURNS.get(role.words)

    @wraps(function)
    def call(*arguments: Any) -> Any:
        try:
            value = function(*arguments)
            return value if returns is None else returns(value)
        except SceneError:
            raise
        except Exception as trouble:  # whatever a person's function may raise
            first = str(trouble).split("\n", 1)[0].rstrip(".")
            raise SceneError(
                f"The {what} fails with {type(trouble).__name__}, {first!r}: {HINTS.get(what, UFL)}."
            ) from trouble

    call.guards = what  # type: ignore[attr-defined]
    return call

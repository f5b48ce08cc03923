"""Functions that a person states: what goes wrong in one of them becomes a sentence about the scene."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import wraps
from typing import TYPE_CHECKING, Any

from rodfem.ends import Ring
from rodfem.errors import SceneError

if TYPE_CHECKING:
    from rodfem.scene import Scene

HINTS = {
    "ordinate": "it receives arrays r (3,) and q (4,), and returns a number",
    "start": "it receives an array of arclengths (m,), and returns one (m, 4)",
}
UFL = "write it with UFL (ufl.cosh, ufl.conditional), without math, numpy and if"


def guarded(what: str, function: Callable[..., Any], returns: Callable[[Any], Any] | None = None) -> Callable[..., Any]:
    """Return ``function`` (or ``returns`` of it) such that all it raises is a :class:`SceneError` that names it."""
    if hasattr(function, "guards"):
        return function

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


def _guarded_fields(owner: Any, of: str, fields: Iterable[str]) -> Any:
    """Return a dataclass whose functions among these fields are guarded, as ``field of the left end``, say."""
    functions = {field: getattr(owner, field) for field in fields}
    return replace(
        owner,
        **{f: guarded(f.replace("_", " ") + of, function) for f, function in functions.items() if callable(function)},
    )


def _guarded_ordinate(scene: Scene) -> Callable[..., Any]:
    """Return the function of the ordinate, guarded: of numbers at a point, of UFL expressions along the rod."""
    of = scene.ordinate.of
    return guarded("ordinate", of, float) if scene.ordinate.places else guarded("ordinate along the rod", of)


def guards_of(scene: Scene) -> dict[str, Any]:
    """Fields of a scene with all its functions guarded."""
    end = ("position", "rotation", "force", "follower", "moment", "follower_moment", "energy")
    attached = ("force", "follower", "energy", "mass", "rotary_inertia")
    new: dict[str, Any] = {
        "attachments": tuple(_guarded_fields(x, " of an attachment", attached) for x in scene.attachments),
        "constraints": tuple(replace(x, of=guarded("constraint", x.of)) for x in scene.constraints),
        "ordinate": replace(scene.ordinate, of=_guarded_ordinate(scene)),
    }
    if not isinstance(scene.ends, Ring):
        pair = zip(("left", "right"), scene.ends, strict=True)
        new["ends"] = tuple(_guarded_fields(x, f" of the {side} end", end) for side, x in pair)
    words = {
        "energy": "stored energy",
        "potential": "potential along the rod",
        "distributed": "distributed force",
        "follower": "distributed follower force",
        "start": "start",
    }
    given = {field: getattr(scene, field) for field in words}
    return new | {field: guarded(words[field], f) for field, f in given.items() if f is not None}

"""The functions that a scene is made of, each declared once, at the field that holds it.

The ``metadata`` of a dataclass's field says under ``role`` that it holds a function and what for: a :class:`Role`, or a
function that returns one for the object that the field belongs to.  Under ``places`` are the words for where the
objects of a tuple are.  :func:`changes` walks a scene by these declarations alone, so that what checks functions,
guards them, makes terms of them or asks what they depend on cannot forget one.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import wraps
from logging import getLogger
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from rodfem.errors import SceneError

if TYPE_CHECKING:
    from rodfem.problem.contribution import Load

T = TypeVar("T")
Conversion = Callable[[Any], Any]
LOG_OF_UFL = getLogger("UFL")
UFL = "write it with UFL (ufl.cosh, ufl.conditional), without math, numpy and if"


MEANINGS = {
    "v": "v[0], v[1], v[2] are the strains",
    "k": "k[0], k[1], k[2] the curvatures and the twist",
    "x": "x has what is known of a place, as x.r",
    "c": "c has the scene's parameters, as c.P, and the arclength, c.s, numbers or expressions of UFL",
    "r": "r[0], r[1], r[2] are the position",
    "q": "q[0] to q[3] the rotation's quaternion",
}
"""What the arguments of the functions of a scene are."""


class UnnamedError(SceneError):
    """What a function of a scene does wrong; its words lack the subject, which :func:`guarded` has.

    A person reads ``The stored energy asks for a constant 'G': ...``.
    """


@dataclass(frozen=True)
class Role:
    """Purpose of a function of a scene.

    ``words`` have ``{}`` for where it is: ``force on the {} end``; ``call`` is ``f(c)`` of the constants, ``f(x, c)``
    of a place, or another.  It returns ``size`` components, 0 for a scalar, None if that is checked elsewhere; one may
    be None if there are ``gaps``.  Its place is the whole rod if it is ``along``; unless ``placed`` its constants lack
    the arclength.  ``or_value`` lets a constant stay as it is, ``load`` is the kind of load, ``hint`` how it is
    written, and ``returns`` converts its value.
    """

    words: str
    call: str
    size: int | None = None
    along: bool = False
    or_value: bool = False
    load: Load | None = None
    hint: str = UFL
    returns: Conversion | None = None
    gaps: bool = False
    placed: bool = True

    @property
    def arguments(self) -> int:
        """Number of its arguments."""
        return self.call.count(",") + 1

    @property
    def meanings(self) -> str:
        """What its arguments are, in words."""
        letters = self.call.partition("(")[2].rstrip(")").split(", ")
        return ", ".join(MEANINGS[letter] for letter in letters if letter in MEANINGS)


def role_field(role: Role | Callable[[Any], Role], default: Any = None) -> Any:
    """Field of a dataclass for a function of this role, or of the role that it has for the object; optional."""
    return field(default=default, metadata={"role": role})


class Placeless:
    """Constants without the arclength.

    What acts at an end is a number: as a function of ``c.s`` it would be one along the rod wherever the equations of a
    formulation have it under an integral.
    """

    def __init__(self, c: Any) -> None:
        """Be the constants ``c`` otherwise."""
        self._constants = c

    def __getattr__(self, name: str) -> Any:
        """Constant of a ``name``; raises :class:`UnnamedError` for the arclength."""
        if name == "s":
            raise UnnamedError("asks for the arclength c.s, but does not vary along the rod: write the number.")
        return getattr(self._constants, name)


Visit = Callable[[str, Any, Role], Any]


def guarded(what: str, function: Any, role: Role) -> Callable[..., Any]:
    """Return ``function`` such that all it raises is a :class:`SceneError` that names it; or one for a constant."""
    if hasattr(function, "guards"):
        return function
    if not callable(function):
        constant = function
        function = lambda c: constant  # noqa: E731

    @wraps(function)
    def call(*arguments: Any) -> Any:
        silent, LOG_OF_UFL.disabled = LOG_OF_UFL.disabled, True  # what it prints is in what it raises
        try:
            value = function(*arguments) if role.placed else function(*map(Placeless, arguments))
            return in_floats(value) if role.returns is None else role.returns(value)
        except UnnamedError as trouble:
            raise SceneError(f"The {what} {trouble}") from None
        except SceneError:
            raise
        except (Exception, SystemExit) as trouble:  # whatever a person's function may raise
            first = str(trouble).split("\n", 1)[0].rstrip(".")
            wrong = isinstance(trouble, AttributeError) or "subscriptable" in first
            hint = role.meanings if wrong and role.meanings else role.hint
            raise SceneError(f"The {what} fails with {type(trouble).__name__}, {first!r}: {hint}.") from trouble
        finally:
            LOG_OF_UFL.disabled = silent

    call.guards = what  # type: ignore[attr-defined]
    return call


def in_floats(value: Any) -> Any:
    """Replace fractions and numbers of numpy by floats, in tuples, lists and arrays, too, which UFL does not know."""
    if type(value) in (tuple, list):
        floats = type(value)(map(in_floats, value))
        return value if all(a is b for a, b in zip(floats, value, strict=True)) else floats
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
        return value.astype(float, copy=False)
    return float(value) if isinstance(value, Real) and not isinstance(value, (int, float)) else value


def derived(owner: Any, key: Hashable, make: Callable[[], T]) -> T:
    """Return what ``make()`` derives from an object that does not change, once, by its ``key``: it is kept with it.

    Of a function of a scene it is what does not depend on constants, and serves all scenes that have the function.
    """
    known: dict[Hashable, T] = vars(owner).setdefault("derived", {})
    if key not in known:
        known[key] = make()
    return known[key]


def functions_of(owner: Any, *, nested: bool = True) -> list[tuple[str, Callable[..., Any], Role]]:
    """All functions given in the fields of an object, and in what they hold if ``nested``: words, function, role."""
    found: list[tuple[str, Callable[..., Any], Role]] = []

    def note(what: str, function: Callable[..., Any], role: Role) -> Callable[..., Any]:
        found.append((what, function, role))
        return function

    changes(owner, note, nested=nested)
    return found


def changes(owner: Any, visit: Visit, place: str = "", *, nested: bool = True) -> dict[str, Any]:
    """Fields of a dataclass with each function ``f``, and all in what they hold, replaced by ``visit(words, f, role)``.

    ``owner`` is the dataclass, ``place`` says in words where it is in the scene.  A field's own default (None, say) is
    left out, and so is what is replaced by itself; unless ``nested`` only the dataclass's own fields are visited.
    """
    new = {}
    for f in fields(owner):
        value = getattr(owner, f.name)
        if value is not f.default and (nested or "role" in f.metadata):
            found = _visited(owner, f.metadata, value, visit, place)
            if found is not value:
                new[f.name] = found
    return new


def _visited(owner: Any, declared: Any, value: Any, visit: Visit, place: str) -> Any:
    role = declared.get("role")
    if role is not None:
        role = role if isinstance(role, Role) else role(owner)
        if role.or_value and not callable(value):
            return in_floats(value)
        return visit(role.words.format(place), value, role)
    if is_object(value):
        return _changed(value, visit, place)
    if isinstance(value, (tuple, list)) and any(map(is_object, value)):
        places = declared.get("places") or ("",) * len(value)
        found = tuple(_changed(x, visit, where) for x, where in zip(value, places, strict=True))
        return found if any(a is not b for a, b in zip(found, value, strict=True)) else value
    return value


def _changed(owner: Any, visit: Visit, place: str) -> Any:
    new = changes(owner, visit, place)
    return replace(owner, **new) if new else owner


def is_object(value: Any) -> bool:
    """Whether a value is an object of a dataclass."""
    return is_dataclass(value) and not isinstance(value, type)

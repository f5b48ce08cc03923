"""The functions that a scene is made of: what each is for, its arguments, and the words on what it does wrong.

The ``metadata`` of a dataclass's field has under ``role`` the :class:`Role` of the function that the field holds, or a
function that returns one for the object, and under ``places`` the words for where the objects of a tuple are.
:func:`changes` walks a scene by these declarations alone.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import lru_cache, wraps
from logging import getLogger
from math import sqrt
from numbers import Real
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.forms.rotation import IDENTITY, rotation

if TYPE_CHECKING:
    from rodfem.problem.contribution import Load
    from rodfem.problem.scene import Scene

T = TypeVar("T")
Place = SimpleNamespace
Quaternion = tuple[float, float, float, float]
Given: TypeAlias = Any  # a function of the constants ``c``, or a constant in the place of one; None if there is none
SIDES, LETTERS = ("left", "right"), "ab"  # the two ends in words, and in names of unknowns
PLACES = 1001  # arclengths at which a start is evaluated
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
    """What a function of a scene does wrong; :func:`guarded` puts the subject before its words."""


# --- what a function is for


@dataclass(frozen=True)
class Role:
    """Purpose of a function of a scene.

    ``words`` have ``{}`` for where it is: ``force on the {} end``; ``call`` is ``f(c)`` of the constants, ``f(x, c)``
    of a place, or another.  It returns ``size`` components, 0 for a scalar, None if that is checked elsewhere; one may
    be None if there are ``gaps``.  Its place is the whole rod if it is ``along``; unless ``placed`` it must not ask for
    the arclength.  ``or_value`` lets a constant stay as it is, ``returns`` converts its value.
    """

    words: str
    call: str
    size: int | None = None
    along: bool = False
    or_value: bool = False
    load: Load | None = None
    hint: str = UFL
    returns: Callable[[Any], Any] | None = None
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

    def failure(self, trouble: BaseException) -> str:
        """What a function raises, in words, and how it is written."""
        first = str(trouble).split("\n", 1)[0].rstrip(".")
        wrong = isinstance(trouble, AttributeError) or "subscriptable" in first
        return f"{type(trouble).__name__}, {first!r}: {(wrong and self.meanings) or self.hint}"


def role_field(role: Role | Callable[[Any], Role], default: Any = None) -> Any:
    """Field of a dataclass for a function of this role, or of the role that it has for the object; optional."""
    return field(default=default, metadata={"role": role})


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
            value = function(*arguments)
            return in_floats(value) if role.returns is None else role.returns(value)
        except UnnamedError as trouble:
            raise SceneError(f"The {what} {trouble}") from None
        except SceneError:
            raise
        except (Exception, SystemExit) as trouble:  # whatever a person's function may raise
            raise SceneError(f"The {what} fails with {role.failure(trouble)}.") from trouble
        finally:
            LOG_OF_UFL.disabled = silent

    call.guards = what  # type: ignore[attr-defined]
    return call


def in_floats(value: Any) -> Any:
    """Replace fractions and numbers of numpy, which UFL does not know, by floats, also in tuples, lists and arrays."""
    if type(value) is float:  # most are
        return value
    if type(value) in (tuple, list):
        floats = type(value)(map(in_floats, value))
        return value if all(a is b for a, b in zip(floats, value, strict=True)) else floats
    if isinstance(value, np.ndarray) and value.dtype.kind in "iuf":
        return value.astype(float, copy=False)
    return float(value) if isinstance(value, Real) and not isinstance(value, (int, float)) else value


def derived(owner: Any, key: Hashable, make: Callable[[], T]) -> T:
    """Return what ``make()`` derives from an object that does not change, once, by its ``key``: it is kept with it."""
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


def changes(
    owner: Any, visit: Callable[[str, Any, Role], Any], place: str = "", *, nested: bool = True
) -> dict[str, Any]:
    """Fields of a dataclass in which functions, and all that they hold, are replaced by ``visit(words, f, role)``."""
    new = {}
    for f in fields(owner):
        value, role = getattr(owner, f.name), f.metadata.get("role")
        if value is f.default or not (nested or role):
            continue
        if role is None:
            found = _changed(value, visit, place, f.metadata.get("places"))
        else:
            role = role if isinstance(role, Role) else role(owner)
            constant = role.or_value and not callable(value)
            found = in_floats(value) if constant else visit(role.words.format(place), value, role)
        if found is not value:
            new[f.name] = found
    return new


def _changed(value: Any, visit: Callable[[str, Any, Role], Any], place: str, places: Sequence[str] | None) -> Any:
    if isinstance(value, (tuple, list)):
        pairs = zip(value, places or ("",) * len(value), strict=True)
        parts = tuple(_changed(x, visit, where, None) for x, where in pairs)
        return parts if any(a is not b for a, b in zip(parts, value, strict=True)) else value
    new = changes(value, visit, place) if is_dataclass(value) and not isinstance(value, type) else {}
    return replace(value, **new) if new else value


# --- constants, and the state of the rod at a place


FRACTIONS = tuple(sorted(i * (sqrt(5.0) - 1.0) / 2.0 % 1.0 for i in range(1, 8)))
"""Parts of an interval, multiples of the golden section: a polynomial or a sine with zeros at simple fractions of the
interval, or of a number near to it, has none there."""
STATES = (
    ((0.5, 0.1, 0.7, 0.5), (0.2, 0.3, 0.4), (0.01, 0.02, 1.01), (0.1, 0.2, 0.3)),
    ((0.7, -0.1, 0.1, 0.7), (-0.2, 0.1, 0.9), (-0.02, 0.01, 0.97), (-0.3, 0.1, 0.2)),
    (IDENTITY, (0.0, 0.0, 0.5), UNDEFORMED, (0.0, 0.0, 0.0)),
)
"""Quaternion, centreline, strain and curvature at which functions of a place are tried, lengths relative to the rod's;
the last is undeformed."""


def inside(interval: tuple[float, float]) -> list[float]:
    """Return numbers inside an ``interval`` at which a function that is not zero there is seen not to be."""
    low, high = interval
    return [low + part * (high - low) for part in FRACTIONS]


class Constants(SimpleNamespace):
    """The named constants of a scene and the arclength ``s``; an unknown name is a :class:`SceneError`."""

    def __getattr__(self, name: str) -> Any:
        """Name what is missing, and what there is."""
        if name.startswith("__"):
            raise AttributeError(name)
        known = [*(f"c.{x}" for x in sorted(vars(self)) if x != "s"), "c.s (the arclength)"]
        raise UnnamedError(f"asks for a constant {name!r}: add it, or choose one of {', '.join(known)}.")


OfPlace = Callable[[Place, Constants], Any]


class CheckedPlace(SimpleNamespace):
    """A place; an attribute that it does not have is a :class:`SceneError`."""

    def __getattr__(self, name: str) -> Any:
        """Say what a place has."""
        if name.startswith("__"):
            raise AttributeError(name)
        if name in ("r", "dr") and "r" not in vars(self):
            raise SceneError("Reduced formulations have no centreline: use Discretization(formulation='pointwise').")
        has = "r, q, R, d1, d2, d3, s and length, and where it is the whole rod dr, v and k"
        raise UnnamedError(f"asks for {name!r} of a place: it has {has}.")


def place(q: Any, R: Any, s: Any, r: Any = None, **more: Any) -> Place:
    """Make a place of quaternion ``q``, rotation ``R``, arclength ``s``, centreline ``r`` (None: none) and ``more``."""
    d = {f"d{i + 1}": ufl.as_vector([R[j, i] for j in range(3)]) for i in range(3)}
    return CheckedPlace(q=q, R=R, s=s, **d, **({} if r is None else {"r": r}), **more)


def some_places(scene: Scene, wrap: Callable[[Any], Any] | None = None, s: float | None = None) -> tuple[Place, Place]:
    """A point and a place along the rod in the first of :data:`STATES`, by default at an ``s`` inside the rod."""
    given = scene.length, inside(scene.interval)[0] if s is None else s, STATES[0]
    return numbers_at(*given) if wrap is None else places_at(*given, wrap)


def places_at(
    length: float, s: float, state: Sequence[Any], wrap: Callable[[Any], Any] = lambda x: x
) -> tuple[Place, Place]:
    """Return a point and a place along the rod of a ``length``, in a ``state`` given as :data:`STATES` are."""
    units = (1.0, length, 1.0, 1.0 / length)
    numbers = ([float(unit * x) for x in values] for unit, values in zip(units, state, strict=True))
    q, r, v, k = (wrap(ufl.as_vector(values)) for values in numbers)
    R = rotation(q)
    return place(q, R, s, r, length=length), place(q, R, s, r, dr=wrap(ufl.dot(R, v)), v=v, k=k, length=length)


numbers_at = lru_cache(32)(places_at)
"""The same, made once: all functions of a scene are tried in the same states."""

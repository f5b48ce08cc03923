"""Arguments of the functions of a scene: its named constants, and the state of the rod at a place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from math import sqrt
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

import ufl

from rodfem.errors import POINTWISE, SceneError
from rodfem.forms.kinematics import UNDEFORMED
from rodfem.forms.rotation import IDENTITY, rotation
from rodfem.problem.roles import UnnamedError, functions_of

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


FRACTIONS = tuple(sorted(i * (sqrt(5.0) - 1.0) / 2.0 % 1.0 for i in range(1, 8)))
"""Parts of an interval, multiples of the golden section: a polynomial or a sine with zeros at simple fractions of the
interval, or of a number near to it, has none there."""


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
        known = [f"c.{x}" for x in sorted(vars(self)) if x != "s"]
        raise UnnamedError(
            f"asks for a constant {name!r}: add it to the parameters, or choose one of "
            f"{', '.join([*known, 'c.s (the arclength)'])}."
        )


def watched(c: Constants) -> tuple[Constants, set[str]]:
    """Return the same constants, and the set of names that they will have been asked for."""
    asked: set[str] = set()

    class Watched(Constants):
        def __getattribute__(self, name: str) -> Any:
            asked.add(name)
            return super().__getattribute__(name)

    return Watched(**vars(c)), asked


Place = SimpleNamespace
Vector = Sequence[Any]
OfConstants = Callable[[Constants], Vector]
Given: TypeAlias = Any
"""A function of the constants ``c``, or a constant in the place of one; None if there is none."""
OfPlace = Callable[[Place, Constants], Any]
Quaternion = tuple[float, float, float, float]


class NoCentreline(SceneError):
    """A function of a place asked for the centreline where there is none."""


class Known(SimpleNamespace):
    """A place; an attribute that it does not have is a :class:`SceneError`."""

    def __getattr__(self, name: str) -> Any:
        """Say what a place has."""
        if name.startswith("__"):
            raise AttributeError(name)
        raise UnnamedError(
            f"asks for {name!r} of a place: it has r, q, R, d1, d2, d3, s and length, and where it is the "
            "whole rod dr, v and k."
        )


class Reduced(Known):
    """Place of the reduced formulation: it knows rotations and strains, not where the rod is."""

    def __getattr__(self, name: str) -> Any:
        """Raise :class:`NoCentreline` for ``r`` and ``dr``."""
        if name in ("r", "dr"):
            raise NoCentreline("The reduced formulation has no centreline here", POINTWISE)
        return super().__getattr__(name)


def place(q: Any, R: Any, s: Any, r: Any = None, **more: Any) -> Place:
    """Make a place of quaternion ``q``, rotation ``R``, arclength ``s``, centreline ``r`` (None: none) and ``more``."""
    d = {f"d{i + 1}": ufl.as_vector([R[j, i] for j in range(3)]) for i in range(3)}
    kind = Reduced if r is None else Known
    known = {} if r is None else {"r": r}
    return kind(q=q, R=R, s=s, **d, **known, **more)


def needs_centreline(scene: Scene) -> str:
    """Say what in a scene needs the centreline as a field, in words; empty where nothing does."""
    c, inner = scene.constants(), scene.is_inside
    attached = [x for x in scene.attachments if inner(x.s)]
    for what, needs in (
        ("the mass of a rod under a load without potential", not scene.conservative),
        ("a distributed force", scene.distributed is not None),
        ("what is attached along the rod", any(x.force or x.mass for x in attached)),
        ("the mass of the rod", scene.inertia.rho_A(c) != 0),
        ("a rod that nothing holds, with more than dead forces at its ends,", floats(scene) and not all(scene.plain)),
    ):
        if needs:
            return what
    functions = [("the potential along the rod", scene.potential)]
    functions += [("the ordinate", None if scene.ordinate.places else scene.ordinate.of)]
    functions += [("what is attached along the rod", x.energy) for x in attached]
    functions += [("a constraint", x.of) for x in scene.constraints if x.s is None or inner(x.s)]
    return next((what for what, function in functions if function and asks_where(function, c)), "")


def floats(scene: Scene) -> bool:
    """Whether nothing holds the rod where it is: no end, no spring, no constraint."""
    c = scene.constants()
    if scene.closed or any(len(end.fixed(c)) for end in scene.sides):
        return False
    return not any(asks_where(function, c) for _, function, _ in functions_of_places(scene))


def asks_where(function: OfPlace, c: Constants) -> bool:
    """Whether a function of a place depends on where the rod is."""
    q = ufl.as_vector([ufl.as_ufl(x) for x in IDENTITY])
    strains = {"v": ufl.as_vector(UNDEFORMED), "k": ufl.as_vector([0.0, 0.0, 0.0]), "length": 1.0}
    try:
        function(place(q, rotation(q), c.s, **strains), c)
    except NoCentreline:
        return True
    return False


STATES = (
    ((0.5, 0.1, 0.7, 0.5), (0.2, 0.3, 0.4), (0.01, 0.02, 1.01), (0.1, 0.2, 0.3)),
    ((0.7, -0.1, 0.1, 0.7), (-0.2, 0.1, 0.9), (-0.02, 0.01, 0.97), (-0.3, 0.1, 0.2)),
    (IDENTITY, (0.0, 0.0, 0.5), UNDEFORMED, (0.0, 0.0, 0.0)),
)
"""Quaternion, centreline, strain and curvature at which functions of a place are tried; the last is undeformed.

Lengths are relative to the rod's.
"""


def functions_of_places(scene: Scene) -> Iterator[tuple[str, OfPlace, Place]]:
    """Functions of a place in the equations, each with a place of the kind that it will be given, without numbers."""
    point, rod = some_places(scene, wrap=ufl.variable)
    for what, function, role in functions_of(scene):
        if role.call == "f(x, c)":
            yield what, function, rod if role.along else point


def some_places(
    scene: Scene, state: int = 0, wrap: Callable[[Any], Any] | None = None, s: float | None = None
) -> tuple[Place, Place]:
    """Return a point and a place along the rod of a ``scene``; vectors pass through ``wrap``, if it is given.

    The ``state`` is the number of one of :data:`STATES`.  The arclength ``s`` is by default one inside the rod: at an
    end a factor may vanish, or a logarithm have its pole.
    """
    s = inside(scene.interval)[0] if s is None else s
    return _known_places(scene.length, state, s) if wrap is None else _places(scene.length, state, s, wrap)


def _places(length: float, state: int, s: float, wrap: Callable[[Any], Any] = lambda x: x) -> tuple[Place, Place]:
    return places_at(length, s, STATES[state], wrap)


_known_places = lru_cache(maxsize=64)(_places)
"""The same, made once: each check of a scene asks for these places."""


def places_at(
    length: float, s: float, state: Sequence[Any], wrap: Callable[[Any], Any] = lambda x: x
) -> tuple[Place, Place]:
    """Return a point and a place along the rod of a ``length``, in a ``state`` given as :data:`STATES` are.

    ``s`` is the arclength; vectors pass through ``wrap``.
    """
    units = (1.0, length, 1.0, 1.0 / length)
    numbers = ([float(unit * x) for x in values] for unit, values in zip(units, state, strict=True))
    q, r, v, k = (wrap(ufl.as_vector(values)) for values in numbers)
    R = rotation(q)
    return place(q, R, s, r, length=length), place(q, R, s, r, dr=ufl.dot(R, v), v=v, k=k, length=length)


def asked_for(scene: Scene, c: Constants | None = None) -> set[str]:
    """Names of the constants ``c``, by default the scene's own, that the equations of a scene ask for."""
    c, asked = watched(c or scene.constants())
    for _, function, role in functions_of(scene):
        if role.call == "f(c)":
            function(c)
    for _, function, known in functions_of_places(scene):
        function(known, c)
    scene.energy(ufl.as_vector(UNDEFORMED), ufl.as_vector([0.0, 0.0, 0.0]), c)
    return asked

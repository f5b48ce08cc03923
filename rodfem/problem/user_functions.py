"""The functions that a scene is made of: all that a person gave, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import ufl

from forms.kinematics import UNDEFORMED
from forms.rotation import IDENTITY, rotation
from rodfem.problem.ends import Constants
from rodfem.problem.local_state import NoCentreline, place
from rodfem.problem.roles import Role, changes

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


def functions_of(scene: Scene) -> list[tuple[str, Callable[..., Any], Role]]:
    """All functions of a scene that are given: what each is in words, the function, its role."""
    found: list[tuple[str, Callable[..., Any], Role]] = []

    def note(what: str, function: Callable[..., Any], role: Role) -> Callable[..., Any]:
        found.append((what, function, role))
        return function

    changes(scene, note)
    return found


def functions_of_places(scene: Scene) -> Iterator[tuple[str, Callable[..., Any], Any]]:
    """Functions of a place in the equations, each with a place of the kind that it will be given."""
    point, rod = some_places(scene)
    for what, function, role in functions_of(scene):
        if role.call == "f(x, c)":
            yield what, function, rod if role.along else point


def some_places(scene: Scene) -> tuple[Any, Any]:
    """Return a point and a place along the rod: some rotation, strains, position."""
    q = ufl.as_vector([0.5, 0.1, 0.7, 0.5])
    R = rotation(q)
    r, strains = ufl.as_vector([0.2, 0.3, 0.4]), (ufl.as_vector([0.01, 0.02, 1.01]), ufl.as_vector([0.1, 0.2, 0.3]))
    point = place(q, R, scene.interval[0], r, length=scene.length)
    rod = place(q, R, scene.interval[0], r, dr=ufl.dot(R, strains[0]), v=strains[0], k=strains[1], length=scene.length)
    return point, rod


def asked_for(scene: Scene) -> set[str]:
    """Names of the constants that the equations of a scene ask for."""
    asked: set[str] = set()

    class Watched(Constants):
        def __getattribute__(self, name: str) -> Any:
            asked.add(name)
            return super().__getattribute__(name)

    c = Watched(**vars(scene.constants()))
    for _, function, role in functions_of(scene):
        if role.call == "f(c)":
            function(c)
    for _, function, known in functions_of_places(scene):
        function(known, c)
    scene.energy(ufl.as_vector(UNDEFORMED), ufl.as_vector([0.0, 0.0, 0.0]), c)
    return asked


def asks_where(function: Callable[..., Any], c: Any) -> bool:
    """Whether a function of a place depends on where the rod is."""
    q = ufl.as_vector([ufl.as_ufl(x) for x in IDENTITY])
    strains = {"v": ufl.as_vector(UNDEFORMED), "k": ufl.as_vector([0.0, 0.0, 0.0]), "length": 1.0}
    try:
        function(place(q, rotation(q), 0.0, **strains), c)
    except NoCentreline:
        return True
    return False

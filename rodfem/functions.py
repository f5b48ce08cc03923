"""The functions that a scene is made of: all that a person gave, and what they ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import ufl

from forms.kinematics import UNDEFORMED
from forms.rotation import IDENTITY, rotation
from rodfem.ends import Constants
from rodfem.places import NoCentreline, place

if TYPE_CHECKING:
    from rodfem.scene import Scene


def functions_of(scene: Scene) -> Iterator[tuple[str, Callable[..., Any], str]]:
    """All functions of a scene that are given: what each is in words, the function, how it is called."""
    along: list[tuple[str, Any, str]] = [
        ("stored energy", scene.energy, "W(v, k, c)"),
        ("start", scene.start, "start(s)"),
        ("ordinate", scene.ordinate.of, "of(r, q)")
        if scene.ordinate.places
        else ("ordinate along the rod", scene.ordinate.of, "of(x, c)"),
        ("distributed force", scene.distributed, "f(c)"),
        ("distributed follower force", scene.follower, "f(c)"),
        ("potential along the rod", scene.potential, "f(x, c)"),
        ("mass per length", scene.inertia.rho_A, "f(c)"),
        ("rotary inertia per length", scene.inertia.rho_I, "f(c)"),
    ]
    for side, end in zip(("left", "right"), scene.sides, strict=True):
        of_constants = {"position of": end.position, "force on": end.force, "follower force on": end.follower}
        of_constants |= {"moment on": end.moment, "follower moment on": end.follower_moment}
        along += [(f"{what} the {side} end", f, "f(c)") for what, f in of_constants.items()]
        along.append((f"energy of the {side} end", end.energy, "f(x, c)"))
    for x in scene.attachments:
        of_constants = {"force": x.force, "follower force": x.follower, "mass": x.mass, "inertia": x.rotary_inertia}
        along += [(f"{what} of an attachment", f, "f(c)") for what, f in of_constants.items()]
        along.append(("energy of an attachment", x.energy, "f(x, c)"))
    for constraint in scene.constraints:
        along.append(("constraint", constraint.of, "f(x, c)"))
        along.append(("value of an integral constraint", getattr(constraint.of, "equals", None), "f(c)"))
    for what, function, wanted in along:
        if function is not None:
            yield what, function, wanted


def functions_of_places(scene: Scene) -> Iterator[tuple[str, Callable[..., Any], Any]]:
    """Functions of a place in the equations, each with a place of the kind that it will be given."""
    point, rod = some_places(scene)
    for what, function, wanted in functions_of(scene):
        if wanted == "f(x, c)" and what != "constraint":
            yield what, function, rod if "along" in what else point
    for x in scene.constraints:
        yield "constraint", getattr(x.of, "of", x.of), point if x.kind == "point" else rod


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
    for _, function, wanted in functions_of(scene):
        if wanted == "f(c)":
            function(c)
    for _, function, known in functions_of_places(scene):
        function(known, c)
    for end in scene.sides:
        if callable(end.rotation):
            end.rotation(c)
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

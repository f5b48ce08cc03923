"""The state of a rod at a place, as the functions of a scene receive it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import ufl

from forms.kinematics import UNDEFORMED
from forms.rotation import IDENTITY, rotation
from rodfem.errors import POINTWISE, SceneError
from rodfem.problem.ends import Place

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


class NoCentreline(SceneError):
    """A function of a place asked for the centreline where there is none."""


class Known(SimpleNamespace):
    """A place; asking for what it does not have is a :class:`SceneError`."""

    def __getattr__(self, name: str) -> Any:
        """Say what a place has."""
        if name.startswith("__"):
            raise AttributeError(name)
        raise SceneError(
            f"A function of a place asks for {name!r}: it has r, q, R, d1, d2, d3, s and length, and where it is the "
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
    """Make a place from quaternion, rotation, arclength, centreline (None: there is none) and what else is known."""
    d = {f"d{i + 1}": ufl.as_vector([R[j, i] for j in range(3)]) for i in range(3)}
    kind = Reduced if r is None else Known
    known = {} if r is None else {"r": r}
    return kind(q=q, R=R, s=s, **d, **known, **more)


def needs_centreline(scene: Scene) -> str:
    """Say what in a scene needs the centreline as a field, in words; empty where nothing does."""
    if not scene.conservative:
        return "the mass of a rod under a load without potential"
    if scene.distributed is not None:
        return "a distributed force"
    c, inner = scene.constants(), scene.joints
    if any(x.s in inner and (x.force or x.mass) for x in scene.attachments):
        return "what is attached along the rod"
    if scene.inertia.rho_A(c) != 0:
        return "the mass of the rod"
    q = ufl.as_vector([ufl.as_ufl(x) for x in IDENTITY])
    known = {"v": ufl.as_vector(UNDEFORMED), "k": ufl.as_vector([0.0, 0.0, 0.0]), "length": scene.length}
    along = place(q, rotation(q), scene.interval[0], **known)
    functions = [("the potential along the rod", scene.potential)] if scene.potential else []
    functions += [] if scene.ordinate.places else [("the ordinate", scene.ordinate.of)]
    functions += [("what is attached along the rod", x.energy) for x in scene.attachments if x.energy and x.s in inner]
    functions += [("a constraint", x.of) for x in scene.constraints if x.s is None or x.s in inner]
    for what, function in functions:
        try:
            function(along, c)
        except NoCentreline:
            return what
    return ""

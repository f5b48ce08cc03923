"""Scalar functions of the equations at a place, as expressions of symbols of the state there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.forms.kinematics import curvature, strain
from rodfem.forms.rotation import rotation
from rodfem.problem.local_state import Constants, Place, place
from rodfem.problem.roles import functions_of
from rodfem.problem.values import Symbol, Values

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

Places = dict[Symbol, np.ndarray]


class LocalState:
    """Symbols of a state at a place: quaternion ``q``, ``r``, free strains ``v``, curvatures ``k``, arclength ``s``.

    ``units`` has the units of those that are the state's, and ``parameters`` the symbols of the scene's, by name.
    """

    def __init__(self, scene: Scene) -> None:
        """Make symbols for a place of a ``scene``."""
        self.q, self.r, self.k = ([Symbol() for _ in range(n)] for n in (4, 3, 3))
        self.v, self.s = [Symbol() for _ in scene.free_strains], Symbol()
        self.parameters = {name: Symbol() for name in scene.parameters}
        length = scene.length
        self.units = dict.fromkeys([*self.q, *self.v], 1.0) | dict.fromkeys(self.r, length)
        self.units |= dict.fromkeys(self.k, 1.0 / length)
        self._slopes = [Symbol() for _ in range(4)]

    @property
    def constants(self) -> Constants:
        """The scene's parameters and the arclength, as functions of a place receive them."""
        return Constants(s=self.s, **self.parameters)

    def curvatures(self, q: Places, slopes: np.ndarray) -> Places:
        """Curvatures of quaternions ``q`` with these ``slopes`` (4, places), by their symbols."""
        known = q | dict(zip(self._slopes, slopes, strict=True))
        return {symbol: of(known) for symbol, of in zip(self.k, self._curvatures, strict=True)}

    @cached_property
    def _curvatures(self) -> list[Values]:
        k = curvature(ufl.as_vector(self.q), ufl.as_vector(self._slopes))
        return [Values(k[i]) for i in range(3)]


@dataclass(frozen=True)
class Pointwise:
    """A scalar ``function`` of a place, in words ``what``; all along the rod, or at the arclength ``s``."""

    what: str
    s: float | None
    function: Any


def along_rod(scene: Scene, at: LocalState) -> Place:
    """Place of the whole rod, of the symbols ``at`` it."""
    q, r, k = (ufl.as_vector(x) for x in (at.q, at.r, at.k))
    v, R = strain(scene.free_strains, at.v), rotation(q)
    return place(q, R, at.s, r, dr=ufl.dot(R, v), v=v, k=k, length=scene.length)


def pointwise(scene: Scene, at: LocalState) -> Iterator[Pointwise]:
    """Stored energy, potentials and constraints of a ``scene`` as functions of the symbols ``at`` a place."""
    c, along = at.constants, along_rod(scene, at)
    yield Pointwise("stored energy", None, scene.energy(along.v, along.k, c))
    for part in scene.parts:
        x = along if part.s is None else place(along.q, along.R, at.s, along.r, length=scene.length)
        for what, function, role in functions_of(part.of, nested=False):
            if role.call == "f(x, c)":
                value = function(x, c)
                for component in value if isinstance(value, list | tuple) else [value]:
                    yield Pointwise(_named(scene, part, what), part.s, component)


def _named(scene: Scene, part: Any, what: str) -> str:
    """Words for a function of a ``part``: an end is named by its side."""
    sides = [side for side, end in zip(("left", "right"), scene.sides, strict=True) if end is part.of]
    return what.replace("of the  end", f"of the {sides[0]} end").format(sides[0]) if sides else what

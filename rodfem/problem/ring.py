"""A closed rod: two ends that are joined to each other."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.problem.contribution import UNIT, Block, Group, Motion, Site, Unknown
from rodfem.problem.end import End
from rodfem.problem.kinds import flag

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants
    from rodfem.problem.scene import Scene

CLOSING_MOMENT = Group(
    "t", "closing moment", "closing of the ring's rotation, component {}", Motion.CLOSING, moment=True
)
CLOSING_FORCE = Group("f", "closing force", "closing of the ring along e{}", Motion.CLOSING)


@dataclass(frozen=True)
class Ring:
    """Both ends joined to each other, with equal directors: a closed rod.

    Where the directors turn about the closed rod an odd number of times in all (a circle without twist: once), its
    quaternion changes sign, ``q(l) = -q(0)``; with ``odd = False`` it does not.  The number itself, and with it the
    link, is that of the scene's ``start``.
    """

    odd: bool = True

    def __post_init__(self) -> None:
        """Check the kind; raises :class:`InputError`."""
        flag("odd", self.odd)

    def __iter__(self) -> Iterator[End]:
        """Yield the left and the right end."""
        for last in (False, True):
            yield JoinedEnd(sign=-1.0 if self.odd else 1.0, last=last)


@dataclass(frozen=True)
class JoinedEnd(End):
    """One end of a closed rod: nothing but the other end holds it.

    Multipliers close ``q(l) = +-q(0)`` and, with a centreline, ``r(l) = r(0)``.  In a plane the angle grows by the
    whole number of turns that the scene's start makes.
    """

    sign: float = 1.0
    last: bool = False
    closed = True

    def clamps(self, block: Block, c: Constants) -> list[bool]:
        """Nothing but one multiplier of the unit norm: that of ``q(l) = +-q(0)`` is that of ``q(0)``."""
        return [self.last and block.name == "eta"]

    def contact_force(self, c: Constants) -> list[Any]:
        """No component is known."""
        return [None] * 3

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Moments and forces that close the rod, the same of both ends."""
        moments = [Unknown(CLOSING_MOMENT, i) for i in range(4 if normal is None else 1)]
        return moments + [Unknown(CLOSING_FORCE, i, UNIT[i]) for i in range(3) if centreline and i != normal]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Share of this end in the equations of closure, with their multipliers."""
        turned, size = (ufl.as_vector([at.turned]), 1) if at.whole is not None else (at.turned, 4)
        if self.last and at.whole is not None:
            yield -at.y[0] * at.whole
        sign = 1.0 if self.last else -1.0
        yield (sign if self.last or at.whole is not None else -self.sign) * _dot(at.y[:size], turned, range(size))
        if len(at.y) > size:
            yield sign * _dot(at.y[size:], at.x.r, at.free)

    def check(self, side: str, scene: Scene) -> None:
        """Check that the start of the ring closes; raises :class:`SceneError`."""
        if scene.start is None:
            raise SceneError("A ring has no straight start: give its rotation as a function start(s).")
        first, last = scene.start(np.array(scene.interval))
        if self.sign * (first @ last) <= 0:
            raise SceneError(
                f"The start of the ring does not end as it begins: make q(l) = {self.sign:+g} q(0), or choose "
                f"Ring(odd={self.sign > 0})."
            )


def _dot(multipliers: Any, values: Any, components: Any) -> Any:
    return sum(y * values[i] for y, i in zip(multipliers, components, strict=True))

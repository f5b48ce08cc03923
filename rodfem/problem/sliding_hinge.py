"""A hinge that slides along a fixed direction."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.errors import SceneError
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.contribution import Direction, Group, Motion, Site, Unknown
from rodfem.problem.end import LETTERS, SIDES, End, across
from rodfem.problem.kinds import function, reals

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, OfConstants, Quaternion
    from rodfem.problem.scene import Scene

SLIGHT = 1e-14
"""Component of a unit vector that is taken for zero."""


@dataclass(frozen=True)
class SlidingHinge(End):
    """End that turns about the axis ``hinge``, and whose ``position`` slides along a direction ``along`` of space.

    Components of the position across which the direction is are held.  Forces of the guide, scalar unknowns, keep the
    others on it: as many as there are, less one.
    """

    along: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def guide(self) -> Direction:
        """Unit vector of the direction."""
        return tuple((np.array(self.along) / np.linalg.norm(self.along)).tolist())

    def held(self, c: Constants) -> list[Any]:
        """Position of the end: None in the components that move."""
        return [None if t else p for t, p in zip(self.along, super().held(c), strict=True)]

    def fixed(self, c: Constants) -> np.ndarray:
        """Directions across the guide, (2, 3)."""
        return np.array(across(self.along))

    @property
    def dead(self) -> bool:
        """Whether there is no force of the guide, nor an energy."""
        return super().dead and not self._guiding()

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Moments of the hinge, and forces of the guide."""
        words = f"force of the guide at the {SIDES[number]} end"
        group = Group(f"f{LETTERS[number]}", words, "guide of an end, direction {}", Motion.MIXED)
        forces = [Unknown(group, i, direction) for i, direction in enumerate(self._guiding())]
        return super().unknowns(number, normal, centreline) + forces

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Terms of the hinge, and the distance from the guide with its forces."""
        yield from super().lagrangian(at)
        guiding, point = self._guiding(), super().held(at.c)
        for force, direction in zip(at.y[len(at.y) - len(guiding) :], guiding, strict=True):
            yield force * sum(d * (at.x.r[i] - point[i]) for i, d in enumerate(direction) if d)

    def _guiding(self) -> list[Direction]:
        """Unit vectors across the direction, among the components that move."""
        moving = np.flatnonzero(self.along)
        vectors = np.linalg.svd(np.array([self.along], dtype=float)[:, moving])[2][1:]
        return [tuple(map(float, row)) for row in vectors @ np.eye(3)[moving]]

    def check(self, side: str, scene: Scene) -> None:
        """Check the direction, and the point, beside what is checked of every end; raises :class:`SceneError`."""
        if scene.normal is not None and self.along[scene.normal]:
            raise SceneError(
                f"The guide of the {side} end leaves the plane across {scene.planar}: choose a direction in the plane."
            )
        super().check(side, scene)
        if None in super().held(scene.constants()):
            raise SceneError(f"The guide of the {side} end has no place: give three components of a point on it.")


def sliding_hinge(
    axis: tuple[float, float, float],
    along: tuple[float, float, float],
    position: OfConstants = lambda c: (0.0, 0.0, 0.0),
    rotation: Quaternion | OfConstants = IDENTITY,
    force: Callable[[Constants], Any] | None = None,
) -> SlidingHinge:
    """Return an end that turns about one ``axis`` only, and slides along a direction of space.

    ``axis`` is given along the directors of ``rotation``, ``along`` in space, any vector but zero; ``position(c)`` is a
    point of the guide, ``force(c)`` a dead force along it.  Raises :class:`SceneError` for a direction that is none.
    """
    direction = np.array(reals("along", along, (0.6, 0.0, 0.8), 3))
    largest = abs(direction).max()
    if not 0 < largest < np.inf:
        what = "zero" if largest == 0 else f"{tuple(direction.tolist())}"
        raise SceneError(f"The direction in which a hinge slides is {what}: give one, as in along=(0.6, 0.0, 0.8).")
    direction = direction / largest
    direction /= np.linalg.norm(direction)
    unit = tuple(np.where(abs(direction) > SLIGHT, direction, 0.0).tolist())
    if force is not None:
        function("force", force, 1, "lambda c: -c.P")
    push = None if force is None else lambda c: tuple(t * force(c) for t in unit)
    return SlidingHinge(position, rotation, push, hinge=axis, along=unit)

"""Ends of a rod, open, closed or guided: support and loads, their contributions to the problem, their checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.forms import loads
from rodfem.problem.arguments import check_vector, number_of, plain, yes_or_no
from rodfem.problem.contribution import (
    DEAD_AT_END,
    FOLLOWER,
    FOLLOWER_MOMENT,
    MOMENT,
    POTENTIAL,
    UNIT,
    Block,
    Contribution,
    Direction,
    Group,
    Motion,
    Site,
    Unknown,
)
from rodfem.problem.roles import Role, role_field
from rodfem.problem.setting import AXIS, HELD, TURNS
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, Given, OfPlace, Quaternion
    from rodfem.problem.scene import Scene

SIDES, LETTERS = ("left", "right"), "ab"
"""The two ends in words, and in names of unknowns."""
ALONG = 0.999
"""Cosine of the angle between an axis and the normal of the plane above which a planar rod turns about the axis."""


@dataclass(frozen=True)
class End(Contribution):
    """Support and loads of one end of the rod.

    Parameters
    ----------
    position
        ``position(c)``, or a constant, gives three components, each an expression (held there) or None (free to move
        in that direction); None leaves all three free.
    rotation
        Quaternion (scalar first) at which the directors are held; ``rotation(c)`` gives one that changes with the
        constants; None leaves them free.
    hinge
        Axis, in components along the directors of the held end, about which the end turns freely nevertheless.
    force
        ``force(c)``, dead force on the end, felt in the free directions.  Conservative.
    follower
        ``follower(c)``, force on a free end by its components along the directors, with which it turns.  Not
        conservative.
    moment
        ``moment(c)``, moment about axes fixed in space.  Not conservative, but for a planar rod.
    follower_moment
        ``follower_moment(c)``, moment by its components along the directors.  Not conservative, but for a planar rod.
    energy
        ``energy(x, c)``, potential energy of what else acts on the end: springs, a semi-tangential moment.
        Conservative.
    """

    position: Given = role_field(Role("position of the {} end", "f(c)", 3, gaps=True, placed=False))
    rotation: Given = role_field(Role("rotation of the {} end", "f(c)", 4, or_value=True, placed=False))
    force: Given = role_field(Role("force on the {} end", "f(c)", 3, load=DEAD_AT_END, placed=False))
    follower: Given = role_field(Role("follower force on the {} end", "f(c)", 3, load=FOLLOWER, placed=False))
    hinge: tuple[float, float, float] | None = None
    moment: Given = role_field(Role("moment on the {} end", "f(c)", 3, load=MOMENT, placed=False))
    follower_moment: Given = role_field(
        Role("follower moment on the {} end", "f(c)", 3, load=FOLLOWER_MOMENT, placed=False)
    )
    energy: OfPlace | None = role_field(Role("energy of the {} end", "f(x, c)", 0, load=POTENTIAL))

    closed = False
    """Whether it is joined to the other end."""
    sign = 1.0
    """Factor between the quaternions of two ends that are joined, the right one's over the left one's."""

    @property
    def guide(self) -> Direction:
        """Direction in which the position slides where that need not be e1, e2 or e3; zero without one."""
        return (0.0, 0.0, 0.0)

    def held(self, c: Constants) -> list[Any]:
        """Position of the end: three expressions, None where the end is free."""
        return [None] * 3 if self.position is None else list(self.position(c))

    def fixed(self, c: Constants) -> np.ndarray:
        """Directions in which the position is held, as rows of (m, 3)."""
        return np.array([e for e, x in zip(UNIT, self.held(c), strict=True) if x is not None]).reshape(-1, 3)

    def frame(self, c: Constants) -> Any:
        """Quaternion at which the directors are held, None where they are free."""
        return self.rotation(c) if callable(self.rotation) else self.rotation

    @property
    def turning(self) -> str:
        """Freedom of the directors: held, rotating about the axis of the hinge, or rotating freely."""
        return TURNS if self.rotation is None else HELD if self.hinge is None else AXIS

    @property
    def fixed_rotation(self) -> Quaternion | None:
        """Quaternion at which the directors are clamped once and for all, None where they are not."""
        if self.rotation is None or callable(self.rotation) or self.hinge is not None:
            return None
        size = sum(x * x for x in self.rotation) ** 0.5
        a, b, c, d = (x / size for x in self.rotation)
        return (a, b, c, d)

    def clamps(self, block: Block, c: Constants) -> list[bool]:
        """Components of a continuous field that are given at the end; one for all of a rotation or a multiplier."""
        held = [x is not None for x in self.held(c)]
        if block.name == "r":
            return held
        if block.along:  # what holds the end fulfils the constraint there
            return [self.rotation is not None or any(held)]
        return [self.fixed_rotation is not None]

    def contact_force(self, c: Constants) -> list[Any]:
        """Components of the contact force that dead forces prescribe, pulling outwards; None elsewhere."""
        force = [0.0] * 3 if self.force is None else self.force(c)
        return [f if x is None else None for f, x in zip(force, self.held(c), strict=True)]

    @property
    def dead(self) -> bool:
        """Whether dead forces are all that acts on the position where it is free."""
        return self.energy is None

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Moments of a moving clamp or a hinge."""
        directions = self._stiff(normal)
        motion = Motion.MIXED if len(directions) == 2 else Motion.VECTOR
        words = f"moment at the {SIDES[number]} end"
        group = Group(f"m{LETTERS[number]}", words, "rotation of an end, direction {}", motion, moment=True)
        return [Unknown(group, i, direction) for i, direction in enumerate(directions)]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Loads, and the misalignment of a moving clamp or a hinge with its moments."""
        yield from super().lagrangian(at)
        for moment, direction in zip(at.y, self._stiff(at.normal), strict=False):
            yield moment * ufl.dot(loads.misalignment(at.x.q, self.frame(at.c)), ufl.as_vector(direction))

    def _stiff(self, normal: int | None) -> list[Direction]:
        """Directions about which moments, as unknowns, keep the end from turning."""
        return [] if self.rotation is None or self.fixed_rotation is not None else across(self.hinge, normal)

    def check(self, side: str, scene: Scene) -> None:
        """Check shapes, and that nothing acts on what is held; raises :class:`SceneError`."""
        for load in scene.loads() if callable(self.rotation) else scene.span[:1]:
            self._check_rotation(side, scene, scene.constants(load))
        if self.hinge is not None:
            if self.rotation is None:
                raise SceneError(f"The {side} end has a hinge but no rotation: say which directors the hinge holds.")
            check_vector(f"hinge of the {side} end", self.hinge, 3)
            if not 0 < np.linalg.norm(_numbers(f"hinge of the {side} end", self.hinge)) < np.inf:
                raise SceneError(f"The hinge of the {side} end has no axis: give three components, not all zero.")
        self._check_force(side, scene)
        if self.fixed_rotation is not None and (self.moment or self.follower_moment):
            raise SceneError(
                f"A moment acts on the {side} end, whose directors are held: leave its rotation free, or use a hinge."
            )

    def _check_force(self, side: str, scene: Scene) -> None:
        for c in map(scene.constants, scene.loads()):
            fixed = self.fixed(c)
            if len(fixed) == 3 and (self.force or self.follower):
                raise SceneError(
                    f"A force acts on the {side} end, whose position is held: leave it out, or leave the position free "
                    "in one direction."
                )
            force = np.array([0.0] * 3 if self.force is None else [number_of(x) for x in self.force(c)])
            if (abs(fixed @ force) > NEGLIGIBLE * np.linalg.norm(force)).any():
                raise SceneError(
                    f"A force acts on the {side} end in a direction in which its position is held: leave that "
                    "component out, or leave the position free there."
                )

    def _check_rotation(self, side: str, scene: Scene, c: Constants) -> None:
        rotation = self.frame(c)
        if rotation is None:
            return
        check_vector(f"rotation of the {side} end", rotation, 4)
        size = np.linalg.norm(_numbers(f"rotation of the {side} end", rotation))
        if not 0 < size < np.inf:
            words = "the zero quaternion" if size == 0 else f"{rotation}"
            raise SceneError(f"The rotation of the {side} end is {words}: give one of unit norm.")


def _numbers(what: str, values: Any) -> list[float]:
    try:
        return [plain(x) for x in values]
    except (TypeError, ValueError):
        raise SceneError(f"The {what} is {values!r}: give finite numbers.") from None


def across(axis: tuple[float, float, float] | None, normal: int | None = None) -> list[Direction]:
    """Unit vectors across ``axis``, all three without one: the directions about which an end does not turn.

    In a plane that is its normal, or nothing where the axis is along it.
    """
    if normal is not None:
        along = axis is not None and abs(axis[normal]) > ALONG * float(np.linalg.norm(axis))
        return [] if along else [UNIT[normal]]
    if axis is None:
        return list(UNIT)
    return [tuple(map(float, row)) for row in np.linalg.svd(np.array([axis], dtype=float))[2][1:]]


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
        yes_or_no("odd", self.odd)

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
        """Check the direction and the point, and what is checked of every end; raises :class:`SceneError`."""
        if scene.normal is not None and self.along[scene.normal]:
            raise SceneError(
                f"The guide of the {side} end leaves the plane across {scene.planar}: choose a direction in the plane."
            )
        super().check(side, scene)
        if None in super().held(scene.constants()):
            raise SceneError(f"The guide of the {side} end has no place: give three components of a point on it.")

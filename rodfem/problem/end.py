"""An end of the rod: its support and loads, their contributions to the problem, and their checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.forms import loads
from rodfem.problem.contribution import UNIT, Block, Contribution, Direction, Group, Motion, Site, Unknown
from rodfem.problem.kinds import check_vector, plain
from rodfem.problem.load import DEAD_AT_END, FOLLOWER, FOLLOWER_MOMENT, MOMENT, POTENTIAL
from rodfem.problem.roles import Role, role_field
from rodfem.problem.setting import AXIS, HELD, TURNS

if TYPE_CHECKING:
    from rodfem.problem.local_state import Constants, OfConstants, OfPlace, Quaternion
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
        ``position(c)`` gives three components, each an expression (held there) or None (free to move in that
        direction); None leaves all three free.
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

    position: OfConstants | None = role_field(Role("position of the {} end", "f(c)", 3, gaps=True, placed=False))
    rotation: Quaternion | OfConstants | None = role_field(
        Role("rotation of the {} end", "f(c)", 4, or_value=True, placed=False)
    )
    force: OfConstants | None = role_field(Role("force on the {} end", "f(c)", 3, load=DEAD_AT_END, placed=False))
    follower: OfConstants | None = role_field(
        Role("follower force on the {} end", "f(c)", 3, load=FOLLOWER, placed=False)
    )
    hinge: tuple[float, float, float] | None = None
    moment: OfConstants | None = role_field(Role("moment on the {} end", "f(c)", 3, load=MOMENT, placed=False))
    follower_moment: OfConstants | None = role_field(
        Role("follower moment on the {} end", "f(c)", 3, load=FOLLOWER_MOMENT, placed=False)
    )
    energy: OfPlace | None = role_field(Role("energy of the {} end", "f(x, c)", 0, load=POTENTIAL))

    # --- what is held ----------------------------------------------------------------------------------------------

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

    # --- what it contributes ---------------------------------------------------------------------------------------

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

    # --- what is checked -------------------------------------------------------------------------------------------

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
        if len(self.fixed(scene.constants())) == 3:
            if self.follower is not None:
                raise SceneError(
                    f"A follower force acts on the {side} end, whose position is held: leave it free in one direction."
                )
            if self.force is not None:
                raise SceneError(
                    f"A dead force acts on the {side} end, whose position is held: it has no effect there; leave it "
                    "out, or leave the position free in one direction."
                )
        if self.fixed_rotation is not None and (self.moment or self.follower_moment):
            raise SceneError(
                f"A moment acts on the {side} end, whose directors are held: leave its rotation free, or use a hinge."
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
    """Components as numbers; raises :class:`SceneError` for one that is none."""
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

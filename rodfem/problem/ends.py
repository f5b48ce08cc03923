"""Supports and loads of the ends of a rod.

Everything here, and in :mod:`rodfem.problem.contribution`, is plain immutable data.  Functions of the named constants
``c`` return expressions that work on UFL and on numbers alike, and a constant may stand in the place of one.  Functions
``f(x, c)`` of a *place* receive the state of the rod there:

* ``x.r`` (3,) the centreline, ``x.q`` (4,) the quaternion, ``x.R`` (3, 3) the rotation, ``x.d1, x.d2, x.d3`` (3,) the
  directors, ``x.s`` the arclength;
* where the place is the whole rod also ``x.dr`` (3,) ``= r'``, ``x.v`` (3,) and ``x.k`` (3,) the strains.

They return UFL scalars (see :mod:`rodfem.forms.loads` for a stock of them).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import ufl

from rodfem.errors import InputError, SceneError
from rodfem.forms import loads
from rodfem.forms.rotation import IDENTITY, rotation
from rodfem.problem.arguments import check_vector, convert, finite, number_of, plain, reals, yes_or_no
from rodfem.problem.contribution import (
    DEAD_AT_END,
    FOLLOWER,
    FOLLOWER_MOMENT,
    MOMENT,
    POTENTIAL,
    Contribution,
    Load,
    Site,
)
from rodfem.problem.functions import LETTERS, Constants, Given, OfPlace, Place, Quaternion, Role, role_field
from rodfem.problem.quaternions import directors
from rodfem.problem.setting import AXIS, HELD, TURNS
from rodfem.problem.unknowns import UNIT, Block, Direction, Group, Motion, Unknown
from rodfem.tolerances import NEGLIGIBLE

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


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
        ``moment(c)``, moment about axes fixed in space.  Conservative about a hinge, and for a planar rod.
    follower_moment
        ``follower_moment(c)``, moment by its components along the directors.  Conservative in the same cases.
    energy
        ``energy(x, c)``, potential energy of what else acts on the end: springs, a semi-tangential moment.
        Conservative.
    """

    position: Given = role_field(Role("position of the {} end", "f(c)", 3, gaps=True, placed=False))
    rotation: Given = role_field(Role("rotation of the {} end", "f(c)", 4, or_value=True, placed=False))
    force: Given = role_field(Role("force on the {} end", "f(c)", 3, load=DEAD_AT_END, placed=False))
    follower: Given = role_field(Role("follower force on the {} end", "f(c)", 3, load=FOLLOWER, placed=False))
    hinge: tuple[float, float, float] | None = None
    moment: Given = role_field(lambda x: Role("moment on the {} end", "f(c)", 3, load=x.torque(MOMENT), placed=False))
    follower_moment: Given = role_field(
        lambda x: Role("follower moment on the {} end", "f(c)", 3, load=x.torque(FOLLOWER_MOMENT), placed=False)
    )
    energy: OfPlace | None = role_field(Role("energy of the {} end", "f(x, c)", 0, load=POTENTIAL))

    closed = False  # whether it is joined to the other end
    sign = 1.0  # of the right end's quaternion over the left one's, where they are joined
    turn = 0.0  # about d3, from the left to the right one's
    guide: ClassVar[Direction] = (0.0, 0.0, 0.0)
    """Direction in which it slides where that need not be e1, e2 or e3; zero without one."""

    def support(self, c: Constants) -> list[Any]:
        """Position of the end: three expressions, None where the end is free."""
        return [None] * 3 if self.position is None else list(self.position(c))

    def fixed(self, c: Constants) -> np.ndarray:
        """Directions in which the position is held, as rows of (m, 3)."""
        return np.array([e for e, x in zip(UNIT, self.support(c), strict=True) if x is not None]).reshape(-1, 3)

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
        held = [x is not None for x in self.support(c)]
        if block.name == "r":
            return held
        if block.along:  # what holds the end fulfils the constraint there
            return [self.rotation is not None or any(held)]
        return [self.fixed_rotation is not None]

    def contact_force(self, c: Constants) -> list[Any]:
        """Components of the contact force that dead forces prescribe, pulling outwards; None elsewhere."""
        force = [0.0] * 3 if self.force is None else self.force(c)
        return [f if x is None else None for f, x in zip(force, self.support(c), strict=True)]

    @property
    def dead(self) -> bool:
        """Whether dead forces are all that acts on the position where it is free."""
        return self.energy is None and not self.guiding()

    def guiding(self) -> list[Direction | None]:
        """Forces of a guide, each along its direction in space, None for one that turns."""
        return []

    def distances(self, at: Site) -> list[Any]:
        """Distances from the guide, which these forces keep at zero."""
        return []

    def torque(self, kind: Load) -> Load:
        """Return a ``kind`` of moment as it acts here: about the axis of a hinge it has the potential ``-T angle``."""
        if self.hinge is None:
            return kind

        def potential(at: Site, moment: Sequence[Any]) -> Any:
            axis, frame = ufl.as_vector(self._axis()), ufl.as_vector(list(self.frame(at.c)))
            fixed = ufl.dot(rotation(frame), axis) if kind is MOMENT else axis
            return -ufl.dot(ufl.as_vector(list(moment)), fixed) * loads.angle_about(at.x.q, frame, axis)

        return replace(kind, potential=potential)

    def _axis(self) -> list[float]:
        """Unit vector of the hinge, along the held directors; zero without one."""
        axis = np.array(self.hinge or (0.0, 0.0, 0.0), dtype=float)
        return (axis / (np.linalg.norm(axis) or 1.0)).tolist()

    def unknowns(self, number: int, normal: int | None, centreline: bool) -> list[Unknown]:
        """Moments of a moving clamp or a hinge, and forces of a guide."""
        directions = self._stiff(normal)
        motion = Motion.MIXED if len(directions) == 2 else Motion.VECTOR
        group = Group(f"m{LETTERS[number]}", "rotation of an end, direction {}", motion, moment=True)
        guide = Group(f"f{LETTERS[number]}", "guide of an end, direction {}", Motion.MIXED)
        moments = [Unknown(group, i, direction) for i, direction in enumerate(directions)]
        return moments + [Unknown(guide, i, direction) for i, direction in enumerate(self.guiding())]

    def lagrangian(self, at: Site) -> Iterator[Any]:
        """Loads, the misalignment of a moving clamp or a hinge, and distances from a guide, with their multipliers."""
        yield from super().lagrangian(at)
        directions = self._stiff(at.normal)
        for moment, direction in zip(at.y, directions, strict=False):
            yield moment * ufl.dot(loads.misalignment(at.x.q, self.frame(at.c)), ufl.as_vector(direction))
        for force, distance in zip(at.y[len(directions) :], self.distances(at), strict=True):
            yield force * distance

    def _stiff(self, normal: int | None) -> list[Direction]:
        """Directions about which moments, as unknowns, keep the end from turning; in a plane the normal or none."""
        if self.rotation is None or self.fixed_rotation is not None:
            return []
        if normal is None:
            return list(UNIT) if self.hinge is None else normals(self.hinge)
        along = self.hinge is not None and abs(self.hinge[normal]) > 0.999 * float(np.linalg.norm(self.hinge))
        return [] if along else [UNIT[normal]]

    def check(self, side: str, scene: Scene) -> None:
        """Check shapes, and that nothing acts on what is held; raises :class:`SceneError`."""
        where = f"{side} end"
        for c in map(scene.constants, scene.loads() if callable(self.rotation) else scene.span[:1]):
            self._check_rotation(where, self.frame(c))
        if self.turning == HELD and (self.moment or self.follower_moment):
            raise SceneError(f"A moment acts on the {where}, whose directors are held: leave them free or use a hinge.")
        for c in map(scene.constants, scene.loads()):
            self._check_force(where, c)
            self._check_moments(where, c)

    def _check_rotation(self, where: str, rotation: Any) -> None:
        if rotation is not None:
            size = _size(f"rotation of the {where}", rotation, 4)
            if not 0 < size:
                words = "the zero quaternion" if size == 0 else f"{rotation}"
                raise SceneError(f"The rotation of the {where} is {words}: give one of unit norm.")
        if self.hinge is not None:
            if rotation is None:
                raise SceneError(f"The {where} has a hinge but no rotation: say which directors the hinge holds.")
            if not 0 < _size(f"hinge of the {where}", self.hinge, 3):
                raise SceneError(f"The hinge of the {where} has no axis: give three components, not all zero.")

    def _check_force(self, where: str, c: Constants) -> None:
        fixed = self.fixed(c)
        if len(fixed) == 3 and (self.force or self.follower):
            raise SceneError(f"A force acts on the {where}, whose position is held: leave a component free.")
        force = np.array([0.0] * 3 if self.force is None else [number_of(x) for x in self.force(c)])
        if (abs(fixed @ force) > NEGLIGIBLE * np.linalg.norm(force)).any():
            what = f"A force acts on the {where} in a direction in which its position is held"
            raise SceneError(f"{what}: leave that component out, or leave the position free there.")

    def _check_moments(self, where: str, c: Constants) -> None:
        frame = directors(np.array([number_of(x) for x in self.frame(c)])) if self.turning == AXIS else np.eye(3)
        for given, fixed in ((self.moment, frame), (self.follower_moment, np.eye(3))):
            moment, axis = np.array([number_of(x) for x in given(c)] if given else [0.0] * 3), fixed @ self._axis()
            if self.turning == AXIS and np.linalg.norm(np.cross(axis, moment)) > NEGLIGIBLE * np.linalg.norm(moment):
                what = f"A moment acts on the {where} across the axis of its hinge, about which alone it turns"
                raise SceneError(f"{what}: leave that component out, or the directors free there.")


def _size(what: str, values: Any, size: int) -> float:
    """Norm of a quaternion or an axis; raises :class:`SceneError` for what is none, nan for what is not finite."""
    check_vector(what, values, size)
    try:
        norm = float(np.linalg.norm([plain(x) for x in values]))
    except (TypeError, ValueError):
        raise SceneError(f"The {what} is {values!r}: give finite numbers.") from None
    return norm if norm < np.inf else np.nan


def normals(axis: Direction) -> list[Direction]:
    """Two unit vectors across an axis."""
    return [tuple(map(float, row)) for row in np.linalg.svd(np.array([axis], dtype=float))[2][1:]]


CLOSING_MOMENT = Group("t", "closing of the ring's rotation, component {}", Motion.CLOSING, moment=True)
CLOSING_FORCE = Group("f", "closing of the ring along e{}", Motion.CLOSING)


@dataclass(frozen=True)
class Ring:
    """Both ends joined to each other, with equal directors, or those of the right end a ``turn`` ahead: a closed rod.

    The turn, in radian, is about the tangent: a strip with half a turn has ``turn=pi``, and may slide along itself if
    its section looks alike after it.

    Where the directors turn about the closed rod an odd number of times in all (a circle without twist: once), its
    quaternion changes sign, ``q(l) = -q(0)``; with ``odd = False`` it does not.  The number itself, and with it the
    link, is that of the scene's ``start``.
    """

    odd: bool = True
    turn: float = 0.0

    def __post_init__(self) -> None:
        convert(self, odd=yes_or_no, turn=finite(np.pi))

    def __iter__(self) -> Iterator[End]:
        for last in (False, True):
            yield JoinedEnd(sign=-1.0 if self.odd else 1.0, last=last, turn=self.turn)


@dataclass(frozen=True)
class JoinedEnd(End):
    """One end of a closed rod: nothing but the other end holds it.

    Multipliers close ``q(l) = +-q(0) g``, with the quaternion ``g`` of a ``turn`` about d3, and, with a centreline,
    ``r(l) = r(0)``.  In a plane the angle grows by the whole number of turns that the scene's start makes.
    """

    sign: float = 1.0
    last: bool = False
    turn: float = 0.0
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
        sign, size = 1.0 if self.last else -1.0, 4 if at.whole is None else 1
        turned = [at.turned] if size == 1 else at.turned if self.last else self.image(at.turned)
        if self.last and size == 1:
            yield -at.y[0] * at.whole
        yield (-self.sign if size == 4 and not self.last else sign) * _dot(at.y[:size], turned, range(size))
        if len(at.y) > size:
            yield sign * _dot(at.y[size:], at.x.r, at.free)

    def image(self, q: Any) -> Any:
        """Quaternion ``q`` turned by the ring's turn about d3."""
        c, s = np.cos(self.turn / 2), np.sin(self.turn / 2)
        return [c * q[0] - s * q[3], c * q[1] + s * q[2], c * q[2] - s * q[1], c * q[3] + s * q[0]] if self.turn else q

    def check(self, side: str, scene: Scene) -> None:
        """Check that the start of the ring closes; raises :class:`SceneError`."""
        if scene.start is None:
            raise SceneError("A ring has no straight start: give its rotation as a function start(s).")
        if self.turn and scene.planar is not None:
            raise SceneError(f"A planar ring cannot have a turn of {self.turn:g}: leave planar or the turn out.")
        first, last = scene.start(np.array(scene.interval))
        if self.sign * np.dot(self.image(first), last) <= 0:
            turn = f" turned by {self.turn:g} about d3" if self.turn else ""
            what = f"make q(l) = {self.sign:+g} q(0){turn}, or choose Ring(odd={self.sign > 0})"
            raise SceneError(f"The start of the ring does not end as it begins: {what}.")


def _dot(multipliers: Any, values: Any, components: Any) -> Any:
    return sum(y * values[i] for y, i in zip(multipliers, components, strict=True))


@dataclass(frozen=True)
class SlidingHinge(End):
    """End that turns about the axis ``hinge``, and whose ``position`` slides along a unit vector ``guide`` of space.

    Components across which the direction is are held; forces of the guide, scalar unknowns, keep the others on it.
    """

    guide: Direction = (0.0, 0.0, 1.0)  # type: ignore[misc]

    def support(self, c: Constants) -> list[Any]:
        """Position of the end: None in the components that move."""
        return [None if t else p for t, p in zip(self.guide, super().support(c), strict=True)]

    def fixed(self, c: Constants) -> np.ndarray:
        """Directions across the guide, (2, 3)."""
        return np.array(normals(self.guide))

    def guiding(self) -> list[Direction | None]:
        """Unit vectors across the direction, among the components that move."""
        moving = np.flatnonzero(self.guide)
        vectors = np.array(normals(tuple(self.guide[i] for i in moving))).reshape(-1, len(moving))
        return [tuple(map(float, row)) for row in vectors @ np.eye(3)[moving]]

    def distances(self, at: Site) -> list[Any]:
        """Distances along these vectors."""
        apart = [r - p for r, p in zip((at.x.r[i] for i in range(3)), super().support(at.c), strict=True)]
        return [sum(d * x for d, x in zip(v, apart, strict=True) if d) for v in self.guiding() if v]

    def check(self, side: str, scene: Scene) -> None:
        """Check the direction and the point, and what is checked of every end; raises :class:`SceneError`."""
        if scene.normal is not None and self.guide[scene.normal]:
            raise SceneError(f"The guide of the {side} end leaves the plane across {scene.planar}: turn it into that.")
        super().check(side, scene)
        if None in super().support(scene.constants()):
            raise SceneError(f"The guide of the {side} end has no place: give three components of a point on it.")


@dataclass(frozen=True)
class CircularGuide(End):
    """Ball on a circle of a ``radius`` about its ``position``, across the vector of space of the number ``normal``."""

    radius: float = 1.0
    normal: int = 2

    def support(self, c: Constants) -> list[Any]:
        """Position of the end: None in the plane of the circle."""
        return [p if i == self.normal else None for i, p in enumerate(super().support(c))]

    def guiding(self) -> list[Direction | None]:
        """One force, towards the centre."""
        return [None]

    def distances(self, at: Site) -> list[Any]:
        """Distance from the circle, to first order."""
        centre, plane = super().support(at.c), [i for i in range(3) if i != self.normal]
        return [(sum((at.x.r[i] - centre[i]) ** 2 for i in plane) - self.radius**2) / (2 * self.radius)]

    def check(self, side: str, scene: Scene) -> None:
        """Check that the circle is in the plane of a planar rod, and what is checked of every end."""
        if scene.normal not in (None, self.normal):
            raise SceneError(f"The circle of the {side} end leaves the plane across {scene.planar}: give that normal.")
        super().check(side, scene)


def clamped(position: Given = (0.0, 0.0, 0.0), rotation: Given = IDENTITY) -> End:
    """Return an end whose position (3,) and directors are given, both as functions of the constants if wanted."""
    return End(position=position, rotation=rotation)


def pinned(
    position: Given = (0.0, 0.0, 0.0), force: Given = None, moment: Given = None, follower_moment: Given = None
) -> End:
    """Return an end whose position is given and whose directors turn freely.

    ``position(c)`` (3,) is that of the end; components that are None are free, and ``force(c)`` (3,) is a dead force
    there.  Moments have no potential in space: ``moment(c)`` (3,) is about axes that stay, ``follower_moment(c)`` (3,)
    along the directors.
    """
    return End(position=position, force=force, moment=moment, follower_moment=follower_moment)


def sliding(position: Given, rotation: Given = IDENTITY, force: Given = None) -> End:
    """Return an end whose directors are held, and that moves freely where ``position(c)`` says None."""
    return End(position=position, rotation=rotation, force=force)


def hinged(
    axis: tuple[float, float, float], position: Given = (0.0, 0.0, 0.0), rotation: Given = IDENTITY, force: Given = None
) -> End:
    """Return an end that turns freely about one ``axis`` only, given along the directors of ``rotation``.

    ``position(c)`` and ``force(c)`` are as for :func:`pinned`.
    """
    return End(position=position, rotation=rotation, hinge=axis, force=force)


def sliding_hinge(
    axis: tuple[float, float, float],
    along: tuple[float, float, float],
    position: Given = (0.0, 0.0, 0.0),
    rotation: Given = IDENTITY,
    force: Given = None,
) -> SlidingHinge:
    """Return an end that turns about one ``axis`` only, and slides along a direction of space.

    ``axis`` is given along the directors of ``rotation``, ``along`` in space, any vector but zero; ``position`` (3,) is
    a point of the guide, ``force`` a dead force along it.  Raises :class:`SceneError` for a direction that is none.
    """
    direction = np.array(reals("along", along, (0.6, 0.0, 0.8), 3))
    largest = abs(direction).max()
    if not 0 < largest < np.inf:
        what = "zero" if largest == 0 else f"{tuple(direction.tolist())}"
        raise SceneError(f"The direction in which a hinge slides is {what}: give one, as in along=(0.6, 0.0, 0.8).")
    direction = np.where(abs(direction) > NEGLIGIBLE * largest, direction / largest, 0.0)
    unit = tuple((direction / np.linalg.norm(direction)).tolist())
    push = force if force is None else lambda c: tuple(t * _one_number(value_of(force, c)) for t in unit)
    return SlidingHinge(position, rotation, push, hinge=axis, guide=unit)


def _one_number(force: Any) -> Any:
    if isinstance(force, (tuple, list, np.ndarray)):
        raise SceneError(
            f"The force of a sliding hinge is {force}: give one number along its guide, as lambda c: -c.P."
        )
    return force


def circular_guide(
    radius: float, normal: str = "e3", centre: Given = (0.0, 0.0, 0.0), force: Given = None
) -> CircularGuide:
    """Return a ball that slides on a circle of a ``radius`` about ``centre`` (3,), across the vector ``normal``.

    That is ``"e1"``, ``"e2"`` or ``"e3"``, and ``force`` (3,) a dead force.  Raises :class:`SceneError` for others.
    """
    if not 0 < (size := number_of(radius)) < np.inf:
        raise SceneError(f"The circle of an end has the radius {radius!r}: give a positive one.")
    names = [f"e{i}" for i in (1, 2, 3)]
    if normal not in names:
        raise SceneError(f"The circle of an end is across {normal!r}: choose one of {', '.join(names)}.")
    return CircularGuide(centre, force=force, radius=size, normal=names.index(normal))


def free(
    force: Given = None,
    follower: Given = None,
    energy: OfPlace | None = None,
    moment: Given = None,
    follower_moment: Given = None,
) -> End:
    """Return an end without support, loaded by forces, a potential energy, moments, or nothing.

    ``force(c)`` (3,) is a dead force, ``follower(c)`` (3,) one along the directors, ``energy(x, c)`` a potential;
    ``moment(c)`` and ``follower_moment(c)`` are as for :func:`pinned`.
    """
    return End(force=force, follower=follower, energy=energy, moment=moment, follower_moment=follower_moment)


def elastic(
    translation: Given = None,
    rotation: Given = None,
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0),
    directors: Quaternion = IDENTITY,
    force: Given = None,
) -> End:
    """Return an end held by springs: stiffness in translation and in rotation, each one number or three.

    The first three are along e1, e2, e3, from ``anchor``; the second about the directors of ``directors``.  See
    :func:`rodfem.forms.loads.spring` and :func:`rodfem.forms.loads.rotational_spring` (linear in the angle while it is
    small).

    ``translation(c)`` is in force per length, ``rotation(c)`` in moment per radian; None is no spring.  ``force(c)``
    (3,) is a dead force.  Raises :class:`InputError` for an anchor or directors that are none, and the scene refuses a
    number below zero: what pushes away is no spring, but an ``energy``.
    """
    reals("anchor", anchor, (0.0, 0.0, 1.0), 3)
    if not any(reals("directors", directors, IDENTITY, 4)):
        raise InputError("The directors of an elastic end are the zero quaternion: give one of unit norm.")

    def energy(x: Place, c: Constants) -> Any:
        out = 0 if translation is None else loads.spring(x.r, _stiffness(translation, c), anchor)
        return out + (0 if rotation is None else loads.rotational_spring(x.q, _stiffness(rotation, c), directors))

    return End(energy=energy, force=force)


def _stiffness(given: Given, c: Constants) -> Any:
    """Stiffness of a spring; raises :class:`ValueError` for a number below zero."""
    value = value_of(given, c)
    for k in value if isinstance(value, list | tuple) else [value]:
        if isinstance(k, int | float) and k < 0:
            raise ValueError(f"a stiffness of {k:g} pushes away: give zero or more, or End(energy=...)")
    return value


def value_of(given: Given, c: Constants) -> Any:
    """Value of a function of the constants, or of a constant in the place of one."""
    return given(c) if callable(given) else given

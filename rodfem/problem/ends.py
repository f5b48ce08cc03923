"""What holds and loads a rod: its ends, things attached along it, and constraints.

Everything here is plain immutable data.  Functions of the named constants ``c`` return expressions that work on UFL and
on numbers alike; functions ``f(x, c)`` of a *place* receive the state of the rod there:

* ``x.r`` (3,) the centreline, ``x.q`` (4,) the quaternion, ``x.R`` (3, 3) the rotation, ``x.d1, x.d2, x.d3`` (3,) the
  directors, ``x.s`` the arclength;
* where the place is the whole rod also ``x.dr`` (3,) ``= r'``, ``x.v`` (3,) and ``x.k`` (3,) the strains.

They return UFL scalars (see :mod:`forms.loads` for a stock of them).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from forms import loads
from forms.rotation import IDENTITY
from rodfem.errors import SceneError
from rodfem.problem.roles import Role


class Constants(SimpleNamespace):
    """The named constants of a scene and the arclength ``s``; an unknown name is a :class:`SceneError`."""

    def __getattr__(self, name: str) -> Any:
        """Name what is missing, and what there is."""
        if name.startswith("__"):
            raise AttributeError(name)
        raise SceneError(
            f"A function of the scene asks for a constant {name!r}: add it to the parameters, or choose one of "
            f"{', '.join(sorted(vars(self)))}."
        )


Place = SimpleNamespace
Vector = Sequence[Any]
OfConstants = Callable[[Constants], Vector]
OfPlace = Callable[[Place, Constants], Any]
Quaternion = tuple[float, float, float, float]


@dataclass(frozen=True)
class End:
    """What holds and loads one end of the rod.

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

    position: OfConstants | None = field(default=None, metadata={"role": Role("position of the {} end", "f(c)")})
    rotation: Quaternion | OfConstants | None = field(
        default=None, metadata={"role": Role("rotation of the {} end", "f(c)", or_value=True)}
    )
    force: OfConstants | None = field(default=None, metadata={"role": Role("force on the {} end", "f(c)", 3)})
    follower: OfConstants | None = field(
        default=None, metadata={"role": Role("follower force on the {} end", "f(c)", 3)}
    )
    hinge: tuple[float, float, float] | None = None
    moment: OfConstants | None = field(default=None, metadata={"role": Role("moment on the {} end", "f(c)", 3)})
    follower_moment: OfConstants | None = field(
        default=None, metadata={"role": Role("follower moment on the {} end", "f(c)", 3)}
    )
    energy: OfPlace | None = field(default=None, metadata={"role": Role("energy of the {} end", "f(x, c)", 0)})

    def held(self, c: Constants) -> list[Any]:
        """Position of the end: three expressions, None where the end is free."""
        return [None] * 3 if self.position is None else list(self.position(c))

    def applied(self, c: Constants) -> list[Any]:
        """Dead force on the end, three expressions."""
        return [0.0] * 3 if self.force is None else list(self.force(c))

    @property
    def fixed_rotation(self) -> Quaternion | None:
        """Quaternion at which the directors are clamped once and for all, None where they are not."""
        if self.rotation is None or callable(self.rotation) or self.hinge is not None:
            return None
        size = sum(x * x for x in self.rotation) ** 0.5
        a, b, c, d = (x / size for x in self.rotation)
        return (a, b, c, d)

    @property
    def turned(self) -> OfConstants | None:
        """Rotation that is held by moments as unknowns: a moving clamp or a hinge; None where there is none."""
        if self.rotation is None or self.fixed_rotation is not None:
            return None
        rotation = self.rotation
        return rotation if callable(rotation) else lambda c: rotation


def clamped(position: OfConstants = lambda c: (0.0, 0.0, 0.0), rotation: Quaternion | OfConstants = IDENTITY) -> End:
    """Return an end whose position and directors are given, both as functions of the constants if wanted."""
    return End(position=position, rotation=rotation)


def pinned(position: OfConstants = lambda c: (0.0, 0.0, 0.0), force: OfConstants | None = None) -> End:
    """Return an end whose position is given (None: free in that direction) and whose directors turn freely."""
    return End(position=position, force=force)


def sliding(
    position: OfConstants, rotation: Quaternion | OfConstants = IDENTITY, force: OfConstants | None = None
) -> End:
    """Return an end whose directors are held, and that moves freely where ``position(c)`` says None."""
    return End(position=position, rotation=rotation, force=force)


def hinged(
    axis: tuple[float, float, float],
    position: OfConstants = lambda c: (0.0, 0.0, 0.0),
    rotation: Quaternion | OfConstants = IDENTITY,
    force: OfConstants | None = None,
) -> End:
    """Return an end that turns freely about one ``axis`` only, given along the directors of ``rotation``."""
    return End(position=position, rotation=rotation, hinge=axis, force=force)


def free(force: OfConstants | None = None, follower: OfConstants | None = None, energy: OfPlace | None = None) -> End:
    """Return an end without support, loaded by a dead force, a follower force, a potential energy, or none."""
    return End(force=force, follower=follower, energy=energy)


def elastic(
    translation: Callable[[Constants], Any] | None = None,
    rotation: Callable[[Constants], Any] | None = None,
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0),
    directors: Quaternion = IDENTITY,
    force: OfConstants | None = None,
) -> End:
    """Return an end held by springs: stiffness in translation and in rotation, each one number or three.

    The first three are along e1, e2, e3, from ``anchor``; the second about the directors of ``directors``.  See
    :func:`forms.loads.spring` and :func:`forms.loads.rotational_spring` (linear in the angle while it is small).
    """

    def energy(x: Place, c: Constants) -> Any:
        out = 0 if translation is None else loads.spring(x.r, translation(c), anchor)
        return out + (0 if rotation is None else loads.rotational_spring(x.q, rotation(c), directors))

    return End(energy=energy, force=force)


@dataclass(frozen=True)
class Ring:
    """Both ends joined to each other, with equal directors: a closed rod.

    Where the directors turn about the closed rod an odd number of times in all (a circle without twist: once), its
    quaternion changes sign, ``q(l) = -q(0)``; with ``odd = False`` it does not.  The number itself, and with it the
    link, is that of the scene's ``start``.
    """

    odd: bool = True

    @property
    def sign(self) -> float:
        """Return ``q(l) / q(0)``."""
        return -1.0 if self.odd else 1.0


@dataclass(frozen=True)
class Attachment:
    """Something attached at arclength ``s``.

    A dead ``force(c)``, a ``follower(c)`` force by its components along the directors, a potential ``energy(x, c)`` (a
    spring), a ``mass(c)``, a ``rotary_inertia(c)`` (3,) about the directors.
    """

    s: float
    force: OfConstants | None = field(default=None, metadata={"role": Role("force of an attachment", "f(c)", 3)})
    follower: OfConstants | None = field(
        default=None, metadata={"role": Role("follower force of an attachment", "f(c)", 3)}
    )
    energy: OfPlace | None = field(default=None, metadata={"role": Role("energy of an attachment", "f(x, c)", 0)})
    mass: Callable[[Constants], Any] | None = field(
        default=None, metadata={"role": Role("mass of an attachment", "f(c)", 0)}
    )
    rotary_inertia: OfConstants | None = field(
        default=None, metadata={"role": Role("rotary inertia of an attachment", "f(c)", 3)}
    )


@dataclass(frozen=True)
class Constraint:
    """An equation ``of(x, c) = 0`` with a multiplier of its own.

    Made by :func:`integral`, :func:`at` and :func:`everywhere`.

    ``kind`` is ``integral`` (over the rod), ``point`` (at ``s``) or ``pointwise`` (all along the rod; the multiplier is
    continuous where the equation is one of position or rotation, else not).
    """

    of: OfPlace = field(metadata={"role": lambda x: Role("constraint", "f(x, c)", 0, along=x.kind != "point")})
    kind: str
    s: float | None = None
    continuous: bool = False


def integral(of: OfPlace, equals: Callable[[Constants], Any] = lambda c: 0.0) -> Constraint:
    """Constrain ``int of(x, c) ds = equals(c)``: a total twist, say.  The multiplier is one scalar."""
    return Constraint(_Difference(of, equals), "integral")


def at(s: float, of: OfPlace) -> Constraint:
    """Constrain ``of(x, c) = 0`` at arclength ``s``: a point kept on a plane, say.  The multiplier is one scalar."""
    return Constraint(of, "point", s)


def everywhere(of: OfPlace, *, strain: bool) -> Constraint:
    """Constrain ``of(x, c) = 0`` all along the rod; ``strain`` says whether it is one of strains or of positions."""
    return Constraint(of, "pointwise", continuous=not strain)


@dataclass(frozen=True)
class _Difference:
    """Integrand of an integral constraint, whose value is spread over the rod."""

    of: OfPlace = field(metadata={"role": Role("constraint", "f(x, c)", 0, along=True)})
    equals: Callable[[Constants], Any] = field(metadata={"role": Role("value of an integral constraint", "f(c)", 0)})

    def __call__(self, x: Place, c: Constants) -> Any:
        return self.of(x, c) - self.equals(c) / x.length


def check_vector(what: str, values: Any, size: int) -> None:
    """Raise :class:`SceneError` unless ``values`` has ``size`` components."""
    try:
        count = len(values)
    except TypeError:
        raise SceneError(f"The {what} is a single value: give {size} components.") from None
    if count != size:
        raise SceneError(f"The {what} has {count} components: give {size}.")

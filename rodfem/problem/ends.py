"""Supports and loads of a rod: its ends, attachments along it, and constraints.

Everything here is plain immutable data.  Functions of the named constants ``c`` return expressions that work on UFL and
on numbers alike; functions ``f(x, c)`` of a *place* receive the state of the rod there:

* ``x.r`` (3,) the centreline, ``x.q`` (4,) the quaternion, ``x.R`` (3, 3) the rotation, ``x.d1, x.d2, x.d3`` (3,) the
  directors, ``x.s`` the arclength;
* where the place is the whole rod also ``x.dr`` (3,) ``= r'``, ``x.v`` (3,) and ``x.k`` (3,) the strains.

They return UFL scalars (see :mod:`rodfem.forms.loads` for a stock of them).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rodfem.errors import InputError
from rodfem.forms import loads
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.attachment import Attachment
from rodfem.problem.constraint import Constraint, Integral, at, everywhere, integral
from rodfem.problem.end import End
from rodfem.problem.kinds import function, reals
from rodfem.problem.local_state import Constants, OfConstants, OfPlace, Place, Quaternion
from rodfem.problem.ring import Ring
from rodfem.problem.sliding_hinge import SlidingHinge, sliding_hinge

__all__ = [
    "Attachment",
    "Constants",
    "Constraint",
    "End",
    "Integral",
    "Ring",
    "SlidingHinge",
    "at",
    "clamped",
    "elastic",
    "everywhere",
    "free",
    "hinged",
    "integral",
    "pinned",
    "sliding",
    "sliding_hinge",
]


def clamped(position: OfConstants = lambda c: (0.0, 0.0, 0.0), rotation: Quaternion | OfConstants = IDENTITY) -> End:
    """Return an end whose position and directors are given, both as functions of the constants if wanted."""
    return End(position=position, rotation=rotation)


def pinned(
    position: OfConstants = lambda c: (0.0, 0.0, 0.0),
    force: OfConstants | None = None,
    moment: OfConstants | None = None,
    follower_moment: OfConstants | None = None,
) -> End:
    """Return an end whose position is given and whose directors turn freely.

    ``position(c)`` (3,) is that of the end; components that are None are free, and ``force(c)`` (3,) is a dead force
    there.  Moments have no potential in space: ``moment(c)`` (3,) is about axes that stay, ``follower_moment(c)`` (3,)
    along the directors.
    """
    return End(position=position, force=force, moment=moment, follower_moment=follower_moment)


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
    """Return an end that turns freely about one ``axis`` only, given along the directors of ``rotation``.

    ``position(c)`` (3,) is that of the end; components that are None are free, and ``force(c)`` (3,) is a dead force
    there.
    """
    return End(position=position, rotation=rotation, hinge=axis, force=force)


def free(
    force: OfConstants | None = None,
    follower: OfConstants | None = None,
    energy: OfPlace | None = None,
    moment: OfConstants | None = None,
    follower_moment: OfConstants | None = None,
) -> End:
    """Return an end without support, loaded by forces, a potential energy, moments, or nothing.

    ``force(c)`` (3,) is a dead force, ``follower(c)`` (3,) one along the directors, ``energy(x, c)`` a potential;
    ``moment(c)`` and ``follower_moment(c)`` (3,) are as for :func:`pinned`.
    """
    return End(force=force, follower=follower, energy=energy, moment=moment, follower_moment=follower_moment)


def elastic(
    translation: Callable[[Constants], Any] | None = None,
    rotation: Callable[[Constants], Any] | None = None,
    anchor: tuple[float, float, float] = (0.0, 0.0, 0.0),
    directors: Quaternion = IDENTITY,
    force: OfConstants | None = None,
) -> End:
    """Return an end held by springs: stiffness in translation and in rotation, each one number or three.

    The first three are along e1, e2, e3, from ``anchor``; the second about the directors of ``directors``.  See
    :func:`rodfem.forms.loads.spring` and :func:`rodfem.forms.loads.rotational_spring` (linear in the angle while it is
    small).

    ``translation(c)`` is in force per length, ``rotation(c)`` in moment per radian; None is no spring.  ``force(c)``
    (3,) is a dead force.  Raises :class:`InputError` for an anchor or directors that are none, and the scene refuses a
    number below zero: what pushes away is no spring, but an ``energy``.
    """
    for name, given in (("translation", translation), ("rotation", rotation)):
        if given is not None:
            function(name, given, 1, "lambda c: 1.0")
    reals("anchor", anchor, (0.0, 0.0, 1.0), 3)
    if not any(reals("directors", directors, IDENTITY, 4)):
        raise InputError("The directors of an elastic end are the zero quaternion: give one of unit norm.")

    def energy(x: Place, c: Constants) -> Any:
        out = 0 if translation is None else loads.spring(x.r, _held_by(translation(c)), anchor)
        return out + (0 if rotation is None else loads.rotational_spring(x.q, _held_by(rotation(c)), directors))

    return End(energy=energy, force=force)


def _held_by(stiffness: Any) -> Any:
    """Stiffness of a spring that holds; raises :class:`ValueError` for a number below zero."""
    for k in stiffness if isinstance(stiffness, list | tuple) else [stiffness]:
        if isinstance(k, int | float) and k < 0:
            raise ValueError(f"a stiffness of {k:g} pushes away: give zero or more, or End(energy=...)")
    return stiffness

"""Supports and loads of a rod: its ends, attachments along it, and constraints.

Everything here is plain immutable data.  Functions of the named constants ``c`` return expressions that work on UFL and
on numbers alike, and a constant may stand in the place of one.  Functions ``f(x, c)`` of a *place* receive the state of
the rod there:

* ``x.r`` (3,) the centreline, ``x.q`` (4,) the quaternion, ``x.R`` (3, 3) the rotation, ``x.d1, x.d2, x.d3`` (3,) the
  directors, ``x.s`` the arclength;
* where the place is the whole rod also ``x.dr`` (3,) ``= r'``, ``x.v`` (3,) and ``x.k`` (3,) the strains.

They return UFL scalars (see :mod:`rodfem.forms.loads` for a stock of them).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from rodfem.errors import InputError, SceneError
from rodfem.forms import loads
from rodfem.forms.rotation import IDENTITY
from rodfem.problem.arguments import reals
from rodfem.problem.constraint import Constraint, Integral, at, everywhere, integral
from rodfem.problem.contribution import Attachment
from rodfem.problem.end import End, Ring, SlidingHinge
from rodfem.problem.local_state import Constants, Given, OfPlace, Place, Quaternion
from rodfem.tolerances import NEGLIGIBLE

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


def clamped(position: Given = (0.0, 0.0, 0.0), rotation: Given = IDENTITY) -> End:
    """Return an end whose position (3,) and directors are given, both as functions of the constants if wanted."""
    return End(position=position, rotation=rotation)


def pinned(
    position: Given = (0.0, 0.0, 0.0),
    force: Given = None,
    moment: Given = None,
    follower_moment: Given = None,
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
    axis: tuple[float, float, float],
    position: Given = (0.0, 0.0, 0.0),
    rotation: Given = IDENTITY,
    force: Given = None,
) -> End:
    """Return an end that turns freely about one ``axis`` only, given along the directors of ``rotation``.

    ``position(c)`` (3,) is that of the end; components that are None are free, and ``force(c)`` (3,) is a dead force
    there.
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
    direction = direction / largest
    direction /= np.linalg.norm(direction)
    unit = tuple(np.where(abs(direction) > NEGLIGIBLE, direction, 0.0).tolist())
    push = force if force is None else lambda c: tuple(t * value_of(force, c) for t in unit)
    return SlidingHinge(position, rotation, push, hinge=axis, along=unit)


def free(
    force: Given = None,
    follower: Given = None,
    energy: OfPlace | None = None,
    moment: Given = None,
    follower_moment: Given = None,
) -> End:
    """Return an end without support, loaded by forces, a potential energy, moments, or nothing.

    ``force(c)`` (3,) is a dead force, ``follower(c)`` (3,) one along the directors, ``energy(x, c)`` a potential;
    ``moment(c)`` and ``follower_moment(c)`` (3,) are as for :func:`pinned`.
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
        out = 0 if translation is None else loads.spring(x.r, _held_by(value_of(translation, c)), anchor)
        return out + (
            0 if rotation is None else loads.rotational_spring(x.q, _held_by(value_of(rotation, c)), directors)
        )

    return End(energy=energy, force=force)


def _held_by(stiffness: Any) -> Any:
    """Stiffness of a spring that holds; raises :class:`ValueError` for a number below zero."""
    for k in stiffness if isinstance(stiffness, list | tuple) else [stiffness]:
        if isinstance(k, int | float) and k < 0:
            raise ValueError(f"a stiffness of {k:g} pushes away: give zero or more, or End(energy=...)")
    return stiffness


def value_of(given: Any, c: Constants) -> Any:
    """Value of a function of the constants, or of a constant in the place of one."""
    return given(c) if callable(given) else given

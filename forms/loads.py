r"""Loads: potential energies of those that have one, virtual work of those that have none.

A dead force ``F`` has the potential ``-F . r``.  A force that turns with the directors has none, nor has a moment about
an axis fixed in space, for finite rotations about others too: they contribute to the weak form their virtual work
``F . dr`` and ``M . w``, with the spin ``w`` of the variation.  See Ziegler, Principles of Structural Stability (1968),
and Argyris & Symeonidis, Comput. Methods Appl. Mech. Engrg. 26 (1981) 75-123.

The functions of a place ``x`` are to be used in a scene: ``energy=lambda x, c: loads.spring(x.r, c.k)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import ufl
from ufl.core.expr import Expr

from rodfem.forms.rotation import IDENTITY, conjugate, product, vector_part


def dead(r: Expr, force: Sequence[Any]) -> Expr:
    """Potential ``-F . r`` of a dead force (per unit length, of a distributed one)."""
    return -ufl.dot(ufl.as_vector(list(force)), r)


def spring(r: Expr, stiffness: Any, anchor: Sequence[Any] = (0.0, 0.0, 0.0)) -> Expr:
    """Energy ``1/2 k |r - anchor|^2`` of a spring, or of an elastic foundation; ``stiffness`` one number or three."""
    k = _three(stiffness)
    return sum(0.5 * k[i] * (r[i] - anchor[i]) ** 2 for i in range(3))


def _three(stiffness: Any) -> Sequence[Any]:
    """Stiffness in three directions; raises :class:`ValueError` for another number of them."""
    one = isinstance(stiffness, Expr) or not hasattr(stiffness, "__len__")
    k = [stiffness] * 3 if one else list(stiffness)
    if len(k) != 3:
        raise ValueError(f"a stiffness is one number or three, not {len(k)}")
    return k


def rotational_spring(q: Expr, stiffness: Any, rotation: Sequence[Any] = IDENTITY) -> Expr:
    """Energy ``1/2 sum_i k_i w_i^2`` with ``w = 2 vec(conj(p) q)``: of size ``2 sin(angle/2)``, the angle if small.

    ``p`` is the ``rotation`` without moment; ``stiffness`` one number, or three about the directors of ``p``.
    """
    k = _three(stiffness)
    w = 2 * vector_part(product(conjugate(ufl.as_vector(list(rotation))), q))
    return sum(0.5 * k[i] * w[i] ** 2 for i in range(3)) / ufl.dot(q, q)


def pressure(r: Expr, dr: Expr, p: Any, normal: Sequence[float] = (0.0, 1.0, 0.0)) -> Expr:
    """Potential ``p/2 n . (r x r')`` per unit length of a pressure on a rod in the plane across ``normal``.

    ``p`` times the area that the rod sweeps about the origin, counted about ``n``: its force is ``p n x r'``, across
    the deformed rod (so that it follows), per unit of deformed length.  It has a potential where the ends do not move,
    move on straight lines through the origin, or are joined.  ``r`` (3,) and its derivative ``dr`` (3,) are the
    centreline's.
    """
    n = ufl.as_vector(list(normal))
    return 0.5 * p * ufl.dot(n, ufl.cross(r, dr))


def semi_tangential(d1: Expr, d2: Expr, moment: Any) -> Expr:
    """Potential ``-M/2 (d1 . e2 - d2 . e1)`` of a semi-tangential moment about ``e3``: dead forces on crossed arms."""
    return -0.5 * moment * (d1[1] - d2[0])


def follower_work(R: Expr, components: Sequence[Any], dr: Expr) -> Expr:
    """Virtual work of a force with given components along the directors in the variation ``dr``."""
    return ufl.dot(ufl.dot(R, ufl.as_vector(list(components))), dr)


def moment_work(q: Expr, moment: Sequence[Any], dq: Expr) -> Expr:
    """Virtual work ``M . 2 vec(dq conj(q))`` of a moment with components along axes fixed in space, ``|q| = 1``."""
    return ufl.dot(ufl.as_vector(list(moment)), 2 * vector_part(product(dq, conjugate(q))))


def follower_moment_work(q: Expr, moment: Sequence[Any], dq: Expr) -> Expr:
    """Virtual work ``m . 2 vec(conj(q) dq)`` of a moment with components along the directors, ``|q| = 1``."""
    return ufl.dot(ufl.as_vector(list(moment)), 2 * vector_part(product(conjugate(q), dq)))


def misalignment(q: Expr, rotation: Sequence[Any]) -> Expr:
    """``2 vec(conj(p) q)/|p|``, (3,): zero at the directors of ``p = rotation``, with the spin as its derivative."""
    p = ufl.as_vector(list(rotation))
    return 2 * vector_part(product(conjugate(p), q)) / ufl.sqrt(ufl.dot(p, p))


def angle_about(q: Expr, rotation: Expr, axis: Expr) -> Expr:
    """Angle, between two turns back and two turns on, by which ``q`` is turned from ``rotation`` about a unit axis."""
    p = product(conjugate(rotation), q)
    return 2 * ufl.mathfunctions.Atan2(ufl.dot(vector_part(p), axis), p[0])

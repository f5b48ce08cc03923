"""Rotations by quaternions.

A quaternion is a UFL vector ``q = (q0, q1, q2, q3)``, scalar part first.  The rotation that it
stands for is that of ``q/|q|``: normalising wherever ``R`` is evaluated keeps the discrete rod frame
indifferent and path independent although ``q`` itself lives in a linear finite element space.
"""

from __future__ import annotations

import ufl
from ufl.core.expr import Expr

IDENTITY = (1.0, 0.0, 0.0, 0.0)


def turn(angle: Expr, axis: int) -> Expr:
    """Quaternion of the rotation by ``angle`` about ``e1``, ``e2`` or ``e3`` (``axis`` 0, 1, 2), shape (4,)."""
    return _in_plane(ufl.cos(angle / 2), ufl.sin(angle / 2), axis)


def turn_change(angle: Expr, change: Expr, axis: int) -> Expr:
    """Change of :func:`turn` with a small ``change`` of the angle, shape (4,)."""
    return _in_plane(-ufl.sin(angle / 2) * change / 2, ufl.cos(angle / 2) * change / 2, axis)


def _in_plane(scalar: Expr, along: Expr, axis: int) -> Expr:
    return ufl.as_vector([scalar, *(along if i == axis else 0 for i in range(3))])


def product(p: Expr, q: Expr) -> Expr:
    """Hamilton product ``p q`` of two quaternions, each of shape (4,)."""
    return ufl.as_vector(
        [
            p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
            p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
            p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
        ]
    )


def conjugate(q: Expr) -> Expr:
    """Conjugate quaternion ``(q0, -q1, -q2, -q3)``, shape (4,)."""
    return ufl.as_vector([q[0], -q[1], -q[2], -q[3]])


def vector_part(q: Expr) -> Expr:
    """Vector part ``(q1, q2, q3)``, shape (3,)."""
    return ufl.as_vector([q[1], q[2], q[3]])


def rotation(q: Expr) -> Expr:
    """Rotation matrix ``R(q/|q|)`` of shape (3, 3); its columns are the directors ``d_i = R e_i``.

    The Euler-Rodrigues formula; homogeneous of degree zero in ``q``.
    """
    a, b, c, d = q[0], q[1], q[2], q[3]
    square = ufl.dot(q, q)
    return (
        ufl.as_matrix(
            [
                [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
            ]
        )
        / square
    )

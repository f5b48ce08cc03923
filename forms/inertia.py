"""Bilinear forms that measure a perturbation ``(dr, dq)`` of a rod: its kinetic metric and a plain one.

The kinetic metric, :func:`rotary` and :func:`translational`, is the mass of Kumar & Healey (2010), (16).
"""

from __future__ import annotations

import ufl
from ufl.core.expr import Expr

from rodfem.forms.rotation import conjugate, product, vector_part


def spin(q: Expr, dq: Expr) -> Expr:
    """Infinitesimal rotation ``w = 2 vec(conj(q) dq)`` in the body frame, shape (3,), for ``|q| = 1``."""
    return 2 * vector_part(product(conjugate(q), dq))


def rotary(q: Expr, dq1: Expr, dq2: Expr, rho_I: tuple[Expr, Expr, Expr]) -> Expr:
    """Rotary inertia ``w1 . (rho I) w2`` per unit length, with ``rho I = diag(rho_I)`` in the body frame.

    The spins ``w1``, ``w2`` are those of the changes ``dq1``, ``dq2`` (4,) of the unit quaternion ``q`` (4,).
    """
    w1, w2 = spin(q, dq1), spin(q, dq2)
    return sum(rho_I[i] * w1[i] * w2[i] for i in range(3))


def translational(dr1: Expr, dr2: Expr, rho_A: Expr) -> Expr:
    """Translational inertia ``rho A dr1 . dr2`` per unit length."""
    return rho_A * ufl.dot(dr1, dr2)


def resistive(d3: Expr, dr1: Expr, dr2: Expr, across: Expr, along: Expr) -> Expr:
    """Power of drag ``across`` and ``along`` the unit tangent ``d3`` (3,) at speeds ``dr1``, ``dr2``, per length."""
    return translational(dr1, dr2, across) + (along - across) * ufl.dot(d3, dr1) * ufl.dot(d3, dr2)


def rotation_metric(dq1: Expr, dq2: Expr) -> Expr:
    """Return ``4 dq1 . dq2``: the dot product of the rotation vectors where ``dq`` is tangent to ``|q| = 1``."""
    return 4 * ufl.dot(dq1, dq2)

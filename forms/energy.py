"""Stored energies per unit of reference length.

A stored energy is a function ``W(v, k, c)`` of the strains ``v`` and ``k`` (UFL vectors of shape (3,),
body frame) and the scene's named constants ``c`` (``c.s`` is the arclength), that returns a UFL scalar.
Contact force and moment follow by differentiation: ``n_i = dW/dv_i``, ``m_i = dW/dk_i``.
The functions below are examples; any other function of this form serves as well.
"""

from __future__ import annotations

import ufl
from ufl.core.expr import Expr


def bending_and_twist(k: Expr, stiffness: tuple[Expr, Expr, Expr]) -> Expr:
    """Quadratic energy of bending and twist, ``1/2 (B1 k1^2 + B2 k2^2 + C k3^2)``.

    ``k`` has shape (3,): bending about ``d1`` and ``d2``, then twist.  ``stiffness = (B1, B2, C)`` are the two bending
    stiffnesses and the torsional one, force times length squared.  A natural curvature or twist is subtracted first:
    ``bending_and_twist((k[0], k[1], k[2] - c.t0), stiffness)``.  Raises :class:`ValueError` for another number of them.
    """
    if len(stiffness) != 3:
        raise ValueError(f"bending and twist have three stiffnesses, not {len(stiffness)}")
    return sum(0.5 * b * k[i] ** 2 for i, b in enumerate(stiffness))


def shear_and_stretch(v: Expr, stiffness: tuple[Expr, Expr, Expr]) -> Expr:
    """Quadratic energy of shear and stretch, ``1/2 (G1 v1^2 + G2 v2^2 + E (v3 - 1)^2)``.

    ``v`` has shape (3,).  ``stiffness = (G1, G2, E)`` are forces, those in shear along ``d1`` and ``d2`` first.  Raises
    :class:`ValueError` for another number of them.
    """
    if len(stiffness) != 3:
        raise ValueError(f"shear and stretch have three stiffnesses, not {len(stiffness)}")
    return sum(0.5 * x * (v[i] - (1 if i == 2 else 0)) ** 2 for i, x in enumerate(stiffness))


def hemitropic(v: Expr, k: Expr, *, stretching: Expr, coupling: Expr, twisting: Expr, bending: Expr) -> Expr:
    """Quadratic energy of a hemitropic rod, whose stretch and twist are coupled.

    Gives ``n3 = stretching (v3 - 1) + coupling k3``, ``m3 = twisting k3 + coupling (v3 - 1)`` and
    ``m1, m2 = bending (k1, k2)``: Healey, Math. Mech. Solids 7 (2002), and Kumar & Healey (2010), section 5.2.
    Convex where ``stretching * twisting > coupling^2`` and ``bending > 0``.  ``v`` (3,) and ``k`` (3,) are the strains.
    """
    e = v[2] - 1
    return (
        0.5 * stretching * e**2
        + coupling * e * k[2]
        + 0.5 * twisting * k[2] ** 2
        + 0.5 * bending * (k[0] ** 2 + k[1] ** 2)
    )


def logarithmic_stretch(v: Expr, stiffness: Expr) -> Expr:
    """Energy ``stiffness (v3 log v3 - v3 + 1)`` of stretch, which keeps ``v3`` positive: ``n3 = stiffness log v3``."""
    return stiffness * (v[2] * ufl.ln(v[2]) - v[2] + 1)


def tendon(v: Expr, k: Expr, tension: Expr, at: tuple[Expr, Expr], slope: tuple[Expr, Expr] = (0.0, 0.0)) -> Expr:
    """Potential ``T |v + k x d + d'|`` per unit length of a tendon that slides through the rod at ``d = (*at, 0)``.

    ``T`` is its ``tension``, and ``|v + k x d + d'|`` its length per length of the rod: what a tendon pulled with a
    given force shortens by is the work of that force (Rucker & Webster, IEEE Trans. Robot. 27 (2011) 1033-1044).  ``v``
    (3,) and ``k`` (3,) are the strains, ``at`` components along ``d1`` and ``d2``, ``slope`` their derivatives.
    """
    x, y = at
    along = (v[0] - k[2] * y + slope[0], v[1] + k[2] * x + slope[1], v[2] + k[0] * y - k[1] * x)
    return tension * ufl.sqrt(sum(component**2 for component in along))

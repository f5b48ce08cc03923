"""One Lagrangian for every rod.

The equilibria of a hyperelastic rod are the stationary points of the three-field (Hu-Washizu) functional ::

    L = int_0^l [ W(v, k) + n . (r' - R v) + eta/2 (|q|^2 - 1) ] ds + V

with the potential ``V`` of the loads (``-F . r(l)`` of a dead force), and with the strains ``v``, the contact force
``n`` and the unit-norm multiplier ``eta`` as fields of their own: stationarity in ``v`` is the constitutive law
``n_i = dW/dv_i`` (body components), in ``r`` the balance of forces ``n' = 0``, in ``q`` the balance of moments, in
``n`` the kinematics ``r' = R v``.  Only the strains that a rod leaves free are unknowns: all of a flexible rod, the
stretch of an unshearable one, none of one that is inextensible too.  Its first variation is the weak form (11)-(12) of
Kumar & Healey (2010), which they linearise for each of the three in (17), (18) and (19); see
:mod:`rodfem.forms.paper`.

Where no force acts along the rod, ``n`` is constant and ``r`` drops out: with ``chord = r(l) - r(0)`` ::

    L_reduced = int_0^l [ W(v, k) - n . R v + eta/2 (|q|^2 - 1) ] ds + n . chord + V

in which a component of ``n`` is a known dead force or *one scalar* unknown, whose equation is the integral
constraint ``int (R v)_i ds = chord_i``, their (36): their mixed formulation, with the functionals (37) and (44).
"""

from __future__ import annotations

import ufl
from ufl.core.expr import Expr


def pointwise(W: Expr, R: Expr, v: Expr, dr: Expr, n: Expr) -> Expr:
    """Integrand of ``L`` with the centreline as a field, without loads and the unit-norm term.

    ``dr = r'`` and the field ``n`` have shape (3,).  ``W`` is the stored energy per length, ``R`` (3, 3) the rotation,
    ``v`` (3,) the strain.
    """
    return W + ufl.dot(n, dr - ufl.dot(R, v))


def reduced(W: Expr, R: Expr, v: Expr, n: Expr, chord_per_length: Expr) -> Expr:
    """Integrand of ``L_reduced``, without the unit-norm term.

    ``n`` of shape (3,) is constant along the rod; ``chord_per_length = (r(l) - r(0)) / l`` of shape (3,) is zero in the
    components in which ``n`` is a known dead force.  ``W`` is the stored energy per length, ``R`` (3, 3) the rotation,
    ``v`` (3,) the strain.
    """
    return W + ufl.dot(n, chord_per_length - ufl.dot(R, v))


def unit_norm(eta: Expr, q: Expr) -> Expr:
    """Integrand ``eta/2 (|q|^2 - 1)``, to be collocated at the nodes by Gauss-Lobatto-Legendre quadrature."""
    return 0.5 * eta * (ufl.dot(q, q) - 1)

"""Strains of a director rod: shear, stretch, bending and twist.

The centreline ``r(s)`` and the directors ``d_i(s) = R(q(s)) e_i`` give, in the body frame,

* ``v_i = r' . d_i``: shear, shear, stretch (nondimensional; ``v = (0, 0, 1)`` is undeformed);
* ``k_i`` with ``d_i' = k x d_i``: bending, bending, twist (one over length).

See Antman, Nonlinear Problems of Elasticity (2005), chapter 8, and Kumar & Healey (2010), section 2.
"""

from __future__ import annotations

from collections.abc import Sequence

import ufl
from ufl.core.expr import Expr

from rodfem.forms.rotation import conjugate, product, vector_part

UNDEFORMED = (0.0, 0.0, 1.0)

RODS: dict[str, tuple[int, ...]] = {
    "flexible": (0, 1, 2),
    "unshearable": (2,),
    "inextensible": (0, 1),
    "unshearable and inextensible": (),
}
"""Which components of the strain ``v`` are free in each kind of rod: 0 and 1 are shear, 2 is stretch."""


def curvature(q: Expr, dq: Expr) -> Expr:
    """Curvatures ``k = 2 vec(conj(q) q') / |q|^2`` in the body frame, shape (3,).

    The vector part of ``conj(q) q'`` is free of any change in ``|q|``, so that this is the curvature of
    ``q/|q|`` for every ``q`` other than zero.
    """
    return 2 * vector_part(product(conjugate(q), dq)) / ufl.dot(q, q)


def strain(free: Sequence[int], values: Sequence[Expr]) -> Expr:
    """Strain ``v`` of shape (3,) with the components ``free`` taken from ``values``, the others undeformed."""
    components: list[Expr | float] = list(UNDEFORMED)
    for component, value in zip(free, values, strict=True):
        components[component] = value
    return ufl.as_vector(components)

"""Elementary rigid motions, as linear generators of a rod's fields.

A rotation of space by a small angle about the axis ``e`` changes the centreline, the directors and the contact force ::

    dr = e x r,   dq = 1/2 (0, e) q,   dn = e x n,

and a rotation of the cross-sections about a body axis changes ``dq = 1/2 q (0, e)``, and ``dv = v x e`` of strains that
are unknowns, as the tangent stays where it is.  The continuous symmetries of a rod problem are those combinations of
these that leave its functional as it is: a hemitropic rod between clamps aligned with ``e3`` is unchanged by a rotation
of space together with the opposite one of the cross-sections, ``q -> a q conj(a)``; a ring by all motions of space.  A
generator gives the phase condition that picks one member of a family of equivalent equilibria, and the reason for the
zero eigenvalue of a state that breaks the symmetry.
"""

from __future__ import annotations

Matrix = tuple[tuple[float, ...], ...]
AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def cross(axis: tuple[float, float, float]) -> Matrix:
    """Matrix of ``e x``, (3, 3)."""
    x, y, z = axis
    return ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))


def left(axis: tuple[float, float, float]) -> Matrix:
    """Matrix of ``q -> 1/2 (0, e) q``, (4, 4): a rotation of space."""
    return _quaternion(axis, 1.0)


def right(axis: tuple[float, float, float]) -> Matrix:
    """Matrix of ``q -> 1/2 q (0, e)``, (4, 4): a rotation of the cross-sections."""
    return _quaternion(axis, -1.0)


def _quaternion(axis: tuple[float, float, float], sign: float) -> Matrix:
    x, y, z = (0.5 * a for a in axis)
    rows: list[tuple[float, ...]] = [(0.0, -x, -y, -z)]
    for i, row in enumerate(cross((x, y, z))):
        rows.append(((x, y, z)[i], *(sign * value for value in row)))
    return tuple(rows)

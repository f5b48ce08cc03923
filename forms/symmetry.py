"""Continuous symmetries of a rod problem, as linear generators of its fields.

A hemitropic rod between clamps aligned with ``e`` is unchanged by a rotation ``a`` of space about ``e`` together
with the inverse rotation of the directors: ``q -> a q conj(a)``, ``r -> a r``, ``n -> a n``.  To first order in
the angle ::

    dq = 1/2 (e q - q e) = (0, e x vec q),   dr = e x r,   dn = e x n,

and ``v``, ``mu`` do not change.  The generator gives the phase condition that picks one member of a circle of
equilibria, the deflation vector, and the reason for the one zero eigenvalue of a state that breaks the symmetry.
"""

from __future__ import annotations

Matrix = tuple[tuple[float, ...], ...]


def axial(axis: tuple[float, float, float]) -> dict[str, Matrix]:
    """Generator of the rotations about ``axis`` (a unit vector): a matrix for each field that it moves."""
    x, y, z = axis
    cross: Matrix = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    quaternion: Matrix = ((0.0,) * 4, *((0.0, *row) for row in cross))
    return {"q": quaternion, "r": cross, "n": cross}

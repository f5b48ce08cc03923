"""A position, a rotation or a force that follows a table as the load grows."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.problem.table import Table

NEAR = 0.5
"""Cosine of half the angle between the rotations of two rows, at least: 120 degrees."""


class Rotations(Table):
    """Quaternions of unit norm: of the components, which are interpolated, those of the unit vector count."""

    def adjusted(self, rows: np.ndarray) -> np.ndarray:
        """Give each row unit norm, and the sign by which it is near the one before.

        Raises :class:`SceneError` where it is not near.
        """
        with np.errstate(invalid="ignore"):
            unit = rows / np.linalg.norm(rows, axis=1)[:, None]
        cosines = (unit[1:] * unit[:-1]).sum(axis=1)
        if not (far := abs(cosines) >= NEAR).all():
            raise SceneError(
                f"The {self.what} turns by more than 120 degrees from row {int(np.argmin(far))} (from 0) to the next, "
                "or has a zero quaternion there: give rows in between."
            )
        return unit * np.append(1.0, np.cumprod(np.sign(cosines)))[:, None]

    def __call__(self, x: Any) -> Any:
        """Quaternion at a constant of the scene, or at a number."""
        q = super().__call__(x)
        norm = ufl.sqrt(sum(a**2 for a in q))
        return tuple(a / norm if isinstance(a, ufl.core.expr.Expr) else float(a / norm) for a in q)


def path(t: Any, values: Any, smooth: bool = True) -> Table:
    """Function of the load through the rows of a table: call it with that constant.

    It moves an end, turns it, or is a force::

        t, *columns = np.loadtxt("gripper.txt", unpack=True)
        place = rodfem.path(t, np.transpose(columns))
        ends = (clamped(), clamped(lambda c: place(c.t)))

    Parameters
    ----------
    t
        Values of the constant, (n,), increasing, over its whole range.
    values
        A number for each, (n,); a position or a force, (n, 3); or a rotation, (n, 4), a quaternion with the scalar
        first.  Quaternions get the signs by which each is near the one before, are interpolated by their components,
        and normalised then: give rows that are less than 120 degrees apart.
    smooth
        True: a cubic spline with two continuous derivatives.  False: linear in between; a branch has a point exactly at
        each corner, and no step across one.

    Raises :class:`SceneError` for what is no such table.
    """
    kind = Rotations if np.ndim(values) == 2 and np.shape(values)[1] == 4 else Table
    return kind("path of the load", t, values, smooth=smooth)

"""Functions that a scene has as tables: cubics of the arclength (:func:`tabulated`) or the load (:func:`path`).

With a number a table returns numbers, in the equations an :class:`Entry`, an expression of UFL that stands for the
value; :mod:`rodfem.fem.known` says what the compiled forms read there.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.expressions import Expr, Indexed, Label, Sum, Symbol, Variable, parts
from rodfem.problem.functions import UnnamedError
from rodfem.tolerances import NEGLIGIBLE


class Table:
    """Piecewise cubic through ``rows`` (n, m) at increasing ``knots`` (n,); linear in between unless ``smooth``.

    ``pieces`` are the coefficients of powers 0 to 3 of the distance from the knot at which one begins, (n - 1, 4, m).
    """

    def __init__(self, what: str, x: Any, values: Any, *, smooth: bool) -> None:
        """Interpolate ``values`` at ``x``; raises :class:`SceneError` for what is no table, ``what`` in words."""
        self.what = what
        self.knots, rows = _floats(f"first column of the {what}", x), _floats(f"values of the {what}", values)
        if self.knots.ndim != 1 or len(self.knots) < 2 or rows.shape[:1] != self.knots.shape or rows.ndim > 2:
            shapes = f"{self.knots.shape} and {rows.shape}"
            raise SceneError(f"The {what} has the shapes {shapes}: give n numbers, two or more, and n rows.")
        steps = np.diff(self.knots)
        if not steps.min() > 0:
            row = int(np.argmin(steps > 0))
            raise SceneError(f"The {what} does not increase from row {row} (from 0) to the next: sort the rows.")
        self.scalar, self.rows = rows.ndim == 1, self.adjusted(rows.reshape(len(rows), -1))
        slopes = np.diff(self.rows, axis=0) / steps[:, None]
        self.pieces = np.stack([self.rows[:-1], slopes, 0 * slopes, 0 * slopes], axis=1)
        if smooth:
            from scipy.interpolate import CubicSpline  # takes a tenth of a second to load

            self.pieces = np.moveaxis(CubicSpline(self.knots, self.rows).c[::-1], 0, 1).copy()
        bent = abs(np.diff(slopes, axis=0)).max(axis=1) > NEGLIGIBLE * abs(slopes).max()
        self.corners: list[float] = [] if smooth else self.knots[1:-1][bent].tolist()
        self._labels = [Label() for _ in slopes[0]]

    def check(self, name: str, needed: tuple[float, float]) -> None:
        """Raise :class:`SceneError` unless it has rows where it is ``needed``, called with the constant ``name``."""
        low, high, margin = *sorted(needed), NEGLIGIBLE * np.ptp(self.knots)
        if low < self.knots[0] - margin or high > self.knots[-1] + margin:
            has = f"has rows from {name} = {self.knots[0]:g} to {self.knots[-1]:g}"
            raise SceneError(f"The {self.what} {has}, but is needed from {low:g} to {high:g}: give rows for that.")

    def adjusted(self, rows: np.ndarray) -> np.ndarray:
        """The rows as they are interpolated."""
        return rows

    def piece(self, x: Any) -> Any:
        """Number of the piece that holds ``x``, the next one at a knot; beyond the ends the first or the last one."""
        return np.clip(np.searchsorted(self.knots, x, side="right") - 1, 0, len(self.pieces) - 1)

    def at(self, x: np.ndarray) -> np.ndarray:
        """Values at ``x`` (k,), in as many rows: (k, m)."""
        i = self.piece(x)
        a, b, c, d = np.moveaxis(self.pieces[i], 1, 0)
        t = (x - self.knots[i])[:, None]
        return np.asarray(a + t * (b + t * (c + t * d)))

    def __call__(self, x: Any) -> Any:
        """Value at ``x``, a number or a constant of the scene: a number or an expression, or a tuple of them."""
        if isinstance(x, Expr):
            # in the equations an arclength or a constant is one of these: base + direction * load
            constant = isinstance(x, (Variable, Indexed, Sum)) and not any(isinstance(p, Symbol) for p in parts(x))
            if not constant and not isinstance(x, Symbol):
                raise UnnamedError(f"calls the {self.what} with an expression: call it with c.s, or a constant alone.")
            values = tuple(Entry(x, self, i) for i in range(len(self._labels)))
        else:
            values = tuple(self.at(np.array([float(x)]))[0].tolist())
        return values[0] if self.scalar else values


class Entry(Variable):  # type: ignore[misc]
    """Component ``number`` of a ``table`` at an expression, which is its first operand."""

    __slots__ = ("number", "table")

    def __init__(self, at: Any, table: Table, number: int) -> None:
        """Stand for the value ``at`` an expression."""
        super().__init__(at, table._labels[number])
        self.table, self.number = table, number

    def _ufl_expr_reconstruct_(self, at: Any, label: Any) -> Entry:
        return Entry(at, self.table, self.number)

    def evaluate(self, *arguments: Any, **options: Any) -> float:
        """Value where the expression is a number."""
        at = float(self.ufl_operands[0].evaluate(*arguments, **options))
        return float(self.table.at(np.array([at]))[0, self.number])


def tabulated(s: Any, values: Any, order: int = 1) -> Table:
    """Function of the arclength through the rows of a table: call it with ``c.s``.

    It stands for a stiffness, a curvature, a load or a mass per length in the functions of a scene::

        s, EI = np.loadtxt("stiffness.txt", unpack=True)
        stiffness = rodfem.tabulated(s, EI)
        energy = lambda v, k, c: bending_and_twist(k, (stiffness(c.s), 1.0, 1.0))

    Arclengths ``s`` (n,) increase from one end of the rod to the other; ``values`` are a number for each, (n,), or a
    vector, (n, m): then the function returns a tuple.  ``order`` 1 is linear in between, 3 a cubic spline with two
    continuous derivatives, whose first two pieces, and last two, are one cubic each ("not a knot": de Boor, A Practical
    Guide to Splines, 1978, chapter IV).  Raises :class:`SceneError` for what is no such table.
    """
    if order not in (1, 3):
        raise SceneError(f"A table along the rod has the order {order!r}: choose 1 (linear) or 3 (a cubic spline).")
    return Table("table along the rod", s, values, smooth=order == 3)


class Rotations(Table):
    """Quaternions of unit norm: of the components, which are interpolated, those of the unit vector count."""

    def adjusted(self, rows: np.ndarray) -> np.ndarray:
        """Give each row unit norm, and the sign by which it is near the one before; raises :class:`SceneError`."""
        with np.errstate(invalid="ignore"):
            unit = rows / np.linalg.norm(rows, axis=1)[:, None]
        cosines = (unit[1:] * unit[:-1]).sum(axis=1)
        if not (far := abs(cosines) >= 0.5).all():  # of half the angle
            raise SceneError(
                f"The {self.what} turns by more than 120 degrees from row {int(np.argmin(far))} (from 0) to the next, "
                "or has a zero quaternion there: give rows in between."
            )
        return unit * np.append(1.0, np.cumprod(np.sign(cosines)))[:, None]

    def __call__(self, x: Any) -> Any:
        """Quaternion at a constant of the scene, or at a number."""
        q = super().__call__(x)
        norm = ufl.sqrt(sum(a**2 for a in q))
        return tuple(a / norm if isinstance(a, Expr) else float(a / norm) for a in q)


def path(t: Any, values: Any, smooth: bool = True) -> Table:
    """Function of the load through the rows of a table: call it with that constant.

    It moves an end, turns it, or is a force::

        t, *columns = np.loadtxt("gripper.txt", unpack=True)
        place = rodfem.path(t, np.transpose(columns))
        ends = (clamped(), clamped(lambda c: place(c.t)))

    ``t`` (n,) increases over the whole range of the constant; ``values`` are a number for each, (n,), a position or a
    force, (n, 3), or a rotation, (n, 4), a quaternion with the scalar first.  Quaternions get the signs by which each
    is near the one before, are interpolated by their components, and normalised then: give rows that are less than 120
    degrees apart.  It is a cubic spline with two continuous derivatives; unless ``smooth`` it is linear in between, and
    a branch has a point exactly at each corner.  Raises :class:`SceneError` for what is no such table.
    """
    kind = Rotations if np.ndim(values) == 2 and np.shape(values)[1] == 4 else Table
    return kind("path of the load", t, values, smooth=smooth)


def _floats(what: str, values: Any) -> np.ndarray:
    """Array of finite floats; raises :class:`SceneError`."""
    try:
        out = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise SceneError(f"The {what} are no numbers: give an array, as numpy.loadtxt returns it.") from None
    if not np.isfinite(out).all():
        row = next(iter(np.argwhere(~np.isfinite(out))[:, :1].ravel()), 0)
        raise SceneError(f"Row {row} (from 0) of the {what} is not finite: leave rows without a value out.")
    return out

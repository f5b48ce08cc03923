"""A stiffness, a natural curvature, a load or a mass per length that a table states, as a function of the arclength."""

from __future__ import annotations

from typing import Any

from rodfem.errors import SceneError
from rodfem.problem.table import Table


def tabulated(s: Any, values: Any, order: int = 1) -> Table:
    """Function of the arclength through the rows of a table: call it with ``c.s``.

    It stands for a stiffness, a curvature, a load or a mass per length in the functions of a scene::

        s, EI = np.loadtxt("stiffness.txt", unpack=True)
        stiffness = rodfem.tabulated(s, EI)
        energy = lambda v, k, c: bending_and_twist(k, (stiffness(c.s), 1.0, 1.0))

    Parameters
    ----------
    s
        Arclengths (n,), increasing, from one end of the rod to the other.
    values
        A number for each, (n,), or a vector, (n, m): then the function returns a tuple.
    order
        1: linear in between; 3: a cubic spline with two continuous derivatives, whose first two pieces, and last two,
        are one cubic each ("not a knot": de Boor, A Practical Guide to Splines, 1978, chapter IV).

    Raises :class:`SceneError` for what is no such table.
    """
    if order not in (1, 3):
        raise SceneError(f"A table along the rod has the order {order!r}: choose 1 (linear) or 3 (a cubic spline).")
    return Table("table along the rod", s, values, smooth=order == 3)

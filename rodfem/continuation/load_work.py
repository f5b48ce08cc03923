r"""The change of the potential energy from row to row of a branch, against the work of the load.

Along a branch of equilibria ``x(s)`` the derivative of the total potential energy ``V(x, load)`` is its partial
derivative in the load alone (the envelope theorem), since that in ``x`` vanishes at each of them::

    V_b - V_a = int_a^b g dload,        g = dV/dload at a constant state.

``V`` is the Lagrangian, whose constraints vanish, and ``g`` the component of its first variation along the load: both
are exact for the discrete rod.  The integral is that of the polynomials in arclength through load and ``g`` of the last
four rows; what those of the last three rows, and the trapezium rule, make of it is the measure of its error.  Where the
difference is greater than that, the rows are not on one branch, or an energy is not what its equations belong to.

It is a check that has nothing in common with that of :mod:`rodfem.continuation.jumping`, which compares directions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rodfem.continuation.branch import Point
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.system import System
from rodfem.tolerances import unit

ROWS = 4
"""Number of rows whose polynomials are integrated."""
SHARE = 5.0
"""Difference, relative to that of two orders of the quadrature, from which on it is none of the quadrature."""
UNEQUAL = 1e-8
"""Difference, relative to the energy, that the residual of two equilibria leaves open."""
_POWERS = np.add.outer(np.arange(ROWS), np.arange(ROWS))
_INTEGRALS = np.arange(ROWS) * -((-1.0) ** _POWERS) / np.maximum(_POWERS, 1)
"""Integrals of ``t^i d(t^j)`` from -1 to 0."""


class LoadWork:
    """Compares rows of one system; collective over its ranks."""

    def __init__(self, system: System) -> None:
        """Begin without a row."""
        self.system = system
        self._known: list[tuple[Point, float, float]] = []

    def __call__(self, rows: Sequence[Point]) -> None:
        """Compare the step to the last of the ``rows``, neighbours on the system's mesh; fewer than four are not.

        Raises :class:`ConvergenceError` that names both numbers where they differ.
        """
        rows = rows[-ROWS:]
        self._known = [self._evaluated(row) for row in rows]
        if len(rows) < ROWS:
            return
        every = [(row.arclength, row.load, potential, slope) for row, potential, slope in self._known]
        s, load, potential, slope = np.array(every).T
        work, error = quadrature(s, load, slope)
        change, system = float(potential[-1] - potential[-2]), self.system
        floor = UNEQUAL * unit(*potential, *(load * slope), one=system.scene.units.energy)
        if not abs(change - work) <= SHARE * error + floor:
            raise ConvergenceError(
                f"From {system.scene.load} = {load[-2]:.8g} to {load[-1]:.8g} the total potential energy changes by "
                f"{change:.6g}, and the load's work explains {work:.6g}: these states are not on one branch, or a "
                f"potential is not continuous; {SMALLER_STEPS}."
            )

    def _evaluated(self, row: Point) -> tuple[Point, float, float]:
        for known in self._known:
            if known[0] is row:
                return known
        state = self.system.at(row.x)
        return row, state.potential(), state.load_derivative()


def quadrature(s: np.ndarray, load: np.ndarray, slope: np.ndarray) -> tuple[float, float]:
    """Integral of ``slope`` over ``load`` from the last but one to the last of four places ``s``, and its error.

    The error is the greatest difference between successive orders: of four, three and two places.
    """
    powers, values = (((s - s[-1]) / (s[-1] - s[-2]))[:, None]) ** np.arange(ROWS), np.array([slope, load]).T
    found = []
    for count in (ROWS, ROWS - 1):
        g, p = np.linalg.solve(powers[-count:, :count], values[-count:]).T
        found.append(float(g @ _INTEGRALS[:count, :count] @ p))
    trapezium = float((load[-1] - load[-2]) * (slope[-1] + slope[-2]) / 2)
    return found[0], max(abs(found[0] - found[1]), abs(found[1] - trapezium))

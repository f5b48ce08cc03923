r"""Energy and work: along a branch the potential energy changes by the work of the load.

With ``L(x, lam)`` the Lagrangian and ``x(s), lam(s)`` equilibria, ``L_x = 0``, so that ``dV = L_lam dlam = -c dlam``
with the conjugate ``c`` of the load (:class:`~rodfem.fem.state.Energies`).  Residuals, tangents and indices have no
part in it.  Over a step

    V_b - V_a + int_a^b c dlam = 0,

with ``c`` and ``lam`` interpolated in arclength through the last rows.  What is left is the *imbalance*, of fourth
order in the step.  It is compared with what one row more changes in the integral over the step before, which does not
have the new state in it.  Where it is larger the step is divided, by equilibria in between: on one branch the imbalance
vanishes with the length of the pieces, that of a jump stays.

Two branches that meet at a load ``p`` differ in energy by ``(lam - p)^2`` only.  A jump near ``p`` is told by
directions (:mod:`rodfem.continuation.jumping`), one between branches that run beside each other by the energy.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf, isfinite

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.jumping import between
from rodfem.continuation.prediction import ROWS

ORDER = 4
"""Order of the integral through four rows, in the length of the step."""
SAFETY = 4.0
"""Imbalance, relative to what is expected after the step before, up to which nothing is suspected."""
ROUND_OFF = 1e-10
"""Imbalance that is none, relative to the energies themselves."""
DIVISIONS, SHRUNK = 3, 6.0
"""How many times a step is divided, and by how much each division but the first makes the imbalance smaller."""


class EnergyBalance:
    """Compares energy and work over the steps of branches."""

    def __init__(self) -> None:
        """No step has been compared yet."""
        self._last: tuple[Point | None, float] = None, 0.0

    def __call__(self, solver: BranchSolver, rows: Sequence[Point]) -> bool:
        """Whether the potential energy changes by the work of the load over the step to the last of the ``rows``.

        All are states of ``solver``, the first three or more on one branch.  Where there are fewer, or loads have no
        potential, there is nothing to be compared.
        """
        known, a, b = rows[-ROWS - 1 : -1], rows[-2], rows[-1]
        if len(known) < 3 or not all(isfinite(p.potential) and p.mesh == b.mesh for p in rows):
            return True
        last, changed = self._last
        changed = changed if last is a else _integral(known)[1]
        length, before = b.arclength - a.arclength, a.arclength - known[-2].arclength
        work, change = _integral(rows[-ROWS:])
        self._last = b, change
        off = abs(b.potential - a.potential + work)
        scale = max(abs(x) for p in (a, b) for x in (p.potential, p.energy, p.load * p.conjugate))
        # a drift is a load as well, and does work
        noise = ROUND_OFF * max(scale, solver.units.energy) + max(a.drift, b.drift) * length
        expected = changed * max(1.0, length / before) ** ORDER
        return off <= SAFETY * expected + noise or _vanishes(solver, a, b, noise)


def _vanishes(solver: BranchSolver, a: Point, b: Point, noise: float) -> bool:
    """Whether the imbalance between two rows vanishes as the piece is divided.

    Work is that of trapezoids, extrapolated as if the pieces were halves (Romberg): on one branch a sixteenth is left
    by a division.  At a jump a trapezoid is wrong in proportion to its length, and half of that is left.
    """
    pieces, trapezoids, off = [a, b], _trapezoids([a, b]), inf
    for _ in range(DIVISIONS):
        divided = [a]
        for p, q in pairwise(pieces):
            middle = between(solver, p, q)
            if middle is None:
                return False
            middle.load = solver.system.scalar(middle.x)
            middle.energy, middle.potential, middle.conjugate = solver.energies(middle.x)
            divided += [middle, q]
        before, last = trapezoids, off
        pieces, trapezoids = divided, _trapezoids(divided)
        off = abs(b.potential - a.potential + (4 * trapezoids - before) / 3)
        if off <= noise:
            return True
        if off > last / SHRUNK:
            return False
    return True


def _trapezoids(rows: Sequence[Point]) -> float:
    """``int c dlam`` from the first of the rows to the last."""
    return sum((p.conjugate + q.conjugate) / 2 * (q.load - p.load) for p, q in pairwise(rows))


def _integral(rows: Sequence[Point]) -> tuple[float, float]:
    """``int c dlam`` over the last step through all ``rows``, and its largest change by one row more."""
    a, b = rows[-2:]
    works = [_work(rows[-count:], a, b) for count in range(3, len(rows) + 1)]
    return works[-1], max(abs(x - y) for x, y in pairwise([_trapezoids([a, b]), *works]))


def _work(rows: Sequence[Point], a: Point, b: Point) -> float:
    """``int c dlam`` from ``a`` to ``b``, two of the ``rows``; ``c`` and ``lam`` are polynomials through all."""
    middle, half = (a.arclength + b.arclength) / 2, (b.arclength - a.arclength) / 2
    places = [(p.arclength - middle) / half for p in rows]
    conjugate, load = (_polynomial(places, x) for x in ([p.conjugate for p in rows], [p.load for p in rows]))
    # int t^j d(t^k) from -1 to 1 is 2 k/(j + k), or zero
    return sum(
        2 * k / (j + k) * c * lam for k, lam in enumerate(load) for j, c in enumerate(conjugate) if k and (j + k) % 2
    )


def _polynomial(places: Sequence[float], values: Sequence[float]) -> list[float]:
    """Coefficients, constant first, of the polynomial that has ``values`` at ``places``: Newton's form, expanded."""
    divided, count = list(values), len(places)
    for order in range(1, count):
        for i in range(count - 1, order - 1, -1):
            divided[i] = (divided[i] - divided[i - 1]) / (places[i] - places[i - order])
    found = [0.0] * count
    for place, value in zip(reversed(places), reversed(divided), strict=True):  # found = found * (t - place) + value
        for j in range(count - 1, 0, -1):
            found[j] = found[j - 1] - place * found[j]
        found[0] = value - place * found[0]
    return found

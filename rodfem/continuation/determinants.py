r"""Test functions of pairs of crossings: the determinant of the saddle matrix, whole, and that of its low modes.

The determinant is the product of all eigenvalues.  What grows with the load moves all of them, stiffnesses, foundations
and tension alike: with hundreds of modes it may grow a hundredfold in a step, and hides the one eigenvalue that comes
and goes.  The ratio

    det S / det (S + sigma M) = prod_i lambda_i / (lambda_i + sigma)

is exact for the constrained pencil (``M`` is zero on multipliers, whose infinite eigenvalues give a factor of one), and
modes far above ``sigma`` do not count, whatever moves them.  The shift is the larger of the lowest bending eigenvalue
and of twice that nearest zero; where this one is far below the other, as of a rod that has softened, it is another
shift to be tried.  The ratio takes a factorisation a row, and has poles where an eigenvalue is ``-sigma``: it is asked
last, where the determinant changes so much that it may hide a pair.  Before it the determinant is divided by
``exp(c s)``, which has no zero either: ``c`` is the rate at which it grew along the branch before, as where all
stiffnesses grow with the load.

Crossings that are known are taken out, too: a pair in the same step as one, or in the next one, would not show in a
function that passes zero there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import exp, isfinite, log
from typing import NamedTuple

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import ROUGH

STEEP = 1.0
"""Change of the logarithm of a determinant, from row to row, above which it may hide a pair of crossings."""
BEYOND = 2.0
"""Shift over the distance from zero of the eigenvalue nearest to it, which may be a negative one: that is no pole."""
FARTHER, TIMES = 4.0, 8
"""Ratio of the next shift to one that negative eigenvalues come near, and how many are tried."""
FAR = 0.1
"""Ratio of two shifts below which both are tried."""
LARGEST = 600.0
"""Largest logarithm of the ratio of two determinants."""
Logarithm = Callable[[Point], float]
"""Logarithm of the size of a test function at a row; nan if not known."""


class Crossing(NamedTuple):
    """A special point that is known: its ``arclength``, and by how much the index ``changes`` there."""

    arclength: float
    changes: int

    @classmethod
    def at(cls, special: SpecialPoint) -> Crossing:
        """Crossing at a special point."""
        return cls(special.point.arclength, special.negative_after - special.negative_before)


def whole(row: Point) -> float:
    """Logarithm of the size of the determinant at a row."""
    return row.determinant


def steep(rows: Sequence[Point], known: Sequence[Crossing] = ()) -> bool:
    """Whether the determinant changes by so much between neighbours among ``rows`` that it may hide a pair.

    That is without the crossings that are ``known``.
    """
    return any(not abs(_difference(whole, b, a, known)) <= STEEP for a, b in pairwise(rows))


def without_growth(earlier: Sequence[Point], known: Sequence[Crossing]) -> Logarithm | None:
    """The determinant over what it grows by along the branch, as it did between ``earlier`` rows; None if unknown.

    Crossings that are ``known`` are no growth.
    """
    if len(earlier) < 2:
        return None
    first, last = earlier[0], earlier[-1]
    rate = _difference(whole, last, first, known) / (last.arclength - first.arclength)
    return (lambda row: row.determinant - rate * row.arclength) if isfinite(rate) else None


def functions(
    solver: BranchSolver, rows: Sequence[Point], known: Sequence[Crossing] = (), earlier: Sequence[Point] = ()
) -> Iterator[tuple[str, Logarithm]]:
    """Yield those that may show a pair beside ``rows`` on the mesh of ``solver``, each when the last one has not.

    Each comes with its name, the same from row to row.  Crossings that are ``known`` do not count; ``earlier`` rows on
    the mesh tell how the determinant grows.
    """
    yield "whole", whole
    if steep(rows, known):
        if (steady := without_growth(earlier, known)) is not None:
            yield "without growth", steady
        nearest, usual = BEYOND * max(_nearest(solver, row) for row in rows), solver.inertia.scale
        yield "low modes", LowModes.without_poles(solver, rows, max(nearest, usual))
        if 0.0 < nearest < FAR * usual:
            yield "lowest modes", LowModes.without_poles(solver, rows, nearest)


def _nearest(solver: BranchSolver, row: Point) -> float:
    """Distance of the eigenvalue nearest zero from zero at a row, symmetry modes left out; 0 where a count fails."""
    if row.nearest:
        return row.nearest
    found = solver.inertia.at(row.x)
    try:
        found.count()
    except ConvergenceError:
        return 0.0
    with solver.inertia.afresh():
        return abs(float(found.nearest(1, ROUGH)[0][0]))


def _below(solver: BranchSolver, row: Point, shift: float) -> int:
    """Number of eigenvalues at a row below a ``shift``; 1 where the count fails, at one of them."""
    try:
        return solver.inertia.at(row.x).below(shift)
    except ConvergenceError:
        return 1


class LowModes:
    """Logarithm of the size of the determinant of the low modes at rows of one mesh."""

    def __init__(self, solver: BranchSolver, sigma: float) -> None:
        """With a shift ``sigma``, positive, for the rows on the mesh of ``solver``."""
        self.solver, self.sigma = solver, sigma
        self._known: list[tuple[Point, float]] = []

    @classmethod
    def without_poles(cls, solver: BranchSolver, rows: Sequence[Point], sigma: float) -> LowModes:
        """With a shift of ``sigma``, or more: twice as far from zero as negative eigenvalues at the ``rows``."""
        for _ in range(TIMES):
            if not any(row.negative and _below(solver, row, -sigma / BEYOND) for row in rows):
                break
            sigma *= FARTHER
        return cls(solver, sigma)

    def __call__(self, row: Point) -> float:
        """Evaluate it at a row; nan at a pole."""
        for other, value in self._known:
            if other is row:
                return value
        found = self.solver.inertia.at(row.x)
        try:
            value = row.determinant
            if not row.nearest:  # that was counted by two shifts, and its determinant is that of the second one
                found.below(0.0)
                value = found.factors.determinant()
            found.below(-self.sigma)
            value -= found.factors.determinant()
        except ConvergenceError:
            value = float("nan")
        self._known.append((row, value))
        return value


def relative(
    logarithm: Logarithm, row: Point, other: Point, multiplicity: int, known: Sequence[Crossing] = ()
) -> float:
    """Root of a test function at a ``row`` over that at an ``other`` one, signed by their indices; nan if not known.

    The function has the ``logarithm``, and as many eigenvalues vanish together as ``multiplicity`` says.  It is divided
    by the distances from all crossings that are ``known``.
    """
    exponent = _difference(logarithm, row, other, known) / multiplicity
    # the sign of a determinant changes with each negative eigenvalue
    odd = row.negative - other.negative - changes(known, other, row)
    return float((-1) ** odd * exp(min(exponent, LARGEST)))


def changes(known: Sequence[Crossing], a: Point, b: Point) -> int:
    """Change of the index from the row ``a`` to ``b`` by the crossings that are ``known`` between them."""
    low, high = sorted((a.arclength, b.arclength))
    there = sum(crossing.changes for crossing in known if low < crossing.arclength < high)
    return there if a.arclength < b.arclength else -there


def _difference(logarithm: Logarithm, row: Point, other: Point, known: Sequence[Crossing]) -> float:
    """Logarithm of a function at a ``row`` less that at an ``other`` one, without ``known`` crossings; nan at one."""
    found = logarithm(row) - logarithm(other)
    for crossing in known:
        here, there = abs(row.arclength - crossing.arclength), abs(other.arclength - crossing.arclength)
        if not here or not there:
            return float("nan")
        found -= abs(crossing.changes) * log(here / there)
    return found

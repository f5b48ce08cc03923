r"""Test functions of pairs of crossings: the determinant of the saddle matrix, whole, and that of its low modes.

The determinant is the product of all eigenvalues.  What grows with the load moves all of them, stiffnesses, foundations
and tension alike: with hundreds of modes it may grow a hundredfold in a step, and hides the one eigenvalue that comes
and goes.  The ratio

    det S / det (S + sigma M) = prod_i lambda_i / (lambda_i + sigma)

is exact for the constrained pencil (``M`` is zero on multipliers, whose infinite eigenvalues give a factor of one), and
modes far above ``sigma`` do not count, whatever moves them.  The shift is the larger of the lowest bending eigenvalue
and of that nearest zero; where this one is far below the other, as of a rod that has softened, it is another shift to
be tried.  The ratio takes a factorisation a row, and has poles where an eigenvalue is ``-sigma``: it is asked second,
where the determinant changes so much that it may hide a pair.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import exp

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import ConvergenceError
from rodfem.stability.inertia import ROUGH

STEEP = 1.0
"""Change of the logarithm of a determinant, from row to row, above which it may hide a pair of crossings."""
FAR = 0.1
"""Ratio of two shifts below which both are tried."""
LARGEST = 600.0
"""Largest logarithm of the ratio of two determinants."""
Logarithm = Callable[[Point], float]
"""Logarithm of the size of a test function at a row; nan if not known."""


def whole(row: Point) -> float:
    """Logarithm of the size of the determinant at a row."""
    return row.determinant


def steep(rows: Sequence[Point]) -> bool:
    """Whether the determinant changes by so much between neighbours among ``rows`` that it may hide a pair."""
    return any(abs(b.determinant - a.determinant) > STEEP for a, b in pairwise(rows))


def functions(solver: BranchSolver, rows: Sequence[Point]) -> Iterator[Logarithm]:
    """Yield those that may show a pair beside ``rows`` on the mesh of ``solver``, each when the last one has not."""
    yield whole
    if steep(rows):
        nearest, usual = max(_nearest(solver, row) for row in rows), solver.inertia.scale
        yield LowModes(solver, max(nearest, usual))
        if 0.0 < nearest < FAR * usual:
            yield LowModes(solver, nearest)


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


class LowModes:
    """Logarithm of the size of the determinant of the low modes at rows of one mesh."""

    def __init__(self, solver: BranchSolver, sigma: float) -> None:
        """With a shift ``sigma``, positive, for the rows on the mesh of ``solver``."""
        self.solver, self.sigma = solver, sigma
        self._known: list[tuple[Point, float]] = []

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


def relative(logarithm: Logarithm, row: Point, other: Point, multiplicity: int) -> float:
    """Root of a test function at a ``row`` over that at an ``other`` one, signed by their indices; nan if not known.

    The function has the ``logarithm``, and as many eigenvalues vanish together as ``multiplicity`` says.
    """
    # the sign of a determinant changes with each negative eigenvalue
    exponent = (logarithm(row) - logarithm(other)) / multiplicity
    return float((-1) ** (row.negative - other.negative) * exp(min(exponent, LARGEST)))

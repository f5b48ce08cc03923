"""Check that a step along a branch has stayed on it: by equilibria between its ends, and by the work of the load.

About a piece of a branch in which that, or its special points, are hard to tell apart steps are made shorter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.jumping import joined, suspected
from rodfem.continuation.observer import Observer
from rodfem.continuation.work import EnergyBalance
from rodfem.errors import SMALLER_STEPS, ConvergenceError

SHORTER = 2
"""How many times steps are made shorter about one piece."""
PARTS = 8
"""Steps into which a piece is divided, each time."""


class Unresolved(Exception):
    """A piece of a branch is to be looked at again, with shorter steps."""


@dataclass(frozen=True)
class _Piece:
    """Steps from arclength ``since`` ``until`` another are of at most the ``largest`` length, after some ``tries``."""

    since: float
    until: float
    largest: float
    tries: int


class ShorterSteps:
    """The bound of the steps of one branch: short ones about the pieces that were asked for.

    A piece is known for as long as the branch is followed: it may go back beyond one on account of another one, and
    would go to and fro between the two for ever if each were asked for as often.
    """

    def __init__(self, largest: float = inf, until: float = -inf) -> None:
        """Steps of at most ``largest`` up to the arclength ``until``."""
        self._pieces = [_Piece(-inf, until, largest, 0)]

    def ask(self, a: Point, b: Point) -> None:
        """Make steps shorter from ``a`` to beyond ``b`` and raise :class:`Unresolved`; return if they are already."""
        first, last = a.arclength, b.arclength
        inside = [piece for piece in self._pieces if piece.since < last and first < piece.until]
        tries = 1 + max((piece.tries for piece in inside), default=0)
        if tries <= SHORTER:
            length = last - first
            new = _Piece(first, last + length, length / PARTS, tries)
            self._pieces = [piece for piece in self._pieces if piece not in inside] + [new]
            raise Unresolved

    def reach(self, point: Point) -> float:
        """Largest step from a ``point``: up to the next piece, and then short ones."""
        ahead = (piece for piece in self._pieces if point.arclength < piece.until)
        return min((max(piece.largest, piece.since - point.arclength) for piece in ahead), default=inf)


class StepCheck:
    """Checks the steps of one branch, one after the other; what shorter steps do not mend is said."""

    def __init__(self, observer: Observer) -> None:
        """With the ``observer`` that hears of steps that are not explained."""
        self.observer, self._balance = observer, EnergyBalance()

    def __call__(self, solver: BranchSolver, rows: Sequence[Point], steps: ShorterSteps) -> None:
        """Check the step to the last of the ``rows`` on the mesh of ``solver``; ``steps`` are those of the branch.

        Along a family of equilibria at one load neither the path nor its tangent is determined, and nothing is checked.

        Raises
        ------
        Unresolved
            If the step may have jumped to another branch and shorter ones are to be tried.
        ConvergenceError
            Where the energy does not change by the work of the load, with shorter steps neither: the branch ends.
        """
        if len(rows) < 2 or solver.system.damping or any(p.tangent is None for p in rows):
            return
        a, b = rows[-2:]
        if suspected(solver, rows) and not joined(solver, a, b):
            steps.ask(a, b)
            self.observer.warn(
                f"Between loads {a.load:.8g} and {b.load:.8g} the branch may have been left for another one beside it: "
                f"no equilibria were found that join them; {SMALLER_STEPS}."
            )
            return
        if not self._balance(solver, rows):
            steps.ask(a, b)
            raise ConvergenceError(
                f"Between loads {a.load:.8g} and {b.load:.8g} the potential energy changes by "
                f"{b.potential - a.potential:.3g}, which is not the work of the load: these are no states of one "
                f"branch, or what the load does has a kink between them (begin beyond it, then); {SMALLER_STEPS}."
            )

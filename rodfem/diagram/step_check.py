"""Check that a step along a branch has stayed on it: by equilibria between its ends, and by the work of the load."""

from __future__ import annotations

from collections.abc import Sequence

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.jumping import halvings, suspected
from rodfem.continuation.observer import Observer
from rodfem.continuation.work import EnergyBalance
from rodfem.diagram.shorter_steps import ShorterSteps
from rodfem.errors import SMALLER_STEPS, ConvergenceError

BENT, NARROWEST = 2, 6
"""How many times a step that bends may be halved until it is one, and how many times steps are, at most, where not."""


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
        divided = halvings(solver, a, b) if suspected(solver, rows) else 0
        if divided is None:
            steps.ask(a, b)
            self.observer.warn(
                f"Between loads {a.load:.8g} and {b.load:.8g} the branch may have been left for another one beside it: "
                f"no equilibria were found that join them; {SMALLER_STEPS}."
            )
            return
        if divided > BENT:  # in a bend so narrow there may be pairs of special points
            steps.ask(a, b, 2 ** min(divided, NARROWEST))
            self.observer.warn(
                f"Between loads {a.load:.8g} and {b.load:.8g} the branch bends within a small part of a step: "
                f"special points may be missing there; {SMALLER_STEPS}."
            )
        if not self._balance(solver, rows):
            steps.ask(a, b)
            raise ConvergenceError(
                f"Between loads {a.load:.8g} and {b.load:.8g} the potential energy changes by "
                f"{b.potential - a.potential:.3g}, which is not the work of the load: these are no states of one "
                f"branch, or what the load does has a kink between them (begin beyond it, then); {SMALLER_STEPS}."
            )

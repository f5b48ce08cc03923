"""The loci of all special points of a diagram: the option ``--locus``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError, InputError
from rodfem.ranks import on_first

if TYPE_CHECKING:
    from rodfem.codim2.locus import Locus


def follow_all(
    branches: list[Branch],
    solvers: Sequence[BranchSolver],
    plan: Plan,
    output: Path,
    report: Report,
    figures: bool,
) -> None:
    """Follow all special points in the plane of two parameters; each into a file of its own, all into one picture.

    Each on the mesh on which it was found.

    Parameters
    ----------
    branches, solvers
        Those of the diagram, and of their meshes.
    plan
        What has the second parameter and its interval.
    output
        Folder for files, and pictures if ``figures``.
    report
        What hears of each.
    figures
        Whether pictures are drawn.
    """
    if plan.locus is None:
        return
    found = _Loci(plan, plan.locus, output, report, solvers)
    for branch in branches:
        found.follow(branch)
    if found.saved and figures:
        from rodfem.output.plot_locus import draw_locus

        on_first(found.comm, lambda: draw_locus(found.saved, output / "locus.png"))
        report.say(f"Loci in {output}{os.sep}: locus-1.json ..., locus.png")


class _Loci:
    """Loci of one run, in the plane of its load and the parameter of ``asked``; what :func:`follow_all` is given."""

    def __init__(
        self,
        plan: Plan,
        asked: tuple[str, float, float],
        output: Path,
        report: Report,
        solvers: Sequence[BranchSolver],
    ) -> None:
        """Nothing is followed yet."""
        self.solvers, self.output, self.report = solvers, output, report
        self.name, *self.interval = asked
        self.load, self.units = sorted(plan.over(solvers[0].system.scene)), solvers[0].units
        self.adapted = plan.accuracy is not None
        self.comm = solvers[0].system.comm
        self.saved: list[dict] = []

    def follow(self, branch: Branch) -> None:
        """Follow the special points of a branch, each that no locus of another one passes."""
        near: list[Locus] = []
        for special in branch.special:
            if not (special.kind.counted or special.kind.line) or special.connects_to is not None:
                continue
            which = f"{special.kind} of {branch.name} at {special.point.load:.8g}"
            if any(found.passes(special, self.units) for found in near):
                self.report.say(f"\nThe {which} is on a locus above")
                continue
            if self.adapted:
                self.report.say(
                    "\nA locus stays on the mesh of its special point: its own estimate says how accurate it is"
                )
            self.report.say(f"\nLocus of the {which}")
            self.report.working(f"locus {len(self.saved) + 1}, of the {which}")
            try:
                near.append(self._locus(special))
            except (InputError, ConvergenceError) as trouble:
                self.report.warn(str(trouble))

    def _locus(self, special: SpecialPoint) -> Locus:
        """Locus of a special point, said and saved."""
        from rodfem.codim2.follow import locus

        bounds = (self.load[0], self.load[1]), (self.interval[0], self.interval[1])
        found = locus(self.solvers[special.point.mesh], special, self.name, bounds)
        self.report.say(found.text())
        self.saved.append(found.data())
        on_first(self.comm, partial(found.save, self.output / f"locus-{len(self.saved)}.json"))
        return found

"""The loci of all special points of a diagram: the option ``--locus``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch
from rodfem.continuation.solvers import StaticSolver
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError, InputError
from rodfem.ranks import on_first


def follow_all(
    branches: list[Branch],
    solvers: Sequence[StaticSolver],
    plan: Plan,
    output: Path,
    report: Report,
    figures: bool,
    *,
    known: bool,
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
    known
        Whether loci that are in the folder are those of this run, and stay.
    """
    from rodfem.codim2.locus import Locus, locus
    from rodfem.output.plot_locus import draw_locus

    if plan.locus is None:
        return
    name, low, high = plan.locus
    span, comm = plan.over(solvers[0].system.scene), solvers[0].system.comm
    load = (min(span), max(span))
    saved: list[dict] = []
    for branch in branches:
        near: list[Locus] = []
        for special in branch.special:
            if not (special.kind.counted or special.kind.line) or special.connects_to is not None:
                continue
            if any(found.passes(special) for found in near):
                report.say(f"\nThe {special.kind} of {branch.name} at {special.point.load:.8g} is on a locus above")
                continue
            if plan.accuracy is not None:
                report.say("\nA locus stays on the mesh of its special point: its own estimate says how accurate it is")
            report.say(f"\nLocus of the {special.kind} of {branch.name} at {special.point.load:.8g}")
            file = output / f"locus-{len(saved) + 1}.json"
            try:
                found = Locus.read(file) if known and file.exists() else None
                if found is None or not found.starts_at(special):
                    found = locus(solvers[special.point.mesh], special, name, (load, (low, high)))
            except (InputError, ConvergenceError) as trouble:
                report.warn(str(trouble))
                continue
            report.say(found.text())
            saved.append(found.data())
            near.append(found)
            on_first(comm, partial(found.save, file))
    if saved and figures:
        on_first(comm, lambda: draw_locus(saved, output / "locus.png"))
        report.say(f"Loci in {output}{os.sep}: locus-1.json ..., locus.png")

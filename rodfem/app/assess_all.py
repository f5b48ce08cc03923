"""Verdicts on the states at the loads of a plan, and their modes: the options ``--method`` and ``--modes``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import USER
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.system import System
from rodfem.modes.finder import ModeFinder
from rodfem.modes.modes import save_modes
from rodfem.output.plot_modes import draw_modes
from rodfem.ranks import on_first
from rodfem.stability.assessment import Assessor


def check_method(system: System, plan: Plan) -> None:
    """Raise :class:`InputError` for a method that does not apply, before anything is computed."""
    Assessor(system).choose(plan.method or "auto", plan.modes)


def assess_all(
    branches: list[Branch], solvers: Sequence[BranchSolver], plan: Plan, output: Path, report: Report, figures: bool
) -> None:
    """Assess the states at the loads of the plan; save and draw their modes, if they are wanted.

    Each on the mesh on which it was computed.  ``branches`` are those of the diagram, ``solvers`` those of their meshes
    by number.  The ``plan`` names method, loads and number of modes.  Files go to the folder ``output``, pictures too
    if ``figures``, sentences to the ``report``.
    """
    system = solvers[0].system
    scene = system.scene
    about = {"scene": scene.name, "title": scene.title or scene.name, "parameter": scene.load}
    about |= {k: v for k, v in asdict(system.fields.discretization).items() if k != "vertices"}
    which = "left-most eigenvalues mu = omega^2" if scene.conservative else "eigenvalues mu = omega^2 nearest zero"
    report.say(f"\nIs it stable? ({which})")
    finders: dict[int, ModeFinder] = {}
    saved: list[tuple[str, int]] = []
    for branch, special in ((b, s) for b in branches for s in b.special if s.kind == USER):
        where, mesh = f"{scene.load} = {special.point.load:.10g}", special.point.mesh
        if mesh not in finders:
            finders[mesh] = ModeFinder(solvers[mesh], plan.error_bars)
        finder = finders[mesh]
        report.working(f"{branch.name} at {where}: stability{' and modes' if plan.modes else ''}")
        try:
            if not plan.modes:
                report.verdict(branch.name, where, finder.assessor(special.point.x, plan.method).at(special.point))
                continue
            verdict, modes = finder(special.point.x, plan.modes, plan.method or "auto")
        except (InputError, ConvergenceError) as trouble:
            report.warn(str(trouble))
            continue
        report.verdict(branch.name, where, verdict.at(special.point), modes)
        keep = partial(save_modes, modes, output / "modes.h5", branch.name, special.row, about)
        on_first(system.comm, partial(keep, first=not saved, scene=scene))
        saved.append((branch.name, special.row))
    if not saved:
        return
    pictures = [f"modes-{name.replace(' ', '-')}-{row}" for name, row in saved] if figures else []
    for (name, row), picture in zip(saved, pictures, strict=False):
        report.working(f"{name}, row {row}: pictures and animations of its modes")
        for suffix in (".png", ".gif"):
            target = output / f"{picture}{suffix}"
            on_first(system.comm, partial(draw_modes, output / "modes.h5", name, row, target))
    report.say(f"Modes in {output}{os.sep}: {', '.join(['modes.h5', *(f'{p}.png, .gif' for p in pictures)])}")

"""One run of a scene from beginning to end: solve, save as it goes, draw."""

from __future__ import annotations

import atexit
import gc
import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from mpi4py import MPI

from rodfem.app.interrupts import held
from rodfem.app.terminal import Report
from rodfem.continuation.branch import Branch
from rodfem.continuation.solvers import StaticSolver
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import MESH, RANKS, SCENE
from rodfem.diagram.trace import PLAN, trace
from rodfem.errors import ConvergenceError, InputError
from rodfem.fem.fields import Discretization
from rodfem.fem.system import System
from rodfem.output.files import save_json, save_run
from rodfem.output.folder import locked, remove_earlier
from rodfem.output.typical import typical_state
from rodfem.problem.arguments import checked, function, path, yes_or_no
from rodfem.problem.scene import Scene
from rodfem.ranks import on_first

atexit.register(gc.freeze)  # what there is at the end goes with the process: a search for garbage in it takes 0.15 s

GREEK = {r"\lambda": "\N{GREEK SMALL LETTER LAMDA}"}
"""Plain text for TeX names in the caption of a picture."""


@checked(
    scene=SCENE,
    discretization=MESH,
    plan=PLAN,
    output=path("results/column"),
    figures=yes_or_no,
    comm=RANKS,
    quiet=yes_or_no,
    words=function("str"),
)
def run(
    scene: Scene,
    discretization: Discretization | None = None,
    plan: Plan | None = None,
    output: Path | str | None = None,
    *,
    figures: bool = True,
    comm: MPI.Comm = MPI.COMM_WORLD,
    quiet: bool = False,
    words: Callable[[str], str] = str,
) -> Diagram:
    """Trace a scene, and write ``diagram.json``, ``states.h5`` and (on rank 0) the pictures into ``output``.

    Files are updated after every branch: an interrupted run keeps all completed branches.  Those of an earlier run in
    the folder stay until the first branch is complete.  Returns the diagram.  Raises
    :class:`~rodfem.errors.InputError` for bad input, before any computation, and where the folder cannot be written any
    more or is in use by another process, and
    :class:`~rodfem.errors.ConvergenceError` where not even a first equilibrium is found.

    Parameters
    ----------
    scene
        Statement of the problem.
    discretization
        By default 8 elements of degree 6, or a few to start with where the plan has an accuracy.
    plan
        By default the range of the scene.
    output
        Folder, by default ``results/<name>``.
    figures
        Whether pictures are drawn.
    comm
        The ranks that share the rod.
    quiet
        Whether nothing is printed.
    words
        Rewords each line on the terminal.
    """
    plan = plan or Plan()
    output = Path(output or Path("results") / scene.name)
    plan.check(scene, discretization or Discretization())
    terminal = Terminal(plan, output, comm, quiet, words)
    with locked(output, comm):
        diagram = trace(scene, discretization, plan, terminal, comm=comm)
        _report(diagram, terminal, figures)
    return diagram


def _report(diagram: Diagram, terminal: Terminal, figures: bool) -> None:
    """Print tables, do what the plan asks for beyond branches, and draw the pictures if ``figures``."""
    scene, plan, output, comm = diagram.scene, terminal.plan, terminal.output, diagram.solvers[0].system.comm
    branches, clock = diagram.branches, diagram.clock
    on_first(comm, lambda: save_json(diagram.data, output / "diagram.json"))
    terminal.table(branches, diagram.solvers[0].system, plan.most_branches)
    terminal.summary(diagram.data)
    terminal.spectra(branches, scene)
    terminal.frequencies(branches, scene.load)
    terminal.timing(clock, sum(len(b.points) for b in branches))
    terminal.say(f"Results in {output}{os.sep}: diagram.json, states.h5")
    if plan.method or plan.modes:
        from rodfem.app.assess_all import assess_all

        assess_all(branches, diagram.solvers, plan, output, terminal, figures)
    if plan.locus is not None:
        _loci(branches, diagram.solvers, plan, output, terminal, figures)
    if figures:
        on_first(comm, lambda: _draw(output, terminal))


class Terminal(Report):
    """Shows a run on the terminal, and keeps its files up to date."""

    def __init__(
        self, plan: Plan, output: Path, comm: MPI.Comm, quiet: bool, words: Callable[[str], str] = str
    ) -> None:
        """Write into the folder ``output``, which there is; with ``quiet`` print nothing.

        The ``plan`` says what is printed; ``comm`` has the ranks, of which the first one writes; ``words`` rewords each
        line.
        """
        super().__init__(comm, words=words)
        if quiet:
            self.on = self.live = False
        self.plan, self.output = plan, output

    def system(self, system: System, accuracy: float | None = None) -> None:
        """Say what is solved, and refuse a method that does not apply before anything is computed."""
        super().system(system, accuracy)
        if self.plan.method or self.plan.modes:
            from rodfem.app.assess_all import check_method

            check_method(system, self.plan)

    def complete(self, diagram: Diagram) -> None:
        """Save all that there is: an interrupted run keeps all completed branches."""
        with diagram.clock("files"), held():
            first = len(diagram) == 1
            if first:
                on_first(diagram.solvers[0].system.comm, lambda: remove_earlier(self.output))
            save_run(diagram.data, diagram.branches[-1:], diagram.solvers, self.output, first=first)


def _loci(
    branches: list[Branch], solvers: Sequence[StaticSolver], plan: Plan, output: Path, report: Report, figures: bool
) -> None:
    """Follow all special points in the plane of two parameters; each into a file of its own, all into one picture.

    Each on the mesh on which it was found.
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
        known: list[Locus] = []
        for special in branch.special:
            if not (special.kind.counted or special.kind.line) or special.connects_to is not None:
                continue
            if any(found.passes(special) for found in known):
                report.say(f"\nThe {special.kind} of {branch.name} at {special.point.load:.8g} is on a locus above")
                continue
            if plan.accuracy is not None:
                report.say("\nA locus stays on the mesh of its special point: its own estimate says how accurate it is")
            report.say(f"\nLocus of the {special.kind} of {branch.name} at {special.point.load:.8g}")
            try:
                found = locus(solvers[special.point.mesh], special, name, (load, (low, high)))
            except (InputError, ConvergenceError) as trouble:
                report.warn(str(trouble))
                continue
            report.say(found.text())
            saved.append(found.data())
            known.append(found)
            on_first(comm, partial(found.save, output / f"locus-{len(saved)}.json"))
    if saved and figures:
        on_first(comm, lambda: draw_locus(saved, output / "locus.png"))
        report.say(f"Loci in {output}{os.sep}: locus-1.json ..., locus.png")


def _draw(output: Path, report: Report) -> None:
    """Draw the diagram, and the shape of a stable state if there is one."""
    from rodfem.output.files import load_json
    from rodfem.output.plot_diagram import draw_diagram
    from rodfem.output.plot_frequencies import draw_frequencies
    from rodfem.output.render import draw_shape_safely

    data = load_json(output / "diagram.json")
    if any("omega2" in branch["columns"] for branch in data["branches"]):
        draw_frequencies(data, output / "diagram.png")
        report.say(f"Picture in {output}{os.sep}: diagram.png")
        return
    draw_diagram(data, output / "diagram.png")
    branch, row, words = typical_state(data)
    caption = f"{data['title']}, {branch}, {GREEK.get(data['parameter_label'], data['parameter'])} = {words}"
    picture = output / "shape.png"
    trouble = draw_shape_safely(output / "states.h5", branch, row, picture, caption=caption)
    report.say(f"Pictures in {output}{os.sep}: diagram.png" + ("" if trouble else ", shape.png"))
    if trouble:
        report.say(trouble)

"""One run of a scene from beginning to end: solve, save as it goes, draw."""

from __future__ import annotations

import atexit
import gc
import os
from collections.abc import Callable
from pathlib import Path
from shlex import quote

from mpi4py import MPI

from rodfem.app.interrupts import held
from rodfem.app.loci import follow_all
from rodfem.app.persons_file import leave_the_run
from rodfem.app.run_terminal import Terminal
from rodfem.app.terminal import Report
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import MESH, RANKS, SCENE
from rodfem.diagram.trace import PLAN, traced
from rodfem.fem.fields import Discretization
from rodfem.output.files import save_json
from rodfem.output.pieces import typical_state
from rodfem.problem.arguments import checked, function, path, yes_or_no
from rodfem.problem.scene import Scene
from rodfem.ranks import on_first
from rodfem.whole_files import locked

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

    Files are updated after every branch: an interrupted run keeps all completed branches, which :func:`rodfem.load`
    reads; to have the others, run the scene anew.  Those of an earlier run in the folder stay until the first branch is
    complete.  Returns the diagram.  A file that ``rodfem run FILE.py`` reads for its rod ends here: that command runs
    it.  Raises :class:`~rodfem.errors.InputError` for bad input, before any computation, and where the folder cannot be
    written any more or is in use by another process, and :class:`~rodfem.errors.ConvergenceError` where not even a
    first equilibrium is found.

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
    leave_the_run()
    plan, discretization = plan or Plan(), discretization or Discretization()
    output = Path(output or Path("results") / scene.name)
    plan.check(scene, discretization)
    terminal = Terminal(plan, output, comm, quiet, words)
    with locked(output, comm), terminal:
        diagram = traced(scene, discretization, plan, terminal, comm)
        _report(diagram, terminal, figures)
    return diagram


def _report(diagram: Diagram, terminal: Terminal, figures: bool) -> None:
    """Print tables, do what the plan asks for beyond branches, and draw the pictures if ``figures``."""
    scene, plan, output, comm = diagram.scene, terminal.plan, terminal.output, diagram.solvers[0].system.comm
    branches, clock = diagram.branches, diagram.clock
    terminal.save(diagram)
    data = diagram.data
    on_first(comm, lambda: save_json(data, output / "diagram.json"))
    terminal.table(data, branches, plan.most_branches)
    terminal.summary(data)
    terminal.spectra(branches, scene)
    terminal.frequencies(branches, scene.load)
    terminal.timing(clock, sum(len(b.points) for b in branches))
    terminal.say(f"Results in {output}{os.sep}: diagram.json, states.h5 (rodfem view {quote(str(output))} shows them)")
    if plan.method or plan.modes:
        from rodfem.app.assess_all import assess_all

        assess_all(branches, diagram.solvers, plan, output, terminal, figures)
    if plan.locus is not None:
        follow_all(branches, diagram.solvers, plan, output, terminal, figures)
    if figures:
        terminal.working("pictures")
        on_first(comm, lambda: draw(output, terminal))
    diagram.complete = True
    with held():
        on_first(comm, lambda: save_json(data | {"complete": True}, output / "diagram.json"))


def draw(output: Path, report: Report) -> None:
    """Draw the diagram, and beside it in a second process the shape of a stable state if there is one."""
    from concurrent.futures import ThreadPoolExecutor

    from rodfem.output.files import load_json
    from rodfem.output.plot_diagram import draw_diagram
    from rodfem.output.plot_frequencies import draw_frequencies
    from rodfem.output.render import draw_shape_safely

    data = load_json(output / "diagram.json")
    if any("omega2" in branch["columns"] for branch in data["branches"]):
        draw_frequencies(data, output / "diagram.png")
        report.say(f"Picture in {output}{os.sep}: diagram.png")
        return
    branch, row, words = typical_state(data)
    caption = f"{data['title']}, {branch}, {GREEK.get(data['parameter_label'], data['parameter'])} = {words}"
    with ThreadPoolExecutor(1) as beside:  # the shape is drawn by a process of its own, for which the thread waits
        shape = beside.submit(
            draw_shape_safely, output / "states.h5", branch, row, output / "shape.png", caption=caption
        )
        draw_diagram(data, output / "diagram.png")
    trouble = shape.result()
    report.say(f"Pictures in {output}{os.sep}: diagram.png" + ("" if trouble else ", shape.png"))
    if trouble:
        report.say(trouble)

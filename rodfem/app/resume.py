"""A run that was interrupted goes on."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from mpi4py import MPI

from rodfem.app.earlier import earlier_in
from rodfem.app.run import carry_out, draw
from rodfem.app.run_terminal import Terminal, branches_in_words
from rodfem.diagram.asked import as_asked, check_asked, plan_of, prints
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.journal import discretization_of
from rodfem.diagram.plan import Plan
from rodfem.diagram.saved import load
from rodfem.diagram.solver import MESH, RANKS, SCENE
from rodfem.diagram.trace import PLAN
from rodfem.fem.fields import Discretization
from rodfem.output.folder import locked
from rodfem.problem.arguments import checked, function, path, yes_or_no
from rodfem.problem.scene import Scene
from rodfem.ranks import on_first


@checked(
    folder=path("results/column"),
    scene=SCENE,
    discretization=MESH,
    plan=PLAN,
    figures=yes_or_no,
    comm=RANKS,
    quiet=yes_or_no,
    words=function("str"),
)
def resume(
    folder: Path | str,
    scene: Scene,
    discretization: Discretization | None = None,
    plan: Plan | None = None,
    *,
    figures: bool = True,
    comm: MPI.Comm = MPI.COMM_WORLD,
    quiet: bool = False,
    words: Callable[[str], str] = str,
) -> Diagram:
    """Go on with a run of :func:`rodfem.run` that was interrupted, from the branches that its folder holds.

    The diagram is that of a run which was not interrupted, on any number of ranks.  In a folder without a run one
    begins; that of a complete run is drawn once more, and nothing is computed.  Returns the diagram.

    Parameters
    ----------
    folder
        Folder of the run.
    scene
        The rod: a file holds numbers, not the functions that state a scene.
    discretization, plan
        Those of the run, which its files know unless the plan has events or steps of its own.
    figures
        Whether pictures are drawn.
    comm
        The ranks that share the rod.
    quiet
        Whether nothing is printed.
    words
        Rewords each line on the terminal.

    Raises :class:`~rodfem.errors.InputError` where the folder holds the run of another scene, plan or discretisation,
    or files that cannot be read, and as :func:`rodfem.run` does.
    """
    folder = Path(folder)
    with locked(folder, comm):
        earlier = earlier_in(folder, comm)
        if earlier is not None:
            plan = plan or plan_of(earlier.asked, folder)
            discretization = discretization or discretization_of(earlier.asked["discretization"])
        plan, discretization = plan or Plan(), discretization or Discretization()
        plan.check(scene, discretization)
        terminal = Terminal(plan, folder, comm, quiet, words, earlier)
        if earlier is None:
            return carry_out(scene, discretization, terminal, figures, comm)
        asked = as_asked(scene, discretization, plan)
        check_asked(earlier.asked, asked, folder)
        if not earlier.complete:
            return carry_out(scene, discretization, terminal, figures, comm)
        diagram = load(folder, scene, comm)
        check_asked(earlier.asked, asked | prints(diagram.solvers[0].system, plan), folder)
        done = branches_in_words(len(diagram))
        terminal.say(f"The run in {folder}{os.sep} is complete ({done}): nothing is left to compute")
        if figures:
            on_first(comm, lambda: draw(folder, terminal))
        return diagram

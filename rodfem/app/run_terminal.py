"""The terminal of a run, which keeps its files up to date."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path

from mpi4py import MPI

from rodfem.app.interrupts import held
from rodfem.app.terminal import Report
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.plan import Plan
from rodfem.fem.system import System
from rodfem.modes.finder import typical_modes
from rodfem.output.files import save_run
from rodfem.output.folder import remove_earlier
from rodfem.ranks import on_first


def _other_run(folder: Path) -> str:
    """Date and command of the run that a folder holds; empty if it holds none, or one of the same command."""
    try:
        origin = json.loads((folder / "diagram.json").read_text())["origin"]
        command, date = shlex.split(origin["command"]), str(origin["date"])[:10]
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return ""
    if command == sys.orig_argv:
        return ""
    at = next((i for i, word in enumerate(command) if Path(word).name == "rodfem"), 0)
    said = shlex.join(["rodfem", *command[at + 1 :]] if at else command)
    return f"run of {date}, {''.join(c for c in said if c.isprintable())}"


class Terminal(Report):
    """Shows a run on the terminal, and keeps its files up to date.

    Attributes
    ----------
    plan, output
        What is asked for, and the folder for it.
    """

    def __init__(
        self, plan: Plan, output: Path, comm: MPI.Comm, quiet: bool, words: Callable[[str], str] = str
    ) -> None:
        """Write into the folder ``output``, which there is; with ``quiet`` print nothing.

        Parameters
        ----------
        plan
            What is printed.
        output
            The folder.
        comm
            The ranks, of which the first one writes.
        quiet
            Whether nothing is printed.
        words
            Rewords each line.
        """
        super().__init__(comm, words=words)
        if quiet:
            self.on = self.live = False
        self.plan, self.output, self.comm, self._saved = plan, output, comm, 0

    def system(self, system: System, accuracy: float | None = None) -> None:
        """Say what is solved, and refuse a method that does not apply before anything is computed."""
        super().system(system, accuracy)
        if other := self.comm.bcast(_other_run(self.output) if self.comm.rank == 0 else ""):
            self.say(f"  replaces in {self.output}{os.sep} the {other} (run(output=...) keeps both)")
        if self.plan.method or self.plan.modes:
            from rodfem.app.assess_all import check_method

            check_method(system, self.plan)

    def complete(self, diagram: Diagram) -> None:
        """Save all that there is: an interrupted run keeps all completed branches."""
        self.save(diagram)

    def save(self, diagram: Diagram) -> None:
        """Save the branches that have not been saved by this process."""
        if self._saved == len(diagram):
            return
        new = diagram.branches[self._saved :]
        modes = typical_modes(new, diagram.solvers)
        with diagram.clock("files"), held():
            if not self._saved:
                on_first(self.comm, lambda: remove_earlier(self.output))
            save_run(diagram.data, new, diagram.solvers, self.output, first=not self._saved, modes=modes)
            self._saved = len(diagram)

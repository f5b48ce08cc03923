"""The terminal of a run, which keeps its files up to date."""

from __future__ import annotations

import json
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any
from uuid import uuid4

from mpi4py import MPI

from rodfem.app.earlier import DIAGRAM_FILE, Earlier
from rodfem.app.interrupts import held
from rodfem.app.terminal import Report
from rodfem.diagram.asked import check_asked
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.plan import Plan
from rodfem.diagram.record import Record
from rodfem.fem.system import System
from rodfem.modes.typical import typical_modes
from rodfem.output.checkpoint import Step, write_step
from rodfem.output.files import save_run
from rodfem.output.folder import remove_earlier
from rodfem.ranks import on_first


def branches_in_words(number: int) -> str:
    """Number of branches."""
    return f"{number} branch{'es' if number != 1 else ''}"


def _other_run(folder: Path) -> str:
    """Date and command of the run that a folder holds; empty if it holds none, or one of the same command."""
    try:
        origin = json.loads((folder / DIAGRAM_FILE).read_text())["origin"]
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
    run
        Name of the run.
    steps
        Steps of the run that are known from an interrupted process.
    goes_on
        Whether files in the folder are of this run.
    """

    def __init__(
        self,
        plan: Plan,
        output: Path,
        comm: MPI.Comm,
        quiet: bool,
        words: Callable[[str], str] = str,
        earlier: Earlier | None = None,
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
        earlier
            The run that goes on.
        """
        super().__init__(comm, words=words)
        if quiet:
            self.on = self.live = False
        self.plan, self.output, self.comm, self.earlier = plan, output, comm, earlier
        self.steps = [] if earlier is None else earlier.steps
        self.run, self.goes_on = uuid4().hex if earlier is None else earlier.run, earlier is not None
        self._count, self._saved = len(self.steps), 0
        self._known = sum("points" in step.text["found"] for step in self.steps)
        self._asked: dict[str, Any] = {}

    def asked(self, asked: dict[str, Any]) -> None:
        """Refuse to go on with the run of another scene."""
        self._asked = asked
        if self.earlier is not None:
            check_asked(self.earlier.asked, asked, self.output)

    def system(self, system: System, accuracy: float | None = None) -> None:
        """Say what is solved, and refuse a method that does not apply before anything is computed."""
        super().system(system, accuracy)
        if self.goes_on:
            self.say(f"  goes on in {self.output}{os.sep} after {branches_in_words(self._known)}")
        elif other := self.comm.bcast(_other_run(self.output) if self.comm.rank == 0 else ""):
            self.say(f"  replaces in {self.output}{os.sep} the {other} (run(output=...) keeps both)")
        if self.plan.method or self.plan.modes:
            from rodfem.app.assess_all import check_method

            check_method(system, self.plan)

    def keep(self, record: Record) -> None:
        """Keep a step, so that the run can go on after it."""
        with held():
            self._clear()
            self._count += 1
            step = Step(self.run, self._asked, record.text, record.vectors)
            on_first(self.comm, lambda: write_step(self.output, self._count, step))

    def complete(self, diagram: Diagram) -> None:
        """Save all that there is: an interrupted run keeps all completed branches."""
        if len(diagram) > self._known:  # until then the files have more
            self.save(diagram)

    def save(self, diagram: Diagram) -> None:
        """Save the branches that have not been saved by this process."""
        if self._saved == len(diagram):
            return
        new = diagram.branches[self._saved :]
        modes = typical_modes(new, diagram.solvers)
        with diagram.clock("files"), held():
            self._clear()
            save_run(diagram.data, new, diagram.solvers, self.output, first=not self._saved, modes=modes)
            self._saved = len(diagram)

    def _clear(self) -> None:
        """Remove what an earlier run left, once."""
        if not self.goes_on:
            on_first(self.comm, lambda: remove_earlier(self.output))
        self.goes_on = True

"""A run that was interrupted, as its folder tells of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from rodfem.errors import InputError
from rodfem.file_format import DIAGRAM, read_json
from rodfem.output.checkpoint import Step, read_steps
from rodfem.ranks import on_first

DIAGRAM_FILE = "diagram.json"
"""File that tells of a run whose steps are gone."""


@dataclass(frozen=True)
class Earlier:
    """A ``run`` of that name: what it was ``asked`` for, its ``steps``, and whether it is ``complete``."""

    run: str
    asked: dict[str, Any]
    steps: list[Step]
    complete: bool


def earlier_in(folder: Path, comm: MPI.Comm) -> Earlier | None:
    """Run whose files are in a folder, None where there are none; collective.

    Raises :class:`InputError` on every rank where they cannot be read, or do not tell what was asked for.
    """
    found: list[Earlier | None] = []
    on_first(comm, lambda: found.append(_earlier(folder)))
    return comm.bcast(found[0] if found else None)


def _earlier(folder: Path) -> Earlier | None:
    if steps := read_steps(folder):
        return Earlier(steps[0].run, steps[0].asked, steps, complete=False)
    if not (folder / DIAGRAM_FILE).exists():
        return None
    data = read_json(folder / DIAGRAM_FILE, DIAGRAM, ("run",))
    if "asked" not in data:
        raise InputError(
            f"{folder / DIAGRAM_FILE} does not tell what was asked for, so that it cannot be gone on with: "
            "run the scene anew."
        )
    return Earlier(data["run"], data["asked"], [], complete=data.get("complete", True))

"""The journal of a run in its folder: a file for each step, written whole, which go when the run has ended.

``resume-1.h5``, ``resume-2.h5``, ... hold what :mod:`rodfem.diagram.record` makes of a step, and what the run was asked
for.  The steps of a run are those whose files have its name, from the first one on without a gap.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem.errors import InputError
from rodfem.file_format import PROGRAM, STEP, UNREADABLE
from rodfem.whole_files import with_added, write_whole, writing

if TYPE_CHECKING:
    import h5py

PATTERN = "resume-*.h5"
"""Files of steps."""


@dataclass(frozen=True)
class Step:
    """A step of the ``run`` of that name: what that was ``asked`` for, and a record, its ``text`` and ``vectors``."""

    run: str
    asked: dict[str, Any]
    text: dict[str, Any]
    vectors: list[np.ndarray]


def path_of(folder: Path, number: int) -> Path:
    """File of a step, counted from 1."""
    return folder / f"resume-{number}.h5"


def write_step(folder: Path, number: int, step: Step) -> None:
    """Write the file of a step; raises :class:`InputError` where the folder cannot be written."""

    def add(file: h5py.File) -> None:
        file.attrs.update(STEP.mark_attributes(), run=step.run)
        file["asked"], file["text"] = json.dumps(step.asked), json.dumps(step.text)
        file["lengths"] = np.array([len(vector) for vector in step.vectors], dtype=int)
        file["vectors"] = np.concatenate([np.zeros(0), *step.vectors])

    path = path_of(folder, number)
    write_whole({path: with_added(path, add, first=True)})


def read_steps(folder: Path) -> list[Step]:
    """Steps of the unfinished run in a folder, none where there is none.

    Raises :class:`InputError` for a file that is none, is damaged, or was written by another version of rodfem.
    """
    steps: list[Step] = []
    while (path := path_of(folder, len(steps) + 1)).exists():
        step = _read(path)
        if steps and step.run != steps[0].run:
            break  # left by an earlier run
        steps.append(step)
    return steps


def remove_steps(folder: Path) -> None:
    """Remove the files of all steps, the last one first: what is left is a beginning of the run."""
    with writing(folder):
        for path in sorted(folder.glob(PATTERN), key=lambda path: (len(path.name), path.name), reverse=True):
            path.unlink()


def _read(path: Path) -> Step:
    import h5py

    try:
        with h5py.File(path, "r") as file:
            STEP.check_hdf5(file, ("asked", "text", "lengths", "vectors", "run"))
            if file.attrs["program"] != PROGRAM:
                raise InputError(f"{path} was written by {file.attrs['program']}, not {PROGRAM}: run the scene anew.")
            ends = np.cumsum(file["lengths"][:])
            asked, text = (json.loads(file[name].asstr()[()]) for name in ("asked", "text"))
            vectors = np.split(file["vectors"][:], ends[:-1])
            return Step(str(file.attrs["run"]), asked, text, vectors if len(ends) else [])
    except UNREADABLE as trouble:
        if isinstance(trouble, InputError):
            raise
        raise InputError(f"{path} is no {STEP.name} ({trouble}): remove it, or run the scene anew.") from trouble

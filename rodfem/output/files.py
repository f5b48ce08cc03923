"""Files of a run: a diagram as plain columnar data, ``diagram.json``, and its states, ``states.h5``.

``diagram.json`` holds for each branch its columns (one entry a row, a row being an equilibrium; ``meaning`` has each in
words) and its special points, each of which is a row too.  ``states.h5`` holds the same rows as shapes and fields in
natural order along the rod, whatever the number of ranks: to draw them, or to start again from one with
:func:`load_state`.
"""

from __future__ import annotations

import json
import platform
import shlex
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rodfem import compat
from rodfem.continuation.branch import Branch, not_followed
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.errors import InputError
from rodfem.fem.system import System
from rodfem.file_format import DIAGRAM, STATES, read_json, refusal
from rodfem.modes.finder import Motion, Motions
from rodfem.modes.modes import Typical, stacked, write_typical
from rodfem.output.table import COLUMNS, branch_data
from rodfem.problem.arguments import checked
from rodfem.problem.arguments import path as argument_path
from rodfem.problem.supports import write as write_supports
from rodfem.problem.supports import write_section
from rodfem.ranks import on_first
from rodfem.timing import Clock
from rodfem.whole_files import with_added, write_whole

if TYPE_CHECKING:
    import h5py
    from petsc4py import PETSc

NATURAL = ("load", "ordinate", "length", "force", "moment", "energy")  # numbers whose natural sizes stand in the file
PARTS = ("assembly", "solve", "stability", "location", "error bars", "modes", "setup")
"""Parts of a run whose times stand in the file."""
MEANING = {column.name: column.words for column in COLUMNS}
UNSTABLE = (
    "number of rates of decay whose real part is negative, of those found: 0 is stable",
    "number of eigenvalues omega^2 that are negative or complex, of those found: 0 is stable",
)
"""Meaning of ``negative`` where loads have no potential, by the order of the equations of motion in time."""


def as_data(
    branches: Sequence[Branch], systems: Sequence[System], clock: Clock,
    span: tuple[float, float], accuracy: float | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Diagram as nested dicts and lists of plain numbers and strings (nondimensional, or in the units of the scene)."""
    system = max(systems, key=lambda s: s.fields.unknowns)
    scene, points = system.scene, sum(len(b.points) for b in branches)
    load, ordinate, order = scene.parameters[scene.load], scene.ordinate, scene.inertia.order
    return {
        "format": DIAGRAM.mark(),
        "scene": scene.name,
        "title": scene.title or scene.name,
        "parameter": scene.load,
        "parameter_label": load.label or scene.load,
        "parameter_words": load.words,
        "parameter_unit": load.unit,
        "ordinate": ordinate.name,
        "ordinate_label": ordinate.label or ordinate.name,
        "ordinate_unit": ordinate.unit,
        "natural": {name: getattr(scene.units, name) for name in NATURAL},
        "constants": {name: p.value for name, p in scene.parameters.items() if name != scene.load},
        "range": list(span),
        "planar": scene.planar,
        "discretization": mesh_of(system),
        "accuracy": accuracy,
        "ignored_strains": list(map("v1 v2 v3".split().__getitem__, scene.ignored_strains)),
        "meaning": MEANING | ({} if scene.conservative else {"negative": UNSTABLE[order - 1]}),
        "branch_points_not_followed": not_followed(branches),
        "meshes": list(map(_mesh_data, systems)),
        "branches": list(map(partial(branch_data, rates=order == 1), branches)),
        "timing": {f"{name.replace(' ', '_')}_s": clock.seconds.get(name, 0.0) for name in PARTS}
        | {"total_s": clock.total(), "points": points, "ms_per_point": clock.each(points), "ranks": system.comm.size},
    }


def mesh_of(system: System) -> dict[str, Any]:
    """Discretisation, as files record it."""
    d, unknowns = system.fields.discretization, system.fields.unknowns
    return {"formulation": d.formulation, "elements": d.elements, "degree": d.degree, "unknowns": unknowns}


def _mesh_data(system: System) -> dict[str, Any]:
    _, *sizes = mesh_of(system).items()
    vertices = system.fields.discretization.vertices
    return dict(sizes) | {"vertices": None if vertices is None else list(vertices)}


def origin() -> dict[str, Any]:
    """Entry ``origin`` of ``diagram.json``: what reproduces the run."""
    date = datetime.now(UTC).isoformat(timespec="seconds")
    return {"command": shlex.join(sys.orig_argv), "date": date, "versions": versions()}


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that compute, each by its name in lower case."""
    from slepc4py import SLEPc  # after what compat loads first

    return {
        "python": platform.python_version(),
        "dolfinx": compat.dolfinx.__version__,
        "petsc": ".".join(map(str, compat.PETSc.Sys.getVersion())),
        "slepc": ".".join(map(str, SLEPc.Sys.getVersion())),
        "numpy": np.__version__,
    }


def as_json(data: dict[str, Any]) -> bytes:
    """Text of a JSON file, a line for each entry."""
    lines = (f" {json.dumps(name)}: {json.dumps(value)}" for name, value in data.items())
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()


def save_json(data: dict[str, Any], path: Path) -> None:
    """Write a JSON file, as :func:`~rodfem.whole_files.write_whole` does."""
    write_whole({path: as_json(data)})


@checked(path=argument_path("results/column/diagram.json"))
def load_json(path: Path | str) -> dict[str, Any]:
    """Read a diagram; raises :class:`InputError` where there is none, or one of a newer format."""
    return read_json(Path(path), DIAGRAM, ("scene", "parameter", "branches"))


def save_run(
    data: dict[str, Any], branches: Sequence[Branch], solvers: Sequence[BranchSolver], folder: Path,
    *, first: bool, modes: Sequence[Sequence[Typical]],
) -> None:  # fmt: skip
    """Add ``branches`` to ``states.h5`` of a folder, and replace ``diagram.json``; collective, written on rank 0.

    Both files are written before either takes its place, ``states.h5`` first, so that it has all branches of a
    ``diagram.json`` of the same run.
    """
    states = folder / "states.h5"
    image = states_of(branches, solvers, states, run=data["run"], first=first, modes=modes)
    on_first(solvers[0].system.comm, lambda: write_whole({folder / "diagram.json": as_json(data), states: image}))


def states_of(
    branches: Sequence[Branch], solvers: Sequence[BranchSolver], path: Path,
    *, first: bool, run: str = "", modes: Sequence[Sequence[Typical]] | None = None,
) -> bytes:  # fmt: skip
    """Contents of an HDF5 file with the states of ``branches`` added, on rank 0; collective."""
    sampled = [_sampled(branch, solvers) for branch in branches]
    system = solvers[0].system

    def add(file: h5py.File) -> None:
        about = {"scene": system.scene.name, "parameter": system.scene.load}
        file.attrs.update(about, formulation=system.fields.discretization.formulation)
        if first:
            file.attrs.update(STATES.mark_attributes(), first=branches[0].name, run=run)
            write_section(file, system.scene)
        for branch, (samples, vectors), typical in zip(branches, sampled, modes or [()] * len(branches), strict=True):
            group = file.create_group(f"branches/{branch.name}")
            for name in samples[0]:
                group[name] = stacked([np.asarray(s[name]) for s in samples])
            write_supports(group, system.scene, samples)
            write_typical(group, typical)
            for i, null in enumerate(vectors):
                for j, mode in enumerate(null):
                    target = group.create_group(f"special/{i}/null_vector_{j}")
                    target["r"], target["q"], target["rotation"] = mode.r, mode.q, mode.w

    return b"" if system.comm.rank else with_added(path, add, first=first)


def _sampled(branch: Branch, solvers: Sequence[BranchSolver]) -> tuple[list[dict[str, np.ndarray]], list[list[Motion]]]:
    """Samples of the states of a branch, and the null vectors of its special points as motions; collective."""
    samples = [solvers[p.mesh].shape.sample(p.x) | solvers[p.mesh].resultants.at(p.x) for p in branch.points]
    motions = {i: Motions(solvers[i].system) for i in sorted({s.point.mesh for s in branch.special})}
    return samples, [[motions[s.point.mesh].at(s.point.x, v) for v in s.null_vectors] for s in branch.special]


def _trimmed(row: Any) -> Any:
    """Array without the slices at the ends of its axes that hold nothing but nan."""
    for axis in range(np.ndim(row)):
        others = tuple(i for i in range(np.ndim(row)) if i != axis)
        row = np.compress(~np.isnan(row).all(axis=others), row, axis=axis)
    return row


def load_state(path: Path, branch: str, row: int, solver: BranchSolver) -> PETSc.Vec:
    """State vector of a saved row, to start from or to examine; the elements and the degree may differ."""
    system = solver.system
    sample = _sample(path, branch, row, system.fields.discretization.formulation)
    names = [b.name for b in system.fields.blocks] + [n for n in system.scalars if not n.startswith("drift")]
    if missing := [name for name in ("s", "elements", *names) if name not in sample]:
        raise InputError(
            f"{path} has no {', '.join(missing)}, needed for the scene {system.scene.name!r}: it was written for "
            "another scene, or by another version of rodfem; run the scene again."
        )
    with refusal(
        f"Row {row} of the branch {branch!r} in {path} is no state of the scene {system.scene.name!r} ({{}}): run the "
        "scene again."
    ):
        return solver.shape.restore(sample)


def _sample(path: Path, branch: str, row: int, formulation: str) -> dict[str, Any]:
    """Arrays of a row of a file, whose states have to be of a formulation."""
    import h5py

    unfit = f"{path} has no row {row} of a branch {branch!r}: see the names and lengths in diagram.json next to it."
    with STATES.opened(path, ("formulation", "branches"), unfit) as file:
        found, group = file.attrs["formulation"], file[f"branches/{branch}"]
        first = file.attrs.get("format_version", 1) == 1
        if found != formulation:
            raise InputError(f"{path} holds states of the {found} formulation: choose that, not {formulation}.")
        sample = {name: _trimmed(value[row]) for name, value in group.items() if isinstance(value, h5py.Dataset)}
        return dict(_of_first(name, value) for name, value in sample.items()) if first else sample


def _of_first(name: str, value: Any) -> tuple[str, Any]:
    """Entry of a state of version 1, which has ``p0`` for ``p1``, and twice the moments at the ends."""
    if name[0] == "p" and name[1:].isdigit():
        return f"p{int(name[1:]) + 1}", value
    return name, value / 2 if name[:2] in ("ma", "mb") and name[2:].isdigit() else value

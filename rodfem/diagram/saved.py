"""Saved diagrams read again, as diagrams that can be asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from rodfem.continuation.branch import Branch, Point, SpecialPoint, Unexplained
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.kinds import KINDS
from rodfem.continuation.observer import Remark
from rodfem.diagram.diagram import Diagram
from rodfem.diagram.plan import EQUATIONS, not_held, plan_without
from rodfem.diagram.solver import RANKS, SCENE, Solver
from rodfem.errors import InputError
from rodfem.fem.fields import Discretization
from rodfem.fem.fingerprint import fingerprint, same
from rodfem.fem.system import System
from rodfem.file_format import DIAGRAM, read_json, refusal
from rodfem.output.files import load_state
from rodfem.output.states import check_run
from rodfem.output.table import point_values, special_values
from rodfem.problem.arguments import checked, path
from rodfem.problem.scene import Scene
from rodfem.tolerances import NEGLIGIBLE, unit


@checked(folder=path("results/column"), scene=SCENE, comm=RANKS)
def load(folder: Path | str, scene: Scene, comm: MPI.Comm = MPI.COMM_WORLD) -> Diagram:
    """Read a diagram that :meth:`Diagram.save` or :func:`rodfem.run` has written; collective.

    States are those of the file, on the meshes that they were computed on.  Tangents and null vectors are computed
    anew.  A file holds numbers, not the functions that state a ``scene``.  Any number of ranks reads it.

    Raises :class:`~rodfem.errors.InputError` where the files are missing, are those of another scene or of a newer
    format, or lack something.
    """
    folder = Path(folder)
    path, states = folder / "diagram.json", folder / "states.h5"
    data = read_json(path, DIAGRAM, ("scene", "range", "meshes", "asked"))
    with refusal(f"{path} lacks something, or holds something else ({{}}): give {DIAGRAM.file}."):
        _check(data, scene, folder)
        check_run(data, states)
        solvers = [_solver(scene, data["discretization"]["formulation"], mesh, comm) for mesh in data["meshes"]]
        _check_equations(data, solvers[0].system, folder)
        branches = [_branch(entry, solvers, states) for entry in data["branches"]]
        asked = data["asked"]
        diagram = Diagram(scene, replace(plan_without(asked), span=tuple(data["range"])), branches, solvers)
        said = data["warnings"], data["notes"]
        remarks = ([Remark(e["sentence"], *e["loads"] or (), branch=e["branch"]) for e in entries] for entries in said)
        diagram.warnings, diagram.notes = remarks
        diagram.asked, diagram.lacks, diagram.complete = asked, not_held(asked), data["complete"]
    return diagram


def _check(data: dict[str, Any], scene: Scene, folder: Path) -> None:
    """Raise :class:`InputError` where a scene is not the one that was saved, as far as numbers tell."""
    name, load = data["scene"], data["parameter"]
    if (name, load) != (scene.name, scene.load):
        raise InputError(
            f"{folder} holds the scene {name!r} with the load {load}, not {scene.name!r} with {scene.load}: give the "
            "scene that was run."
        )
    for constant, value in data["constants"].items():
        known = scene.parameters.get(constant)
        if known is None or abs(known.value - value) > NEGLIGIBLE * abs(value):
            there = "has no such parameter" if known is None else f"has {known.value:.12g}"
            raise InputError(
                f"{folder} was computed with {constant} = {value:.12g}, and the scene {there}: give the scene that was "
                "run."
            )


def _check_equations(data: dict[str, Any], system: System, folder: Path) -> None:
    """Raise :class:`InputError` where the equations of a ``system`` are not those that the files of the run tell."""
    version = data["format"]["version"]
    if not same(data["asked"][EQUATIONS], fingerprint(system, tuple(data["range"]), version)):
        raise InputError(
            f"{folder} was run with other equations than those of the scene {system.scene.name!r} (at one and the "
            "same state their residual, ordinate, or stored, potential or kinetic energy differ): give the scene that "
            "was run."
        )


def _solver(scene: Scene, formulation: str, mesh: dict[str, Any], comm: MPI.Comm) -> BranchSolver:
    vertices = None if mesh["vertices"] is None else tuple(mesh["vertices"])
    discretization = Discretization(formulation, mesh["elements"], mesh["degree"], vertices)
    return Solver(scene, discretization, comm).equilibria


def _branch(entry: dict[str, Any], solvers: Sequence[BranchSolver], states: Path) -> Branch:
    columns, parent = entry["columns"], entry["parent"]
    points = [_point(columns, row, entry["name"], solvers, states) for row in range(len(columns["load"]))]
    for before, point, after in zip([*points[:1], *points[:-1]], points, [*points[1:], *points[-1:]], strict=True):
        solver = solvers[point.mesh]
        if solver.conservative and before.mesh == point.mesh == after.mesh and len(points) > 1:
            chord = after.x - before.x  # the tangent to second order of the step
            point.tangent = chord / solver.system.norm(chord)
    depth = len(entry["name"].split(".")) if parent else 0
    branch = Branch(entry["name"], (parent[0], parent[1]) if parent else None, depth, points, ended=entry["ended"])
    branch.special = [_special(s, points, solvers) for s in entry["special"]]
    branch.singular_start, branch.image = entry["singular_start"], entry["image"]
    branch.unexplained = [
        Unexplained(points[x["row"]], points[x["row"] + 1], x["before"], x["after"]) for x in entry["unexplained"]
    ]
    return branch


def _point(columns: dict[str, Any], row: int, branch: str, solvers: Sequence[BranchSolver], states: Path) -> Point:
    values = point_values(columns, row)
    solver = solvers[values["mesh"]]
    x, load = load_state(states, branch, row, solver), values["load"]
    if abs(solver.system.scalar(x) - load) > NEGLIGIBLE * unit(load, one=solver.units.load):
        raise InputError(
            f"{states} has another load in row {row} of the branch {branch!r} than diagram.json next to it: give the "
            "two files of one run."
        )
    return Point(x=x, tangent=None, solver=solver, **values)


def _special(entry: dict[str, Any], points: Sequence[Point], solvers: Sequence[BranchSolver]) -> SpecialPoint:
    """Special point of a row; its null vectors are those of the eigenvalues nearest zero there."""
    point = points[entry["row"]]
    solver = solvers[point.mesh]
    special = SpecialPoint(KINDS[entry["kind"]], point, **special_values(entry))
    bars = {name: np.array(bar, dtype=float) for name, bar in (entry.get("errors") or {}).items()}
    special.bounds = lambda: bars
    if solver.conservative and special.kind.singular and entry["multiplicity"]:
        special.null_vectors = solver.inertia.modes_near_zero(point.x, entry["multiplicity"])
    return special

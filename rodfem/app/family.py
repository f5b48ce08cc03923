"""A family of rods: one scene with every combination of some of its constants, and the critical loads of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

from rodfem.app.many import many
from rodfem.continuation.branch import Branch, SpecialPoint
from rodfem.diagram.diagram import MESH, PLAN, trace
from rodfem.diagram.plan import Plan
from rodfem.diagram.solver import RANKS, SCENE
from rodfem.errors import InputError
from rodfem.fem.fields import Discretization
from rodfem.libraries import optional
from rodfem.problem.arguments import checked, function, path, reals
from rodfem.problem.scene import Scene

NUMBERS = ("critical_load", "error", "ordinate", "index_before", "index_after")


@checked(
    scene=SCENE,
    folder=path("results/family"),
    plan=PLAN,
    discretization=MESH,
    comm=RANKS,
    progress=function("print", 2),
)
def family(
    scene: Scene,
    over: Mapping[str, Sequence[float]],
    folder: Path | str,
    plan: Plan | None = None,
    discretization: Discretization | None = None,
    *,
    comm: MPI.Comm = MPI.COMM_WORLD,
    progress: Callable[[int, int], None] = lambda done, all_of_them: None,
) -> Any:
    """Critical loads of a ``scene`` for every combination of values of constants, an ``xarray.Dataset``.

    ``over`` has the values by name, as in ``{"A": np.linspace(-2, 0, 41)}``: the dimensions of the dataset.  Of each
    rod the special points of its first branch, or of all that the ``plan`` asks for, are along the dimension ``point``,
    by their loads: ``kind``, ``critical_load``, its ``error``, ``ordinate``, ``index_before`` and ``index_after``, nan
    beyond their number.  ``first_loss`` is the load at which the first branch loses its stability, nan if it does not
    or begins unstable.  Where a rod fails, ``trouble`` is the sentence.

    ``folder``, ``comm`` and ``progress`` are as for :func:`rodfem.many`, which keeps each rod in a file: an interrupted
    family goes on, and ranks share it; another plan or ``discretization`` wants another folder.  Raises
    :class:`~rodfem.errors.InputError` for what is no constant of the scene, and
    :class:`~rodfem.errors.SetupError` without xarray.
    """
    xarray, plan = optional("xarray", "tables"), plan or Plan(depth=0)
    values = {name: np.array(reals(f"over[{name!r}]", column, (0.5, 1.0))) for name, column in over.items()}
    if not values or scene.load in values or not all(len(column) for column in values.values()):
        raise InputError(
            f"over is {over!r}: give values of constants other than the load, as in {{'A': (-1.5, -1.0)}}."
        )
    rods = [scene.varying(**dict(zip(values, map(float, each), strict=True))) for each in product(*values.values())]
    found = many(rods, lambda rod: _critical(rod, plan, discretization), folder, comm, progress)
    shape, most = tuple(map(len, values.values())), max((len(rod.get("points", ())) for rod in found), default=0)
    rows = [[*rod.get("points", ()), *[{}] * (most - len(rod.get("points", ())))] for rod in found]

    def column(name: str, missing: Any = nan) -> tuple[list[str], np.ndarray]:
        filled = [[missing if point.get(name) is None else point[name] for point in row] for row in rows]
        return [*values, "point"], np.array(filled).reshape(*shape, most)

    single = {name: [rod.get(name) for rod in found] for name in ("first_loss", "error")}
    losses = np.array([nan if load is None else load for load in single["first_loss"]])
    data = {name: column(name) for name in NUMBERS} | {"kind": column("kind", "")}
    data |= {"first_loss": ([*values], losses.reshape(shape))}
    data |= {"trouble": ([*values], np.array([text or "" for text in single["error"]]).reshape(shape))}
    return xarray.Dataset(data, values, {"scene": scene.name, "load": scene.load})


def _critical(rod: Scene, plan: Plan, discretization: Discretization | None) -> dict[str, Any]:
    """Special points of a rod, by their loads, and where its first branch loses its stability."""
    diagram = trace(rod, discretization or Discretization(), plan, comm=MPI.COMM_SELF)
    points = sorted(diagram.special(), key=lambda special: special.point.load)
    return {"points": [_entry(special) for special in points], "first_loss": _first_loss(diagram[0])}


def _entry(special: SpecialPoint) -> dict[str, Any]:
    bar = special.error_estimate
    return {
        "kind": str(special.kind),
        "critical_load": special.point.load,
        "error": bar if np.isfinite(bar) else None,
        "ordinate": special.point.ordinate,
        "index_before": special.negative_before,
        "index_after": special.negative_after,
    }


def _first_loss(branch: Branch) -> float | None:
    """Load of the first special point of a branch that begins stable beyond which it is not."""
    lost = (s for s in branch.special if s.negative_after > s.negative_before == 0)
    return None if branch.points[0].negative else next((s.point.load for s in lost), None)

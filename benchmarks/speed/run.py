"""What is measured, in pieces: each in processes of its own, kept in the store as it is finished."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from subprocess import SubprocessError
from typing import Any

from benchmarks.auto.output import AutoError
from benchmarks.auto.settings import ACCURACIES, at_accuracy
from benchmarks.common import measured
from benchmarks.references import deviation
from benchmarks.speed.first import first_minute, map_of_rods, processes
from benchmarks.store import Store
from benchmarks.targets import TARGETS

Grid = Mapping[int, Sequence[int]]
"""Numbers of elements by degree."""
PAPER = (150, 1)
"""Elements and degree of the discretisation of Kumar & Healey (2010): linear, by the midpoint rule."""

LIMIT = 200.0
"""Seconds after which a process that measures is stopped; what it has measured counts."""
PARTS = ("assembly", "solve", "stability")
"""What rodfem's clock tells apart in following a branch."""


@dataclass(frozen=True)
class Size:
    """How much is measured: elements by degree, runs, loads for scipy, elements for growth, couplings."""

    reduced: Grid = field(
        default_factory=lambda: {
            1: (20, 40, 80, 150, 300),
            2: (8, 16, 32, 64),
            4: (4, 6, 8, 12, 16),
            6: (2, 4, 6, 8, 12),
            8: (2, 3, 4, 6, 8),
        }
    )
    pointwise: Grid = field(default_factory=lambda: {1: (40, 150), 2: (16, 64), 4: (4, 8, 16), 6: (4, 8), 8: (2, 4, 6)})
    follower: Grid = field(default_factory=lambda: {1: (40, 150), 2: (8, 32), 4: (2, 4, 8), 6: (2, 4)})
    spectra: Grid = field(
        default_factory=lambda: {
            1: (20, 40, 80, 150, 300, 600),
            2: (8, 16, 32, 64, 128),
            4: (4, 8, 16, 32),
            6: (2, 4, 8, 16),
            8: (2, 4, 8),
        }
    )
    runs: int = 5
    loads: int = 16
    growth: Mapping[str, Sequence[int]] = field(
        default_factory=lambda: {"reduced": (100, 1000, 10_000, 100_000), "pointwise": (100, 1000, 10_000, 45_000)}
    )
    couplings: int = 12


QUICK = Size(
    reduced={1: (150,), 6: (4, 8)},
    pointwise={1: (150,), 6: (4,)},
    follower={1: (150,), 6: (2,)},
    spectra={1: (150,), 6: (4, 8)},
    runs=1,
    loads=4,
    growth={"reduced": (100, 1000, 3000), "pointwise": (100, 1000, 3000)},
    couplings=2,
)


def everything(store: Store, size: Size) -> None:
    """Measure all pieces that the store does not have."""
    store.measure("references", deviation)
    for problem in ("cord", "hemitropic", "hemitropic-half", "ruler", "flutter"):
        store.measure(f"auto/{problem}", partial(auto, problem, size.runs))
    for scene in TARGETS:
        grids = (
            {"pointwise": size.follower}
            if scene == "follower"
            else {
                "reduced": size.reduced,
                "pointwise": size.pointwise,
            }
        )
        for formulation, grid in grids.items():
            for degree, elements in grid.items():
                _rows(store, "branches", "branches", (scene, formulation, degree, size.runs, *elements))
    for scene in ("cord", "hemitropic", "ruler", "follower"):
        store.measure(f"stages/{scene}", partial(_run, "stages", (scene, size.runs)))
    for name, formulations in (
        ("cord", ("reduced", "pointwise")),
        ("cord with mass", ("pointwise",)),
        ("hemitropic", ("reduced", "pointwise")),
        ("follower", ("pointwise",)),
    ):
        for formulation in formulations:
            for degree, elements in size.spectra.items():
                _rows(store, "eigenvalues", "eigenvalues", (name, formulation, degree, size.runs, *elements))
    for scene, branch in (
        ("cord", "branch 1"),
        ("cord", "branch 2"),
        ("hemitropic", "branch 1"),
        ("hemitropic", "branch 2"),
        ("ruler", "branch 1"),
    ):
        for accuracy in ACCURACIES:
            store.measure(
                f"bvp/{scene}/{branch}/{accuracy:g}", partial(bvp, store, scene, branch, accuracy, size.loads)
            )
    for state in ("straight", "buckled"):
        for formulation, sizes in size.growth.items():
            for n in sizes:
                key = f"growth/{state}/{formulation}/{n}"
                store.measure(key, partial(_run, "growth", (state, formulation, n)))
    store.measure("first", partial(_if_it_runs, partial(first_minute, size.runs)))
    store.measure("processes", partial(processes, size.runs))
    for ranks in range(1, (os.cpu_count() or 1) + 1):
        store.measure(f"map/{ranks}", partial(_if_it_runs, partial(map_of_rods, size.couplings, ranks)))


def _rows(store: Store, prefix: str, module: str, arguments: tuple[object, ...]) -> None:
    name, formulation, degree = arguments[:3]
    store.measure(f"{prefix}/{name}/{formulation}/{degree}", partial(_run, module, arguments))


def _run(module: str, arguments: tuple[object, ...]) -> list[dict[str, Any]]:
    return list(measured(f"benchmarks.speed.{module}", *arguments, limit=LIMIT))


def _if_it_runs(work: Callable[[], dict[str, Any]]) -> list[dict[str, Any]]:
    try:
        return [work()]
    except SubprocessError as trouble:
        return [{"failed": str(trouble)}]


def auto(problem: str, runs: int) -> list[dict[str, Any]]:
    """AUTO's branches at all errors, or the sentence that says why there are none."""
    try:
        return [
            traced.data() | {"asked": accuracy}
            for accuracy in ACCURACIES
            for traced in at_accuracy(problem, accuracy, runs=runs)
        ]
    except AutoError as trouble:
        return [{"failed": str(trouble)}]


def bvp(store: Store, scene: str, branch: str, tolerance: float, number: int) -> list[dict[str, Any]]:
    """One row: scipy's median time over about ``number`` loads of rodfem's points, and its error."""
    (target,) = (t for t in TARGETS[scene][branch] if t.at is not None)
    traced = [r for r in store.rows(f"branches/{scene}") if r["branch"] == branch]
    if not traced:
        return [{"failed": "rodfem has no points on this branch whose loads could be taken"}]
    loads = max(traced, key=lambda r: (r["degree"], r["elements"]))["loads"]
    turn = loads.index(min(loads)) if branch == "branch 2" else 0  # past a fold the load determines the state
    after = loads[turn + 1 :]
    chosen = sorted({*after[:: max(1, len(after) // number)], target.at})
    found = list(measured("benchmarks.speed.scipy_bvp", scene, branch, tolerance, *chosen))
    solved = [row for row in found if "seconds" in row]
    (at,) = [row for row in solved if row["load"] == target.at] or [None]
    if at is None:
        return [
            {"failed": next((row.get("stopped") or row["failed"] for row in found if "seconds" not in row), "nothing")}
        ]
    return [
        {
            "scene": scene,
            "branch": branch,
            "tolerance": tolerance,
            "seconds": median(row["seconds"] for row in solved),
            "points": len(solved),
            "tried": len(chosen),
            "nodes": at["nodes"],
            "error": abs(at["ordinate"] / target.reference - 1),
        }
    ]

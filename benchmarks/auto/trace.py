"""Tracing branches with AUTO: from the trivial branch through its branch points and along what leaves there.

The time is processor time without compilation and without the start of the process, the median of several runs::

    from benchmarks.auto.problems import PROBLEMS
    from benchmarks.auto.trace import trace
    for branch in trace(PROBLEMS["cord"], (20, 4, 1e-9)):
        print(branch.name, branch.points, branch.seconds, branch.values, branch.errors)
"""

from __future__ import annotations

import math
import shutil
import statistics
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.auto.output import AutoError, Row, rows, state
from benchmarks.auto.problems import Branch, Problem
from benchmarks.auto.program import constants, folder, processor_time, program, start_time
from benchmarks.targets import Target

Mesh = tuple[int, int, float]
"""NTST, NCOL, and the tolerance EPSL = EPSU."""


@dataclass
class Traced:
    """A branch as AUTO traced it.

    ``seconds`` is the processor time of all, ``following`` that of as many points without the search for special
    points, both medians of ``runs``; ``special`` has kind and load of everything labelled, ``values`` and ``errors``
    (relative) are those of the targets, nan where AUTO did not find one.
    """

    scene: str
    name: str
    ntst: int
    ncol: int
    tol: float
    dsmax: float
    points: int
    seconds: float
    following: float
    runs: int
    special: list[tuple[str, float]]
    values: dict[str, float]
    errors: dict[str, float]
    complete: bool
    loads: list[float] = field(repr=False)

    @property
    def error(self) -> float:
        """The largest relative error of the targets; infinite where one was not found."""
        return max((math.inf if math.isnan(e) else e for e in self.errors.values()), default=math.nan)

    @property
    def ms_per_point(self) -> float:
        """Processor time per accepted point, in milliseconds."""
        return 1e3 * self.seconds / self.points

    def data(self) -> dict[str, Any]:
        """All of it for JSON, which knows neither nan nor infinity."""
        return finite(asdict(self) | {"error": self.error, "ms_per_point": self.ms_per_point})


def finite(data: Any) -> Any:
    """The same with None for nan and infinity."""
    if isinstance(data, dict):
        return {key: finite(item) for key, item in data.items()}
    if isinstance(data, list | tuple):
        return [finite(item) for item in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def trace(
    problem: Problem, mesh: Mesh, dsmax: float | None = None, runs: int = 5, only: str | None = None
) -> list[Traced]:
    """All branches of the problem, or only one; `dsmax` is the largest step on what leaves the trivial branch.

    With `only`, the trivial branch is traced once, for what leaves it to start from.  Raises :class:`AutoError`.
    """
    executable = program(problem.name)
    work = folder() / f"{problem.name}-run"
    work.mkdir(exist_ok=True)
    for name in ("fort.3", "fort.7", "fort.8"):
        (work / name).unlink(missing_ok=True)
    labels: list[int] = []
    result = []
    for branch in problem.branches:
        wanted = only in (None, branch.name)
        if branch.start is not None and not wanted:
            continue
        label = 0
        if branch.start is not None:
            if branch.start >= len(labels):
                break  # the mesh is too coarse to see the branch point
            label = labels[branch.start]
            shutil.copy(work / "trunk.8", work / "fort.3")
        step = branch.dsmax if dsmax is None or (branch.start is None and len(problem.branches) > 1) else dsmax
        (work / "fort.2").write_text(constants(problem, branch, label, mesh, step))
        times = [processor_time(executable, work) for _ in range(runs if wanted else 1)]
        points = rows(work / "fort.7", problem.icp) if (work / "fort.7").exists() else []
        if not points:
            raise AutoError(
                f"AUTO found no point of {problem.name}, {branch.name}: {(work / 'log').read_text()[-300:]}"
            )
        if branch.start is None:
            labels = [row.label for row in points if row.kind == "BP"]
            shutil.copy(work / "fort.8", work / "trunk.8")
        if not wanted:
            continue
        traced = read(problem, branch, mesh, step, points, work)
        traced.runs, traced.seconds = runs, max(statistics.median(times) - start_time(executable), 0.0)
        (work / "fort.2").write_text(constants(problem, branch, label, mesh, step, following=len(points)))
        times = [processor_time(executable, work) for _ in range(runs)]
        made = len(rows(work / "fort.7", problem.icp))
        alone = max(statistics.median(times) - start_time(executable), 0.0)
        traced.following = alone * len(points) / max(made, 1)
        result.append(traced)
    return result


def read(problem: Problem, branch: Branch, mesh: Mesh, step: float, points: list[Row], work: Path) -> Traced:
    """What AUTO found, without times."""
    load = problem.icp[0]
    values = {target.name: value(problem, target, points, work) for target in branch.targets}
    return Traced(
        *(problem.name, branch.name, *mesh, step, len(points), math.nan, math.nan, 0),
        special=[(row.kind, row.par[load]) for row in points if row.label],
        values=values,
        errors={t.name: abs(values[t.name] / t.reference - 1) for t in branch.targets},
        complete=points[-1].kind == ("BP" if branch.until else "UZ"),
        loads=[row.par[load] for row in points],
    )


def value(problem: Problem, target: Target, points: list[Row], work: Path) -> float:
    """What AUTO found for a target; nan if nothing."""
    load = problem.icp[0]
    if target.at is None:
        found = [row for row in points if row.kind == target.kind]
        return found[target.number].par[load] if target.number < len(found) else math.nan
    found = [row for row in points if row.kind == "UZ" and abs(row.par[load] - target.at) < 1e-5 * abs(target.at)]
    if target.number >= len(found):
        return math.nan
    row = found[target.number]
    if callable(problem.ordinate):
        return problem.ordinate(state(work / "fort.8", row.label))
    return row.par[problem.ordinate]

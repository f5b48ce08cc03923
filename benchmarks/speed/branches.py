"""Branches traced by rodfem: time and error of one scene, formulation and degree, for several numbers of elements.

    python -m benchmarks.speed.branches cord reduced 6 5 4 8 12      # degree 6, five runs, 4, 8 and 12 elements

prints a line of JSON for each number of elements and branch.  A run that is not counted comes first.
"""

from __future__ import annotations

import json
import sys
from math import isnan
from statistics import median
from time import process_time
from typing import Any

import rodfem.clock
from benchmarks.speed.run import PARTS
from benchmarks.speed.scenes import loads, scene, value
from benchmarks.targets import TARGETS
from rodfem.branch import Branch
from rodfem.clock import Clock
from rodfem.continuation import Equilibria, Follower
from rodfem.errors import ConvergenceError
from rodfem.explore import Explorer
from rodfem.fields import Discretization
from rodfem.plan import Plan
from rodfem.report import Report
from rodfem.sweep import Sweep
from rodfem.system import System

rodfem.clock.perf_counter = process_time
"""The clock measures processor time here, so that other work on the machine does not count."""


class Timed(Explorer):
    """An explorer that keeps the processor time of each branch, and the clock's parts of it."""

    def __init__(self, *arguments: Any) -> None:
        """Explore as ever."""
        super().__init__(*arguments)
        self.cost: dict[str, dict[str, float]] = {}

    def trace(self, branch: Branch) -> None:
        """Trace a branch and note what it took."""
        clock = self.follower.system.clock
        before, started = dict(clock.seconds), process_time()
        super().trace(branch)
        self.cost[branch.name] = cost(clock, before, started)


def cost(clock: Clock, before: dict[str, float], started: float) -> dict[str, float]:
    """Processor time since ``started``, that of following alone, and the parts of this."""
    seconds = process_time() - started
    parts = {name: clock.seconds.get(name, 0.0) - before.get(name, 0.0) for name in (*PARTS, "location")}
    return {"seconds": seconds, "following": seconds - parts.pop("location"), **parts}


def explored(solver: Equilibria, name: str) -> tuple[list[Branch], dict[str, dict[str, float]], float]:
    """All branches of depth 1, what each cost, and the processor time of the whole."""
    system, quiet = solver.system, Report(quiet=True)
    plan = Plan(system.scene.span, at=loads(name), depth=1, error_bars=False)
    started = process_time()
    if isinstance(solver, Follower):
        explorer = Timed(solver, plan, quiet, lambda: None)
        branches = explorer.run()
        return branches, explorer.cost, process_time() - started
    before = dict(system.clock.seconds)
    branches = Sweep(solver, plan, quiet, lambda: None).run()
    return branches, {branches[0].name: cost(system.clock, before, started)}, process_time() - started


def measure(name: str, formulation: str, elements: int, degree: int, runs: int) -> list[dict[str, Any]]:
    """Medians of time, and errors, of each branch with targets."""
    started = process_time()
    system = System(scene(name), Discretization(formulation, elements, degree), clock=Clock())
    solver = Follower(system) if system.scene.conservative else Equilibria(system)
    setup = process_time() - started
    explored(solver, name)  # fills caches
    made = [explored(solver, name) for _ in range(runs)]
    out = []
    for branch in made[0][0]:
        targets = TARGETS[name].get(branch.name)
        if targets is None:
            continue
        values = {t.name: value(t, branch) for t in targets}
        costs = [c[branch.name] for _, c, _ in made]
        out.append(
            {
                "scene": name,
                "branch": branch.name,
                "formulation": formulation,
                "elements": elements,
                "degree": degree,
                "unknowns": system.fields.unknowns,
                "runs": runs,
                "points": len(branch.points),
                "loads": [round(p.load, 6) for p in branch.points],
                "setup": setup,
                "run": median(r for _, _, r in made),
                **{part: median(c[part] for c in costs) for part in costs[0]},
                "values": {k: None if isnan(v) else v for k, v in values.items()},
                "errors": {t.name: abs(values[t.name] / t.reference - 1) for t in targets if not isnan(values[t.name])},
            }
        )
    return out


def main() -> None:
    """Print what is measured."""
    name, formulation, degree, runs, *elements = sys.argv[1:]
    for n in elements:
        try:
            for found in measure(name, formulation, int(n), int(degree), int(runs)):
                print(json.dumps(found), flush=True)
        except ConvergenceError as trouble:
            print(f"{name}, {n} elements of degree {degree}: {trouble}", file=sys.stderr)


if __name__ == "__main__":
    main()

"""Branches traced by rodfem: time and error of one scene, formulation and degree, for several numbers of elements.

    python -m benchmarks.speed.branches cord reduced 6 5 4 8 12      # degree 6, five runs, 4, 8 and 12 elements

prints a line of JSON for each number of elements and branch.  A run that is not counted comes first.
"""

from __future__ import annotations

import json
import sys
from math import isnan
from statistics import median
from time import perf_counter, process_time
from typing import Any

from benchmarks.speed.run import PARTS
from benchmarks.speed.scenes import loads, scene, value
from benchmarks.targets import TARGETS
from rodfem.continuation.branch import Branch
from rodfem.continuation.observer import Observer
from rodfem.diagram.diagram import Diagram, trace
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import Discretization


class Timed(Observer):
    """Notes the processor time of the setting up, of each branch with the clock's parts of it, and of all branches.

    The clock itself measures wall time: a call of the system for each of its parts would cost as much as some of them.
    """

    def __init__(self) -> None:
        """The setting up begins."""
        self.started = process_time()
        self.setup = self.run = 0.0
        self.cost: dict[str, dict[str, float]] = {}

    def system(self, system: Any, accuracy: float | None = None) -> None:
        """Note what the setting up took."""
        self.clock, now = system.clock, process_time()
        self.setup, self.started = now - self.started, now

    def branch(self, branch: Branch) -> None:
        """A branch begins."""
        self.before, self.begun, self.wall = dict(self.clock.seconds), process_time(), perf_counter()

    def complete(self, diagram: Diagram) -> None:
        """Note the processor time of the last branch, that of following it alone, and the parts of this."""
        now, clock = process_time(), self.clock
        self.run, seconds = now - self.started, now - self.begun
        share, before = seconds / (perf_counter() - self.wall), self.before
        parts = {x: share * (clock.seconds.get(x, 0.0) - before.get(x, 0.0)) for x in (*PARTS, "location")}
        self.cost[diagram[-1].name] = {"seconds": seconds, "following": seconds - parts.pop("location"), **parts}


def traced(name: str, mesh: Discretization) -> tuple[Diagram, Timed]:
    """All branches of depth 1, and what they cost."""
    timed = Timed()
    return trace(scene(name), mesh, Plan(at=loads(name), depth=1, error_bars=False), timed), timed


def measure(name: str, formulation: str, elements: int, degree: int, runs: int) -> list[dict[str, Any]]:
    """Medians of time, and errors, of each branch with targets."""
    mesh = Discretization(formulation, elements, degree)
    first, uncounted = traced(name, mesh)  # fills caches
    made = [timed for _, timed in (traced(name, mesh) for _ in range(runs))]
    out = []
    for branch in first:
        targets = TARGETS[name].get(branch.name)
        if targets is None:
            continue
        values = {t.name: value(t, branch) for t in targets}
        costs = [timed.cost[branch.name] for timed in made]
        out.append(
            {
                "scene": name,
                "branch": branch.name,
                "formulation": formulation,
                "elements": elements,
                "degree": degree,
                "unknowns": first.solvers[0].system.fields.unknowns,
                "runs": runs,
                "points": len(branch.points),
                "loads": [round(p.load, 6) for p in branch.points],
                "setup": uncounted.setup,
                "run": median(timed.run for timed in made),
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

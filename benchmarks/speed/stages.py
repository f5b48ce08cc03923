"""What the diagram of a demo costs by stage: set-up, following, special points, error bars.

    python -m benchmarks.speed.stages cord 5

prints a line of JSON, medians of processor time in seconds.  A run that is not counted comes first.
"""

from __future__ import annotations

import json
import sys
from statistics import median
from time import process_time

from benchmarks.speed.branches import Timed
from benchmarks.speed.scenes import scene
from rodfem.diagram.diagram import trace
from rodfem.diagram.plan import Plan
from rodfem.problem.scene import Scene


def stages(rod: Scene) -> dict[str, float]:
    """Seconds of each stage of one diagram on its default mesh, and of a second one with other constants."""
    started = process_time()
    timed = Timed()
    diagram = trace(rod, plan=Plan(error_bars=False), observer=timed)
    plain = process_time() - started
    name, value = next((n, p.value) for n, p in rod.parameters.items() if n != rod.load and p.value)
    started = process_time()
    diagram.again(error_bars=False, **{name: 1.01 * value})
    second = process_time() - started
    started = process_time()
    trace(rod)
    whole = process_time() - started
    following = sum(cost["following"] for cost in timed.cost.values())
    found = {"set-up": timed.setup, "following": following, "special points": plain - timed.setup - following}
    return found | {"error bars": whole - plain, "all": whole, "second rod": second}


def main() -> None:
    """Print what is measured."""
    name, runs = sys.argv[1], int(sys.argv[2])
    rod = scene(name)
    stages(rod)
    found = [stages(rod) for _ in range(runs)]
    print(json.dumps({"scene": name, **{stage: median(one[stage] for one in found) for stage in found[0]}}))


if __name__ == "__main__":
    main()

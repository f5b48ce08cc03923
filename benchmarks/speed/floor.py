"""Least time of a branch: its compiled kernels alone, each timed by itself, times how often a branch needs it.

    python -m benchmarks.speed.floor cord reduced 6 8 "branch 1"      # degree 6, 8 elements

A row needs an iteration of Newton's method with new factors and two with old ones, the second variation with its
factors, three solutions for tangent and index, six for the reduced stiffness, and one more assembly for its rate.  A
special point needs three linearisations: factors, five assemblies, and three solutions refined once.
"""

from __future__ import annotations

import sys
from time import process_time
from typing import Any

import numpy as np

from benchmarks.speed.branches import traced
from rodfem.fem.fields import Discretization
from rodfem.fem.newton import OnPlane


def least(call: Any, times: int = 300) -> float:
    """Least processor time of one call of some, in milliseconds."""
    found = []
    for _ in range(times):
        begun = process_time()
        call()
        found.append(process_time() - begun)
    return 1e3 * min(found)


def kernels(diagram: Any, name: str) -> dict[str, float]:
    """Milliseconds of each kernel at the middle row of a branch."""
    branch = next(b for b in diagram if b.name == name)
    point = branch.points[len(branch.points) // 2]
    solver = diagram.solvers[point.mesh]
    inertia, system = solver.inertia, solver.system
    found = inertia.at(point.x)
    found.eigenvalue_count(0.0)
    right = np.ones((system.fields.unknowns, 6))
    out = {"factors": least(lambda: inertia.factors(inertia.matrix))}
    out |= {f"{k} solutions": least(lambda k=k: inertia.factors.solve_all(right[:, :k])) for k in (1, 3, 6)}
    out["assembly"] = least(lambda: inertia.compiled.assemble(point.x))
    step = OnPlane(system, point.x.copy(), solver.row(point.tangent))
    return out | {"new iteration": least(lambda: step(True)), "old iteration": least(lambda: step(False))}


def main() -> None:
    """Print the kernels, and the least time of the branch beside what it takes."""
    scene, formulation, degree, elements, name = sys.argv[1:]
    mesh = Discretization(formulation, int(elements), int(degree))
    traced(scene, mesh)
    diagram, timed = traced(scene, mesh)
    t, branch = kernels(diagram, name), next(b for b in diagram if b.name == name)
    row = t["new iteration"] + 2 * t["old iteration"] + 2 * t["assembly"] + t["factors"]
    row += t["3 solutions"] + t["6 solutions"]
    special = 3 * (t["factors"] + 5 * t["assembly"] + 2 * t["3 solutions"])
    singular = sum(s.kind.singular for s in branch.special)
    floor = len(branch.points) * row + singular * special
    print(", ".join(f"{kernel} {ms:.3f}" for kernel, ms in t.items()))
    took = 1e3 * timed.cost[name]["seconds"]
    rows = f"{len(branch.points)} rows of {row:.2f} ms, {singular} special points of {special:.2f}"
    print(f"{rows}: {floor:.1f} ms, of {took:.1f} that the branch takes")


if __name__ == "__main__":
    main()

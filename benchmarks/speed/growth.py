"""Cost against the number of unknowns: the cord with elements of degree 2, straight or buckled.

    python -m benchmarks.speed.growth buckled reduced 1000 10000

prints a line of JSON for each number of elements: seconds of processor time (medians of three, after one that is not
counted) of an equilibrium at a load a little off and of a count, and memory.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable
from statistics import median
from time import process_time
from typing import Any

from petsc4py import PETSc

from benchmarks.speed.scenes import scene
from rodfem.diagram.solver import Solver
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import Discretization

import small_states  # isort: skip

LOAD, DEGREE, RUNS = 40.0, 2, 3
NUDGE = 1e-3
"""Change of the load, relative, of which an equilibrium is computed: two or three corrections, as along a branch."""


def memory() -> float:
    """Most memory that this process has had so far, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def first(solver: Any, state: str) -> PETSc.Vec:
    """State at the load, refined from a coarse mesh where it is buckled."""
    solver.system.set_phase(None)
    guess = solver.start(LOAD)
    if state == "buckled":
        coarse = "cord", solver.system.fields.discretization.formulation, 16, 6
        _, x = small_states.buckled(*coarse, LOAD)
        guess = solver.shape.restore(small_states.solver(*coarse).shape.sample(x))
    x, outcome = solver.at_load(guess, LOAD)
    if not outcome.converged:
        raise ConvergenceError(f"no {state} state")
    return x


def timed(name: str, work: Callable[[], Any]) -> dict[str, float]:
    """Median processor time."""
    work()
    times = []
    for _ in range(RUNS):
        started = process_time()
        work()
        times.append(process_time() - started)
    return {name: median(times)}


def measure(state: str, formulation: str, elements: int) -> dict[str, Any]:
    """Times in seconds and memory in MB."""
    before, started = memory(), process_time()
    solver: Any = Solver(scene("cord"), Discretization(formulation, elements, DEGREE)).equilibria
    setup = process_time() - started
    x = first(solver, state)
    corrections: list[int] = []

    def equilibrium() -> None:
        _, outcome = solver.at_load(x, LOAD * (1 + NUDGE))
        if not outcome.converged:
            raise ConvergenceError(f"no equilibrium beside the {state} state of {elements} elements")
        corrections.append(outcome.iterations)

    index: list[int] = []
    return {
        "state": state,
        "formulation": formulation,
        "elements": elements,
        "degree": DEGREE,
        "unknowns": solver.system.fields.unknowns,
        "setup": setup,
        **timed("equilibrium", equilibrium),
        **timed("count", lambda: index.append(solver.inertia.at(x).count().negative)),
        "corrections": corrections[-1],
        "index": index[-1],
        "ordinate": solver.shape.ordinate(x),
        "memory": memory() - before,
    }


def main() -> None:
    """Print what is measured."""
    state, formulation, *elements = sys.argv[1:]
    for n in elements:
        print(json.dumps(measure(state, formulation, int(n))), flush=True)


if __name__ == "__main__":
    main()

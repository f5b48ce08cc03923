"""Cost against the number of unknowns, on one rank or several: the cord with elements of degree 2, straight or buckled.

    python -m benchmarks.speed.growth buckled reduced 1000 10000
    mpirun -n 2 python -m benchmarks.speed.growth straight pointwise 100000
    mpirun -n 2 python -m benchmarks.speed.growth --each straight pointwise 50000    (each rank a rod of its own)

prints a line of JSON for each number of elements: seconds of processor and of wall time (medians of three, after one
that is not counted) of an equilibrium at a load a little off and of a count, and memory over all ranks.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Callable
from statistics import median
from time import perf_counter, process_time
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc

from benchmarks.speed.scenes import scene
from rodfem.diagram.solver import Solver
from rodfem.errors import ConvergenceError
from rodfem.fem.fields import Discretization

import small_states  # isort: skip

LOAD, DEGREE, RUNS = 40.0, 2, 3
NUDGE = 1e-3
"""Change of the load, relative, of which an equilibrium is computed: two or three corrections, as along a branch."""
COMM = MPI.COMM_WORLD


def memory() -> float:
    """Most memory that all ranks together have had so far, in MB."""
    return float(COMM.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)) / 1024


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
    """Median processor time of one rank, the busiest, and wall time until all are done."""
    work()
    times, walls = [], []
    for _ in range(RUNS):
        COMM.barrier()
        started, wall = process_time(), perf_counter()
        work()
        times.append(COMM.allreduce(process_time() - started, op=MPI.MAX))
        walls.append(COMM.allreduce(perf_counter() - wall, op=MPI.MAX))
    return {name: median(times), f"{name} wall": median(walls)}


def measure(state: str, formulation: str, elements: int, comm: MPI.Comm) -> dict[str, Any]:
    """Times in seconds and memory in MB."""
    before, started, wall = memory(), process_time(), perf_counter()
    solver: Any = Solver(scene("cord"), Discretization(formulation, elements, DEGREE), comm).equilibria
    setup = {"setup": process_time() - started, "setup wall": perf_counter() - wall}
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
        "ranks": COMM.size,
        **setup,
        **timed("equilibrium", equilibrium),
        **timed("count", lambda: index.append(solver.inertia.at(x).count().negative)),
        "corrections": corrections[-1],
        "index": index[-1],
        "ordinate": solver.shape.ordinate(x),
        "memory": memory() - before,
    }


def main() -> None:
    """Print what is measured."""
    each = "--each" in sys.argv
    state, formulation, *elements = (word for word in sys.argv[1:] if word != "--each")
    for n in elements:
        found = measure(state, formulation, int(n), MPI.COMM_SELF if each else COMM)
        if COMM.rank == 0:
            print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()

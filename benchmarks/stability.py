"""Time and memory of every way to judge one state, against the number of elements: writes ``docs/stability.md``.

Run by ``make bench``.  All that is measured is kept in results/stability/measured.json as it comes: --resume goes on
where a run was interrupted.  Each number is the median of repeated judgements of the same state in a process of its
own, after one that is not counted (it makes symbolic factorisations and fills caches), as it is along a branch.
"""

from __future__ import annotations

import argparse
import itertools
import json
import resource
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import scipy
import scipy.sparse.linalg as spl
from petsc4py import PETSc

import rodfem.fem.system
from benchmarks.common import ROOT, exponent, machine, measured, milliseconds, table, versions
from benchmarks.store import Store
from rodfem.continuation.branch_solver import RegularPoints
from rodfem.diagram.solver import Solver
from rodfem.fem.fields import Discretization
from rodfem.kumar_healey.coordinates import Coordinates
from rodfem.linalg.matrices import gathered
from rodfem.stability.assessment import Assessor
from rodfem.stability.dependence import smallest_singular
from rodfem.stability.inertia import Inertia, quotient_error
from rodfem.stability.near_zero import decide

sys.path.append(str(ROOT / "tests"))

import demo_cases
import small_states

LOAD, BUCKLED, NUMBER = 20.0, 40.0, 4
ELEMENTS = (100, 1000, 10_000, 100_000)
METHODS = (
    "factorisation",
    "index",
    "count",
    "eigenvalues",
    "shift-invert",
    "slicing",
    "reduction",
    "cayley",
    "scipy",
    "dense",
    "dense QZ",
)
MOST = {"dense": 300, "dense QZ": 100, "scipy": 10_000, "slicing": 10_000}
POINTWISE = MOST | {"reduction": 10_000, "cayley": 10_000}
LIMIT = 150.0
"""Seconds after which a process that measures is stopped."""
ENOUGH = 3.0
"""Seconds after which no judgement is repeated."""


def state(formulation: str, elements: int, degree: int, which: str = "straight") -> tuple[Any, PETSc.Vec]:
    """The discretised cord, and its straight state or the buckled one.

    Neither has a symmetry; the search for one, longer than what is measured, is left out.
    """
    rodfem.fem.system.find_symmetries = lambda equations: []
    solver = Solver(demo_cases.scene("cord"), Discretization(formulation, elements, degree)).equilibria
    solver.system.set_phase(None)
    load = LOAD if which == "straight" else BUCKLED
    guess = solver.start(load)
    if which == "buckled":
        _, x = small_states.buckled("cord", formulation, 16, 6, load)
        guess = solver.shape.restore(small_states.solver("cord", formulation, 16, 6).shape.sample(x))
    x, outcome = solver.at_load(guess, load)
    assert outcome.converged
    return solver.system, x


def task(method: str, system: Any, x: PETSc.Vec) -> Callable[[], Any]:
    """What is measured."""
    assessor = Assessor(system)
    assert assessor.inertia is not None
    if method == "factorisation":
        found = assessor.inertia.at(x)
        return lambda: found.eigenvalue_count(found.shift + 1e-3)
    if method == "index":
        regular = RegularPoints(assessor.inertia)
        return lambda: regular.at(x)
    if method == "assembly":
        return lambda: assessor.inertia.at(x)
    if method == "solves":
        found = assessor.inertia.at(x)
        found.eigenvalue_count(0.0)
        right = np.zeros((x.local_size, 2))
        return lambda: found.factors.solve_all(right)
    if method in ("eigenvalues", "proof", "scipy", "dense QZ"):
        return of_pencil(method, assessor, x)
    return lambda: assessor(x, method, 0 if method == "count" else NUMBER).values


def of_pencil(method: str, assessor: Assessor, x: PETSc.Vec) -> Callable[[], Any]:
    """What is measured of the pencil of a state alone."""
    assessor.system.set_phase(x)
    if method == "eigenvalues":
        return lambda: assessor.symmetric.at(x).leftmost(NUMBER).values
    spectrum = assessor.low_pencil(x)
    if method == "proof":
        cuts = itertools.count()
        return lambda: spectrum.eigenvalue_count(spectrum.shift + 1e-3 * next(cuts))
    S, M = gathered(spectrum.matrix).tocsc(), gathered(spectrum.mass).tocsc()
    if method == "dense QZ":
        return lambda: scipy.linalg.eigvals(S.toarray(), M.toarray())
    start = np.ones(S.shape[0])

    def eigs() -> Any:
        spectrum.at(x)  # as all other methods do
        return np.sort(spl.eigs(S, NUMBER, M, sigma=spectrum.shift, v0=start, tol=1e-9)[0].real)

    return eigs


def measure(method: str, formulation: str, elements: int, degree: int, which: str = "straight") -> dict[str, Any]:
    """Median time of one judgement in seconds, memory in MB that the first takes, and the left-most eigenvalue."""
    system, x = state(formulation, elements, degree, which)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    run = task(method, system, x)
    values = run()
    if method == "index":
        own, share = index(system, x)
        return {"seconds": own, "share": share, "memory": 0.0, "first": None}
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    found = np.atleast_1d(values)
    first = float(found[0]) if method not in ("count", "factorisation", "dense QZ", "proof") else None
    return {"seconds": seconds(run), "memory": memory, "first": first, "unknowns": system.fields.unknowns}


def index(system: Any, x: PETSc.Vec) -> tuple[float, float]:
    """Seconds of an index along a branch, and that over one factorisation.

    It is what remains without what Newton's method needs anyway: the assembly, and solves for step and tangent.  All
    are measured in turn, so that what disturbs one disturbs the others.
    """
    parts = {name: task(name, system, x) for name in ("index", "assembly", "solves", "factorisation")}
    times: dict[str, list[float]] = {name: [] for name in parts}
    started = perf_counter()
    while len(times["index"]) < 5 or (len(times["index"]) < 99 and perf_counter() - started < ENOUGH):
        for name, run in parts.items():
            before = perf_counter()
            run()
            times[name].append(perf_counter() - before)
    median = {name: float(np.median(found[1:])) for name, found in times.items()}
    own = median["index"] - median["assembly"] - median["solves"]
    return own, own / median["factorisation"]


def seconds(run: Callable[[], Any]) -> float:
    """Median time of what is called at least three times."""
    times: list[float] = []
    while len(times) < 3 or (len(times) < 15 and sum(times) < 0.5):
        started = perf_counter()
        run()
        times.append(perf_counter() - started)
        if sum(times) > ENOUGH:
            break
    return float(np.median(times))


def in_a_process(store: Store, *arguments: object) -> dict[str, Any] | None:
    """Measure in a new process, unless the store has it; None where it fails or takes too long."""

    def work() -> list[dict[str, Any]]:
        return list(measured("benchmarks.stability", "--measure", *arguments, limit=LIMIT)) or [{"failed": "nothing"}]

    found: dict[str, Any] = store.measure("/".join(map(str, arguments)), work)[0]
    return None if "failed" in found else found


@dataclass
class Times:
    """Tables of time and memory for linear elements, the left-most eigenvalues found, and what the goals are about."""

    table: str
    memory: str
    first: str
    shares: np.ndarray
    exponents: dict[str, float]


def times(formulation: str, store: Store) -> Times:
    """Measure all methods with linear elements."""
    head = ["method", *(f"n = {n:g}" for n in ELEMENTS), "exponent"]
    rows, memory, first = [], [], []
    seconds_of: dict[str, list[float]] = {}
    exponents: dict[str, float] = {}
    shares = np.zeros(0)
    for method in METHODS:
        found: list[dict[str, Any] | None] = []
        for n in ELEMENTS:
            skip = n > (POINTWISE if formulation == "pointwise" else MOST).get(method, n) or (
                len(found) > 0 and found[-1] is None
            )
            found.append(None if skip else in_a_process(store, method, formulation, n, 1))
        if found[2] and found[2]["first"] is not None:
            first.append(f"{method} {found[2]['first']:.9f}")
        seconds_of[method] = [f["seconds"] if f else np.nan for f in found]
        good = [(n, f) for n, f in zip(ELEMENTS, found, strict=True) if f]
        slope = exponent([n for n, _ in good], [f["seconds"] for _, f in good], 1000)
        exponents[method] = float(slope)
        rows.append(
            [
                method,
                *(milliseconds(f["seconds"]) if f else "" for f in found),
                "" if np.isnan(slope) else f"{slope:.2f}",
            ]
        )
        if method == "index":
            shares = np.array([f["share"] if f else np.nan for f in found])
            rows.append(["index over factorisation", *("" if np.isnan(r) else f"{r:.2f}" for r in shares), ""])
        else:
            memory.append([method, *(f"{f['memory']:.0f}" if f else "" for f in found)])
    return Times(table(head, rows), table(head[:-1], memory), ", ".join(first), shares, exponents)


def goals(found: Sequence[Times], ratios: Sequence[float]) -> str:
    """Table of the goals, and what was measured."""
    shares = np.stack([t.shares for t in found])
    few, many = np.nanmax(shares[:, 0]), np.nanmax(shares[:, 1:])
    own = {f"{m} {e:.2f}": e for t in found for m, e in t.exponents.items() if "scipy" not in m and "dense" not in m}
    worst = max((k for k in own if not np.isnan(own[k])), key=own.__getitem__, default="none")
    rows = [
        ["an index along a branch over one factorisation, from n = 1000 on", "at most 1.2", f"{many:.2f}"],
        ["the same for n = 100, where calls cost more than arithmetic", "at most 1.2", f"{few:.2f}"],
        ["exponent of time over n", "at most 1.1", worst],
        [
            f"{NUMBER} left-most eigenvalues at n = {ELEMENTS[2]} over scipy's, reduced and pointwise, straight",
            "at most 1",
            f"{ratios[0]:.2f}, {ratios[2]:.2f}",
        ],
        ["the same, buckled", "at most 1", f"{ratios[1]:.2f}, {ratios[3]:.2f}"],
    ]
    return table(["goal", "", "measured"], rows)


def rich(store: Store) -> str:
    """Table of few elements of high degree."""
    rows = []
    for elements, degree in ((8, 6), (32, 6), (128, 6)):
        found = [in_a_process(store, m, "reduced", elements, degree) for m in METHODS[:8]]
        rows.append([f"{elements} of degree {degree}", *(milliseconds(f["seconds"]) if f else "" for f in found)])
    return table(["elements", *METHODS[:8]], rows)


def beside_scipy(store: Store) -> tuple[str, list[float]]:
    """Table of four left-most eigenvalues of straight and buckled states beside scipy's ``eigs``; ratios."""
    rows, ratios = [], []
    for formulation in ("reduced", "pointwise"):
        for which in ("straight", "buckled"):
            found = [
                in_a_process(store, method, formulation, ELEMENTS[2], 1, which)
                for method in ("eigenvalues", "proof", "scipy")
            ]
            mine, proof, scipys = (f["seconds"] if f else np.nan for f in found)
            ratios.append(mine / scipys)
            rows.append(
                [
                    f"{formulation}, {which}",
                    *map(milliseconds, (mine, proof, scipys)),
                    f"{mine / scipys:.2f}",
                    f"{(mine - proof) / scipys:.2f}",
                ]
            )
    return table(["state", "eigenvalues", "of which proof", "scipy", "ratio", "without proof"], rows), ratios


def bands() -> str:
    """Table of the band of the count, and of what a quotient resolves."""
    rows = []
    for elements, degree in (
        (100, 1),
        (1000, 1),
        (10_000, 1),
        (30_000, 1),
        (100, 3),
        (1000, 3),
        (8, 6),
        (32, 6),
        (128, 6),
    ):
        row = [str(elements), str(degree)]
        for formulation in ("reduced", "pointwise"):
            system, x = state(formulation, elements, degree)
            inertia = Inertia(system)
            found = inertia.at(x)
            decide(found)
            _, vectors = found.nearest(1)
            row += [f"{inertia.resolution:.1e}", f"{quotient_error(found.matrix, vectors[0]):.1e}"]
        rows.append(row)
    return table(["elements", "degree", "band, reduced", "quotient", "band, pointwise", "quotient"], rows)


def ranks() -> str:
    """Table of sigma_min(C)/h."""
    rows = []
    for elements in (25, 50, 100, 200, 400, 1000, 10_000):
        row = [str(elements)]
        for name, coordinates in (("cord", "tangent"), ("hemitropic", "tangent"), ("hemitropic", "compatible")):
            solver = Solver(small_states.scene(name), Discretization("pointwise", elements, 1)).equilibria
            pencil = Coordinates(solver.system, coordinates).assemble(solver.start(20.0 if name == "cord" else 0.1))
            h = solver.system.scene.length / elements
            sigma, _ = smallest_singular(pencil.C)
            row += [f"{sigma:.4e}", f"{sigma / h:.5f}"]
        rows.append(row)
    return table(["n", "cord", "/h", "hemitropic", "/h", "hemitropic, compatible", "/h"], rows)


def write(path: Path, store: Store) -> None:
    """Measure everything and write the page."""
    reduced, pointwise = times("reduced", store), times("pointwise", store)
    few, (scipys, ratios) = rich(store), beside_scipy(store)
    counts = resolution(bands(), ranks())
    path.write_text(
        introduction(store, goals([reduced, pointwise], ratios))
        + linear_elements(reduced, pointwise)
        + comparison(scipys, reduced, pointwise, few)
        + counts
    )
    print(f"{path}, measured in {store.took() / 60:.1f} minutes")


def introduction(store: Store, reached: str) -> str:
    """What was measured on which machine, and the goals that it ``reached``."""
    low, high = store.loads()
    return f"""# Every way to answer "is it stable?", and what it costs

Written by `make bench` (`python -m benchmarks.stability`) in {store.took() / 60:.0f} minutes on
{machine()}; {versions("petsc4py", "slepc4py", "numpy", "scipy")}; one thread;
load of the machine between {low:.1f} and {high:.1f}.

The state is the straight telephone cord at lam = {LOAD:g}; {NUMBER} left-most eigenvalues are asked for. A time is the
median of repeated judgements after a first one, which makes the symbolic factorisation (as along a branch), and
contains the assembly. `factorisation` is one numeric LDL^t of the saddle matrix with its inertia, without assembly;
`index` is what the index costs along a branch: the one factorisation that gives the tangent,
too, and two columns more in its solves, to know how far from zero the nearest eigenvalue is; its ratio to a
factorisation is that of medians taken in turn in one process.
`count` is the index of a state by itself, from two factorisations; `eigenvalues` are the left-most ones alone, all
methods below it have the index too. `scipy` is `eigs` with shift-invert (SuperLU) on the same matrices and shift,
`dense QZ` LAPACK's on the singular pencil, which has infinite eigenvalues besides. All but these two prove by counts
that no eigenvalue is missing. No number: not tried, or stopped after {LIMIT:g} s.

## Goals

{reached}
"""


def linear_elements(reduced: Times, pointwise: Times) -> str:
    """Times on linear elements, for both formulations."""
    return f"""## Milliseconds, linear elements

Reduced formulation (an integral constraint):

{reduced.table}
Left-most eigenvalue for n = {ELEMENTS[2]}: {reduced.first}.

Pointwise formulation:

{pointwise.table}
Left-most eigenvalue for n = {ELEMENTS[2]}: {pointwise.first}.

The exponent is that of time over n from n = 1000 on.

"""


def comparison(scipys: str, reduced: Times, pointwise: Times, few: str) -> str:
    """Times beside those of scipy, memory, and times for few elements of high degree."""
    return f"""## Beside scipy

Milliseconds for {NUMBER} left-most eigenvalues at n = {ELEMENTS[2]}, of the straight cord at lam = {LOAD:g} and of
the one buckled into its first branch at lam = {BUCKLED:g}. Some of rodfem's time is the proof that none is missing, one
factorisation more, which scipy does not have.

{scipys}
## Memory in MB that the first judgement takes

Reduced:

{reduced.memory}
Pointwise:

{pointwise.memory}
## Milliseconds, few elements of high degree (reduced)

{few}
"""


def resolution(band: str, rank: str) -> str:
    """What the count resolves, and the rank of the constraints."""
    return f"""## What the count resolves

The band is the half width of the interval about zero in which inertia alone decides nothing, relative to the system's
metric: 10 eps |S| over the smallest mass. Inside it the Rayleigh quotient of the pair nearest zero decides, which
round-off blurs by no more than the number in the next column (`rodfem/stability/near_zero.py`). The band grows like n
as long as the largest entries of S are those of the constraints, then like n^2; the other number like n^1.5. Few
elements of high degree reach more digits with a narrower band.

{band}
## The rank of the constraints

The smallest singular value of the gradients C of the pointwise constraints, and over the size h of an element, for
linear elements. It vanishes like h, as in Table 5 of Kumar & Healey (2010), whose continuous multipliers make it a
third of this times the stretch ([why](theory/counting.md#full-rank)); here the rod is undeformed.

{rank}"""


def main() -> None:
    """Write the page, or measure one method in this process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--measure", nargs="+", metavar="METHOD FORMULATION ELEMENTS DEGREE [STATE]")
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "stability.md")
    parser.add_argument("--resume", action="store_true", help="keep what an interrupted run has measured")
    given = parser.parse_args()
    if given.measure:
        method, formulation, elements, degree, *which = given.measure
        print(json.dumps(measure(method, formulation, int(elements), int(degree), *which)))
    else:
        write(given.output, Store(ROOT / "results" / "stability" / "measured.json", given.resume))


if __name__ == "__main__":
    main()

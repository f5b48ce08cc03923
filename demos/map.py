# %% [markdown]
# # A stability map
#
# ## Idea
#
# How does a compressed hemitropic rod behave for *every* coupling of stretch and twist? One diagram is the answer for
# one coupling $A$ (`demos/hemitropic.py`). A map has a diagram for each of many, read at a grid of compressions
# $\lambda$: the colour is the displacement of the middle of the stable state, and lines are where the straight rod's
# index changes.
#
# Rods are independent, so that ranks share them: `mpirun -n 2 python demos/map.py`. What is finished is kept:
# started again, it goes on.

# %% [markdown]
# ## Program
#
# `scene` states one rod, which `varying` gives another coupling: equations are derived once for all of them. `read`
# traces one and takes from its diagram what the map shows.

# %%
from math import hypot, inf
from pathlib import Path

import numpy as np
from mpi4py import MPI

import rodfem
import rodfem.app.cli as cli
from rodfem import Discretization, Ordinate, Parameter, Plan, Scene, clamped
from rodfem.app.terminal import Report
from rodfem.forms.energy import hemitropic
from rodfem.whole_files import draft_of


def scene(highest: float) -> Scene:
    """The rod of demos/hemitropic.py without coupling."""
    return Scene(
        name="stability map",
        interval=(-3.0, 3.0),
        rod="unshearable",
        energy=lambda v, k, c: hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=1.0, bending=1.0),
        parameters={"lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0)), "A": Parameter(0.0)},
        load="lam",
        ends=(clamped(lambda c: (0.0, 0.0, -3 * (1 - c.lam))), clamped(lambda c: (0.0, 0.0, 3 * (1 - c.lam)))),
        ordinate=Ordinate("mid-point displacement", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
        span=(0.0, highest),
    )


def read(rod: Scene, loads: np.ndarray) -> dict:
    """Where the straight rod's index changes, and least displacement of a stable state (None: no such) at each load."""
    plan = Plan(rod.span, at=tuple(loads), depth=1, error_bars=False)
    diagram = rodfem.trace(rod, Discretization("reduced", 8, 6), plan, comm=MPI.COMM_SELF)
    stable = np.full(len(loads), np.nan)
    for point in (s.point for s in diagram.special("user") if s.point.stable):
        i = int(np.argmin(abs(loads - point.load)))
        stable[i] = np.fmin(stable[i], point.ordinate)
    changes = diagram.special("branch point", "straight")
    return {
        "changes": [[s.negative_before, s.negative_after, s.point.load] for s in changes],
        "stable": [None if np.isnan(x) else x for x in stable],
    }


# %% [markdown]
# ## Picture


# %%
def draw(couplings: np.ndarray, loads: np.ndarray, results: list[dict], path: Path) -> None:
    """Draw the map: colour for the displacement of the stable state, lines where the straight rod's index changes."""
    from matplotlib.figure import Figure

    stable = np.array([[np.nan if x is None else x for x in r["stable"]] for r in results]).T
    figure = Figure(figsize=(8.0, 5.0), dpi=200, layout="constrained")
    axes = figure.subplots()
    shading = "gouraud" if np.isfinite(stable).all() else "nearest"
    picture = axes.pcolormesh(couplings, loads, stable, shading=shading, cmap="viridis")
    for pair in sorted({(a, b) for r in results for a, b, _ in r["changes"]}):
        places = [[load for a, b, load in r["changes"] if (a, b) == pair] for r in results]
        line = np.array([found[0] if found else np.nan for found in places])
        axes.plot(couplings, line, color="white", linewidth=1.5)
        middle = int(np.nanargmin(abs(couplings)))
        label = f"{pair[0]} | {pair[1]}"
        axes.annotate(label, (couplings[middle], line[middle]), (0, -12), textcoords="offset points", color="white")
    figure.colorbar(picture, label="mid-point displacement of the stable state")
    axes.set(
        xlabel="coupling $A$",
        ylabel=r"end shortening $\lambda$",
        title="Compressed hemitropic rod; lines: where the straight rod's index changes",
    )
    with draft_of(path) as draft:
        figure.savefig(draft)


# %% [markdown]
# ## Many rods
#
# `rodfem.many` does the work for each rod once, in files, whichever rank has it.


# %%
def main(parser: cli.Parser, couplings: np.ndarray, loads: np.ndarray, output: Path) -> None:
    """Compute what is missing in the folder ``output``, and draw it; ``parser`` words what is refused."""
    report = Report()
    with cli.sentences(parser):
        rod = scene(0.6)
        rods = [rod.varying(A=float(A)) for A in couplings]
        results = rodfem.many(
            rods,
            lambda rod: read(rod, loads),
            output,
            progress=lambda done, count: report.say(f"  {done} of {count} rods"),
        )
    failed = [r["error"] for r in results if "error" in r]
    for sentence in failed:
        report.warn(sentence)
    if MPI.COMM_WORLD.rank == 0 and not failed:
        draw(couplings, loads, results, output / "map.png")
    report.say(f"Results in {output}: rod-00000.json ..., map.png")


MOST = 10_000
"""Couplings, or loads, of a map."""

if __name__ == "__main__":
    parser = cli.Parser(prog="map.py", description="Draw how a compressed hemitropic rod behaves for every coupling.")
    parser.add_argument("--couplings", type=int, default=40, metavar="N", help="number of couplings A (default 40)")
    parser.add_argument("--loads", type=int, default=40, metavar="N", help="number of compressions (default 40)")
    words = "(default results/map)"
    parser.add_argument("--output", type=cli.folder, default=Path("results/map"), metavar="DIR", help=words)
    options = parser.parse_args()
    if not 2 <= min(options.couplings, options.loads) <= max(options.couplings, options.loads) <= MOST:
        cli.complain(f"A map needs two couplings and two loads at least, and at most {MOST} of each.")
    couplings, loads = np.linspace(-3.1, 3.1, options.couplings), np.linspace(0.01, 0.6, options.loads)
    main(parser, couplings, loads, options.output)

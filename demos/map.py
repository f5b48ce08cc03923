# %% [markdown]
# # A stability map
#
# ## Idea
#
# Where does the straight hemitropic rod of `demos/hemitropic.py` lose its stability, for *every* coupling of stretch
# and twist? One diagram is the answer for one coupling $A$. A family has that of many: lines are the compressions
# $\lambda$ at which the index changes. Each rod is continued from those next to it.
#
# Rods are independent, so that ranks share them: `mpirun -n 2 python demos/map.py`. What is finished is kept:
# started again, it goes on.

# %%
from math import hypot, inf
from pathlib import Path

import numpy as np
from mpi4py import MPI

import rodfem
import rodfem.app.cli as cli
from rodfem import Ordinate, Parameter, Plan, Scene, clamped
from rodfem.app.terminal import Report
from rodfem.forms.energy import hemitropic
from rodfem.whole_files import draft_of

# %%
rod = Scene(
    name="stability map",
    interval=(-3.0, 3.0),
    rod="unshearable",
    energy=lambda v, k, c: hemitropic(v, k, stretching=10.0, coupling=c.A, twisting=1.0, bending=1.0),
    parameters={"lam": Parameter(0.0, r"\lambda", admissible=(-inf, 1.0)), "A": Parameter(0.0)},
    load="lam",
    ends=(clamped(lambda c: (0.0, 0.0, -3 * (1 - c.lam))), clamped(lambda c: (0.0, 0.0, 3 * (1 - c.lam)))),
    ordinate=Ordinate("mid-point displacement", s=0.0, of=lambda r, q: hypot(r[0], r[1])),
    span=(0.0, 0.95),
)


# %%
def main(couplings: np.ndarray, output: Path) -> None:
    """Compute what is missing in the folder ``output``, and draw the map."""
    report, plan = Report(), Plan(depth=0, error_bars=False)
    found = rodfem.family(
        rod,
        {"A": couplings.tolist()},
        output,
        plan,
        progress=lambda done, count: report.say(f"  {done} of {count} rods"),
    )
    for sentence in filter(None, found.trouble.values.tolist()):
        report.warn(sentence)
    if MPI.COMM_WORLD.rank == 0:
        lines = found.critical_load.plot.line(x="A", color="black", add_legend=False)
        lines[0].axes.set(ylabel=r"end shortening $\lambda$", title="Where the straight rod's index changes")
        with draft_of(output / "map.png") as draft:
            lines[0].figure.savefig(draft, dpi=200)
    report.say(f"Results in {output}: rod-00000.json ..., map.png")


MOST = 10_000
"""Couplings of a map."""

if __name__ == "__main__":
    parser = cli.Parser(prog="map.py", description="Draw where a compressed hemitropic rod buckles for every coupling.")
    parser.add_argument("--couplings", type=int, default=200, metavar="N", help="number of couplings A (default 200)")
    words = "(default results/map)"
    parser.add_argument("--output", type=cli.folder, default=Path("results/map"), metavar="DIR", help=words)
    options = parser.parse_args()
    if not 2 <= options.couplings <= MOST:
        cli.complain(f"A map needs two couplings at least, and at most {MOST}.")
    with cli.sentences(parser):
        main(np.linspace(-3.1, 3.1, options.couplings), options.output)

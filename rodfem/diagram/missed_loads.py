"""Pairs of critical loads that a mesh may miss: where frequencies are nearest a richer mesh tells whether they meet.

Two frequencies that come near one another and part again, or one that comes near zero, may meet, or pass through it, on
a mesh whose error is less.  No row of the sweep shows it, nor a special point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from petsc4py import PETSc

from rodfem.continuation.branch import Branch
from rodfem.diagram.hidden_events import Lowest
from rodfem.errors import ConvergenceError
from rodfem.stability.cluster import Cluster, Measured

KNOWN = 0.5
"""Part of a value that remains on a richer mesh: less, and its sign is in doubt."""


def missed_loads(
    branch: Branch, near: list[Lowest], richer: Callable[[PETSc.Vec, float, Cluster], Measured], name: str
) -> Iterator[str]:
    """Yield a sentence on each load of a sweep's ``branch`` at which critical loads may be missing.

    ``near`` are those at which something comes near zero.  On a ``richer`` mesh a cluster is measured near a state, at
    a load, which has a ``name``.
    """
    for lowest in near:
        row = min(branch.points, key=lambda p: abs(p.load - lowest.load))
        single, mine = lowest.cluster.size == 1, lowest.value - lowest.below
        try:
            again = lowest.measured(richer(row.x, lowest.load, lowest.cluster)) - lowest.below
            found = f"{mine:.2g} on this mesh, and {again:.2g} on a richer one"
            if again > KNOWN * mine:
                continue
        except ConvergenceError:
            found = f"{mine:.2g} on this mesh, and not found on a richer one"
        what = "an eigenvalue is nearest to zero" if single else "two frequencies are nearest to one another"
        measure = "its distance" if single else "the square of half the difference of their omega^2"
        yield (
            f"Near {name} = {lowest.load:.8g} {what}: {measure} is {found}. A pair of critical loads may be missing "
            "there, use more elements."
        )

"""Gaps: branch points that an imperfection has taken apart, and how continuation resolves them.

Near such a point two branches, that would cross without the imperfection, bend away from each other.  The state and the
load at which they would cross are known from :mod:`rodfem.continuation.singular`.  Steps in proportion to the distance
from there follow the bend of either branch, however sharp it is.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.singular import SingularState, SingularSystem
from rodfem.fem.newton import correct
from rodfem.linalg.orthogonal import orthonormalize

if TYPE_CHECKING:
    from rodfem.adaptivity.mesh_sequence import Meshes

SHARE = 0.25
"""Largest step near a gap, relative to the distance from where the branches would cross."""
LEAST = 1e-6
"""Least bound of a step."""
ARM = 0.05
"""Distance, in the metric, at which the four arms that would meet are looked for."""


class Gap(Exception):
    """A step of continuation has jumped from one branch to another, across the gap at this special point."""

    def __init__(self, special: SpecialPoint, unfolded: SingularState) -> None:
        """Keep what was found."""
        super().__init__(f"imperfect, unfolding {unfolded.size:.0e}")
        self.special, self.unfolded = special, unfolded
        self.point = replace(special.point, x=unfolded.x, load=unfolded.load)


class Gaps:
    """The gaps of one run: which special points are taken apart, and the steps that resolve them."""

    def __init__(self, meshes: Meshes) -> None:
        """Begin with none."""
        self.meshes = meshes
        self.known: list[Gap] = []

    def examine(self, solver: BranchSolver, special: SpecialPoint, found: SingularState) -> Gap | None:
        """The gap at a singular state whose unfolding parameters are not round-off; None where the mesh makes them.

        A mesh need not have a symmetry of the scene: on a richer one its own unfolding is smaller.
        """
        richer = self.meshes.richer(special.point.mesh)
        x = richer.transfer(found.x, state=True)
        modes = [richer.transfer(v, state=False) for v in special.null_vectors]
        orthonormalize(modes, richer.system.metric)
        again = SingularSystem(richer.solver, modes, np.eye(len(modes)), fold=False).solve(x)
        if again is not None and again.size < 0.5 * found.size + again.noise:  # lowered by half: the mesh's own
            return None
        return Gap(special, found)

    def open(self, gap: Gap, solver: BranchSolver) -> bool:
        """Add a gap; False where it is known already, so that smaller steps have not resolved it."""
        for known in self.known:
            if solver.system.distance(gap.point.x, self.meshes.here(known.point, solver).x) < LEAST:
                return False
        self.known.append(gap)
        return True

    def reach(self, solver: BranchSolver, point: Point) -> float:
        """Largest step from a point: in proportion to the distance from the nearest gap."""
        apart = (solver.system.distance(point.x, self.meshes.here(gap.point, solver).x) for gap in self.known)
        return max(SHARE * min(apart, default=inf), LEAST)


def arms(solver: BranchSolver, gap: Gap) -> list[Point]:
    """Equilibria on the branches that would cross at a gap, a little away from it: up to four."""
    system, out = solver.system, []
    for direction in gap.unfolded.directions:
        row = solver.row(direction)
        for sign in (1.0, -1.0):
            x = gap.unfolded.x + direction * (sign * ARM)
            outcome = correct(system, x, row, reach=ARM)
            if outcome.converged:
                out.append(solver.point(x, 0.0, solver.tangent(row, at=x), outcome))
    return out

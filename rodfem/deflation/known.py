"""Equilibria of traced branches at a load: at rows there and between rows, each once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.deflation.discrete_symmetries import mirrors
from rodfem.deflation.group_orbit import Orbits
from rodfem.errors import ConvergenceError
from rodfem.tolerances import APART


class Coexisting(NamedTuple):
    """An equilibrium with its symmetric copies: so many mirror images, itself among them.

    Continuous symmetries that it breaks, ``freedoms`` of them, make a circle (a torus, a line) of each.
    """

    point: Point
    images: int
    freedoms: int


def with_copies(solver: BranchSolver, point: Point) -> Coexisting:
    """An equilibrium with the number of its copies."""
    system, known, phase = solver.system, Orbits(solver.system), solver.system.phase
    known.add(point.x)
    images = [mirror(system, point.x) for mirror in mirrors(system, point.x)]
    system.phase, count = phase, 1
    for x in images:
        if all(apart >= APART for apart, _ in known.nearest(x)):
            known.add(x)
            count += 1
    return Coexisting(point, count, system.active_drifts(point.x))


def equilibria_at(
    solver: BranchSolver, branches: Sequence[Branch], load: float, here: Callable[[Point], Point] = lambda p: p
) -> list[Point]:
    """Equilibria of traced branches at exactly ``load``, which a search for further ones deflates.

    A row at that load is one; none counts twice, as where branches begin and end at one state, or what the symmetries
    carry into each other.  Raises :class:`ConvergenceError` where there is none between two points on either side of
    the load.  ``here`` brings points of ``branches`` to the mesh of ``solver``, where they are on others.
    """
    found, known = list[Point](), Orbits(solver.system)
    for branch in branches:
        for point in _along(solver, [here(p) for p in branch.points], load, singular_states(branch)):
            if all(apart >= APART for apart, _ in known.nearest(point.x)):
                point.branch = branch.name
                found.append(point)
                known.add(point.x)
    return found


def singular_states(branch: Branch) -> set[int]:
    """Ids of the states of a branch that are those of folds and branch points."""
    first = {id(branch.points[0].x)} if branch.parent else set()
    return first | {id(s.point.x) for s in branch.special if s.kind.singular}


def _along(solver: BranchSolver, points: Sequence[Point], load: float, singular: set[int]) -> Iterator[Point]:
    """Yield the equilibria at ``load`` at and between neighbouring ``points`` of a branch, which are on its mesh.

    At those whose states are ``singular``, by their ids, Newton's method at the load itself has nothing to go by: they
    are what was located.
    """
    for a, b in zip(points, [*points[1:], None], strict=True):
        if a.load == load and id(a.x) in singular:
            yield solver.point(a.x, a.arclength, a.tangent)
        elif a.load == load:
            x, outcome = solver.at_load(a.x, load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(
                    f"No equilibrium was found at {solver.system.scene.load} = {load:g} beside a row there: use more "
                    "elements, or another load."
                )
            yield solver.point(x, a.arclength, solver.load_tangent(x, True), outcome)
        if b is not None and (a.load - load) * (b.load - load) < 0:
            yield Arc(solver, a, b).at_load(load)

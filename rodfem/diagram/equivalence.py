"""Whether two points of a diagram are one, neighbours, or mirror images; where a branch closes, or meets another one.

Points are compared by what no symmetry of the rod changes: load, energy and stretch.  Two sides of a pitchfork may be
mirror images in their plane, and differ in what they do across it: then no symmetry of the rod carries one into the
other.  The eigenvalues nearest zero tell.

Of the two sides of a symmetric pitchfork only one is traced.  A discrete symmetry of the equations
(:mod:`rodfem.deflation.symmetries`) carries it to the other one, of the same energies and indices.  A diagram
shows that image where its ordinate has the opposite sign.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import inf

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import Arc
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.curves import VERTICAL
from rodfem.deflation.symmetries import candidates, mirrors
from rodfem.diagram.events import Step
from rodfem.errors import ConvergenceError
from rodfem.problem.units import Units
from rodfem.stability.inertia import NULL, Factored, Index
from rodfem.tolerances import NEGLIGIBLE, SAME_SPECIAL, SAME_STATE, unit

CARRIED, OTHER = 1e-3, 1e-6
"""Distance of a state's image from another state, over that of the two, below which the one is the other; difference of
two ordinates, relative to the greatest one, above which they are two: one below it has no side."""

Alike = Callable[[Point, Point, float], bool]


def equivalent(a: Point, b: Point, units: Units, tolerance: float = 1e-8, of_strain: float = 0.0) -> bool:
    """Whether two points agree in load, energy and stretch to a ``tolerance``, stretches ``of_strain`` if larger."""
    pairs = (
        (a.load, b.load, tolerance, units.load),
        (a.energy, b.energy, tolerance, units.energy),
        (a.stretch, b.stretch, max(tolerance, of_strain), 1.0),
    )
    return all(abs(p - q) <= allowed * unit(p, q, one=one) for p, q, allowed, one in pairs)


def neighbours(a: Point, b: Point, units: Units, steps: float = 2.0) -> bool:
    """Whether points ``a``, ``b`` of a rod with these ``units`` could be neighbours, ``steps`` apart, on one branch."""
    reach = 0.05 * steps
    close = abs(a.load - b.load) <= reach * unit(a.load, one=units.load)
    return close and abs(a.energy - b.energy) <= reach * unit(a.energy, one=units.energy)


def are_images(solver: BranchSolver, a: Point, b: Point) -> bool:
    """Whether first points ``a``, ``b`` of branches that leave a point in opposite ways are mirror images."""
    if not equivalent(a, b, solver.units) or (a.negative, a.zero) != (b.negative, b.zero):
        return False
    if a.mesh == b.mesh and not _as_stable(solver.inertia.at, a, b):
        return False
    return solver.space is None or _as_stable(solver.space.at, a, b)


def _as_stable(at: Callable[[PETSc.Vec], Factored], a: Point, b: Point) -> bool:
    """Whether two states, whose second variations are those ``at`` them, have the same index and eigenvalues."""
    (index, first, noise), (other, second, _) = (_nearest(at(point.x)) for point in (a, b))
    if index != other:
        return False
    # of a zero the mesh makes a value as it lies to the elements: two of one sign are alike
    alike = (noise > 0) & (first * second > 0)
    return bool((alike | (abs(first - second) <= 1e-3 * abs(first) + noise)).all())  # meshes are not symmetric


def _nearest(found: Factored) -> tuple[Index, np.ndarray, np.ndarray]:
    """Index, zero eigenvalues and a few more, ascending, and the round-off of the former; 0 for others."""
    index = found.count()
    values, vectors = found.nearest(index.zero + 3, NULL)
    order = np.argsort(values)
    noise = np.array([found.noise(v) for v in vectors]) * (abs(values) <= found.inertia.tolerance)
    return index, values[order], noise[order]


def image_of(branch: Branch, solver: BranchSolver) -> str:
    """The symmetry, in words, that carries a branch to one with the opposite ordinate; empty for none."""
    shape, (chosen, size) = solver.shape, _sampled(branch, solver)
    if not chosen or any(abs(point.ordinate) <= OTHER * size for point in chosen):
        return ""
    found = candidates(shape.system)
    for point in chosen:  # the ordinate, which few of them take to its opposite, costs less than the equations
        there = [shape.ordinate(mirror(shape, point.x)) + point.ordinate for mirror in found]
        opposite = [mirror for mirror, left in zip(found, there, strict=True) if abs(left) <= NEGLIGIBLE * size]
        found = mirrors(shape, point.x, opposite)
    found.sort(key=lambda mirror: (mirror.reversal, -sum(mirror.signs), mirror.signs))
    return found[0].in_words() if found else ""


def other_ordinates(branch: Branch, first: Point, image: Point, solver: BranchSolver) -> str:
    """Words for the symmetry that carries a ``branch`` to one of other ordinates; empty if it keeps their size."""
    shape, system, (chosen, size) = solver.shape, solver.system, _sampled(branch, solver)
    near = CARRIED * system.norm(first.x - image.x)
    found = [m for m in candidates(system) if system.norm(m(shape, first.x) - image.x) <= near]
    found = mirrors(shape, first.x, found)  # a small imperfection carries the one near the other, too
    for mirror in found:
        changes = [abs(shape.ordinate(mirror(shape, p.x))) - abs(p.ordinate) for p in chosen]
        if all(abs(change) <= OTHER * size for change in changes):
            return ""
    return found[0].in_words() if found else ""


def _sampled(branch: Branch, solver: BranchSolver) -> tuple[list[Point], float]:
    """Two points of a branch on the mesh of a solver, and the size of its ordinates there."""
    points = [point for point in branch.points if point.mesh == solver.mesh]
    chosen = [points[round(share * (len(points) - 1))] for share in (0.5, 1.0)] if points else []
    return chosen, max([solver.units.ordinate, *(abs(point.ordinate) for point in points)])


def loop_end(branch: Branch, step: Step, width: float, alike: Alike) -> Point | None:
    """Last point of a ``branch`` that is back at its beginning in a ``step``; None if it is not."""
    if len(branch.points) < 12:
        return None
    solver, a, b = step.solver, step.a, step.b
    if max(abs(a.slope), abs(b.slope)) < VERTICAL * width:  # equal loads: compare the states
        first = solver.interpolated(branch.points[0])
        passed = solver.system.distance(b.x, first.x) < b.arclength - a.arclength
        return b if passed else None
    first = branch.points[0 if branch.parent is None else 1]
    if not (_passes(a, b, first) and neighbours(first, a, solver.units, 4)):
        return None
    try:
        point = Arc(solver, a, b).at_load(first.load)
    except ConvergenceError:  # near a fold, say: not there
        return None
    return point if alike(point, first, SAME_STATE) else None


def _passes(a: Point, b: Point, first: Point) -> bool:
    """Whether the load passes that of the ``first`` point between two others, and in the same direction."""
    return min(a.load, b.load) <= first.load <= max(a.load, b.load) and a.load != b.load and a.slope * first.slope > 0


def connection(branch: Branch, special: SpecialPoint, branches: Sequence[Branch], alike: Alike, load: str) -> str:
    """Recognise a ``special`` point that one of the ``branches`` has; a reason if the ``branch`` ends there."""
    from_the_side, where = special.test_function == "slope", f"at {load} = {special.point.load:.8g}"
    found = next(_copies(branch, special, branches, alike), None)
    if found is None:
        return f"meets another branch {where}" if from_the_side else ""
    other, i = found
    special.connects_to = (other.name, i)
    special.switched = other.special[i].switched = True
    if branch.parent == special.connects_to:
        return "closed loop"
    if not from_the_side and other.special[i].test_function == "slope":
        return ""  # the branch on which the known one ended: it goes on
    return f"meets {other.name} {where}"


def _copies(
    branch: Branch, special: SpecialPoint, branches: Sequence[Branch], alike: Alike
) -> Iterator[tuple[Branch, int]]:
    """Yield where a ``special`` point of a ``branch`` is known: a branch, and the number of the point on it."""
    for other in branches:
        # a neighbour on this branch is another point: of a nearly double eigenvalue
        until = special.point.arclength - 0.5 if other is branch else inf
        for i, known in enumerate(other.special):
            at = known.point
            if known.kind.branches and at.arclength <= until and alike(at, special.point, SAME_SPECIAL):
                yield other, i

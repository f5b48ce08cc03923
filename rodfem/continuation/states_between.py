"""Equilibria between two neighbouring points of a branch: on a plane across it, or at a load."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node
from rodfem.continuation.prediction import ALIGNED, between, cubic
from rodfem.continuation.prediction import Knot as Row
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.newton import NewtonResult, correct, linear_step
from rodfem.roots import zero_between
from rodfem.tolerances import INSIDE

EXACT = 1e-15
"""Arclength, in the metric, to which a load is located before it is set."""
CORRECTIONS = 3
"""Newton steps on the interpolated load that improve the arclength at which a state is expected."""
ON_THE_WAY = 0.5
"""Distance of a state from where it is expected, over that from the nearer neighbour, below which it is on the way."""
INTERPOLATED = 1e-7
"""Distance of a state from where it is expected, in the metric, that is the error of the interpolation."""
STEADY = 3.0
"""Uncertainty of a result, in units of its change by one more step of Newton's method."""
SETTLES = 1e-2
"""Distance, in the metric, that a state which was solved for with damping may move without it."""
STRAYED = 0.3
"""Distance of a state from where it is expected, over that from the nearer end, at which it is another branch's; of a
singular state over the piece."""
LEAST = 1e-9
"""That distance, in the metric, which is round-off."""
Curve = Callable[[float], tuple[PETSc.Vec, PETSc.Vec]]


def solve_at(solver: BranchSolver, curve: Curve, s: float) -> PETSc.Vec:
    """Equilibrium on the plane through ``curve(s)`` across its direction; raises :class:`ConvergenceError`."""
    start, direction = curve(s)
    system, row, before = solver.system, solver.row(direction), solver.system.damping
    try:  # beside a state that may move freely, where Newton's method slides away: with damping
        for system.damping in dict.fromkeys((before, before or solver.inertia.tolerance)):
            x = start.copy()
            if correct(system, x, row).converged:
                return x
    finally:
        system.damping = before
    raise ConvergenceError(
        f"No equilibrium near load {system.scalar(start):.8g} while locating a special point", SMALLER_STEPS
    )


def solve_at_load(
    solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float
) -> tuple[PETSc.Vec, float, NewtonResult]:
    """State at exactly ``load`` between two neighbours ``p``, ``q`` of a branch, its arclength, and the last iteration.

    Close to a branch point Newton's method at a fixed load fails, or ends on the other branch: far from where the
    ``curve`` that interpolates the branch is.  On planes across the branch it does not, and the load is a function of
    arclength there, whose zero is found.  ``solver`` has the mesh.  Raises :class:`ConvergenceError` where there is no
    such state.
    """
    system, s = solver.system, _expected(solver, curve, p, q, load)
    guess = curve(s)[0]
    x, outcome = solver.at_load(guess, load, reach=1.0)
    if outcome.converged:
        near = min(system.distance(p.x, x), system.distance(q.x, x))
        if load in (p.load, q.load) or system.distance(guess, x) < max(ON_THE_WAY * near, INTERPOLATED):
            return x, s, outcome
    if (p.load - load) * (q.load - load) >= 0:
        raise ConvergenceError(
            f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another load."
        )

    known = {p.arclength: p.load, q.arclength: q.load}  # there the equations may be singular

    def beyond(s: float) -> float:
        return (known[s] if s in known else system.scalar(solve_at(solver, curve, s))) - load

    margin = INSIDE * (q.arclength - p.arclength)
    s = zero_between(beyond, p.arclength, q.arclength, EXACT)
    s = min(max(s, p.arclength + margin), q.arclength - margin)
    x = solve_at(solver, curve, s)
    system.set_load(x, load)
    return x, s, outcome


def _expected(solver: BranchSolver, curve: Curve, p: Point, q: Point, load: float) -> float:
    """Arclength between ``p`` and ``q`` at which the interpolated branch has a ``load``."""
    s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
    for _ in range(CORRECTIONS):
        x, direction = curve(s)
        slope = solver.system.scalar(direction)
        if slope:
            there = s + (load - solver.system.scalar(x)) / slope
            # never onto an end, at another load: beside a branch point that is a state of the other branch
            s = min(max(there, (p.arclength + s) / 2), (s + q.arclength) / 2)
    return s


def point_between(solver: BranchSolver, a: Point, b: Point, s: float) -> Point | None:
    """Point at arclength ``s`` between the points ``a`` and ``b`` of a branch of ``solver``; None where it is not."""
    try:
        x = solve_at(solver, lambda t: between(a, b, t), s)
    except ConvergenceError:
        return None
    whole = solver.system.distance(a.x, b.x)
    if max(solver.system.distance(a.x, x), solver.system.distance(x, b.x)) > whole:
        return None
    return solver.point(x, s, solver.tangent(solver.row(between(a, b, s)[1]), at=x))


def stepped(solver: BranchSolver, x: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """The equilibrium ``x`` of a mesh after more steps of Newton's method, one where that makes no difference.

    They are made on the plane across ``row``, with factors of that state, and without damping: where an equilibrium was
    solved for with it, its factors see little of what a soft mode has left.  A state that slides away along a family
    makes one step with damping.  ``solver`` has the mesh.
    """
    system, settled = solver.system, x.copy()
    given = system.damping
    try:
        system.damping = 0.0
        if correct(system, settled, row, reach=SETTLES).converged:
            return settled
    finally:
        system.damping = given
    system.set_phase(x)
    step = linear_step(system, x, row, given or solver.inertia.tolerance)
    return x if step is None else x - step


@dataclass(frozen=True, eq=False)
class Knot:
    """A state of the branch: ``x``, and the derivative ``slope`` of the curve in the place.

    The ``speed`` is the derivative of the place along the unit tangent.
    """

    x: PETSc.Vec
    slope: PETSc.Vec
    speed: float


class Chord(ABC):
    """The curve between the states ``a`` and ``b`` of a branch on the mesh of a ``solver``.

    Places are along the chord: ``s = d . M (x - x_a)`` with the unit vector ``d`` from the one state to the other.  A
    state at a place is solved for on the plane across the chord, so that places are smooth along the branch, and
    differences of the arclengths of neighbouring rows.
    """

    def __init__(self, solver: BranchSolver, a: Row, b: Row) -> None:
        """Measure the chord."""
        self.solver, self.begin = solver, a.arclength
        self.chord = b.x - a.x
        self.length = self.solver.system.norm(self.chord)
        self.chord.scale(1.0 / self.length)
        self.row, self.origin = self.solver.row(self.chord), a.x

    @abstractmethod
    def node(self, x: PETSc.Vec, tangent: PETSc.Vec) -> Node:
        """Node at a state with its unit tangent."""

    def place(self, x: PETSc.Vec) -> float:
        """Where a state is."""
        return float(self.row.dot(x - self.origin))

    def curve(self, p: Node, q: Node, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and derivative at a place between two nodes."""
        return cubic([p.kept.x, p.kept.slope, q.kept.x, q.kept.slope], q.s - p.s, s - p.s)

    def solve(self, p: Node, q: Node, s: float) -> Node | None:
        """Node at a place between two others; None where there is no equilibrium near where it is expected."""
        solver, (guess, slope) = self.solver, self.curve(p, q, s)
        try:
            x = solve_at(solver, lambda _: (guess, self.chord), s)
        except ConvergenceError:
            return None
        if solver.system.distance(x, guess) > STRAYED * min(s - p.s, q.s - s) + LEAST:
            return None
        slope.scale(1.0 / solver.system.norm(slope))
        try:
            tangent = solver.tangent(self.row, at=x)
        except ConvergenceError:  # a singular state
            return self.node(x, slope)
        return self.node(x, tangent if solver.row(slope).dot(tangent) > ALIGNED else slope)

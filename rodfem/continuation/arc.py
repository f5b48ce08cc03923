"""States of a branch between two of its points: the polynomial through both, corrected by Newton's method on a plane.

An :class:`Arc` answers where the branch is at an arclength, and at a load.  A :class:`Chord` is the same between nodes
of a number or a matrix of which the derivative is known as well, as in a :class:`Piece` the reduced stiffness; its
planes are across the chord.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import ALIGNED, BranchSolver, between, cubic
from rodfem.continuation.branch_solver import Knot as Row
from rodfem.continuation.crossings import Node, places
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.fem.checks import Convexity
from rodfem.fem.newton import correct, linear_step
from rodfem.roots import zero_between
from rodfem.stability.reduced_stiffness import Condensation, ReducedStiffness
from rodfem.tolerances import INSIDE

STEADY = 3.0
"""Uncertainty of a result, in units of its change by one more step of Newton's method."""
STRAYED, LEAST = 0.3, 1e-9
"""Distance of a state from where it is expected, over that from the nearer end, at which it is another branch's; of a
singular state over the piece.  The second one, in the metric, is round-off."""
DIFFERENCE = 1e-5
"""Step of the difference quotients of a margin of convexity, relative to the arc."""


def corrected(solver: BranchSolver, start: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """Equilibrium on the plane through ``start`` across a ``row``; raises :class:`ConvergenceError`."""
    system, before = solver.system, solver.system.damping
    try:  # next to a state that may move freely, where Newton's method slides away: with damping
        for system.damping in dict.fromkeys((before, before or solver.inertia.tolerance)):
            x = start.copy()
            if correct(system, x, row).converged:
                return x
    finally:
        system.damping = before
    raise ConvergenceError(
        f"No equilibrium near load {system.scalar(start):.8g} while locating a special point", SMALLER_STEPS
    )


class Arc:
    """The branch of a ``solver`` from a point ``a`` to another one, ``b``, both on its mesh.

    Places are arclengths; states are on planes across the polynomial of least degree through both points and what
    tangents they have.
    """

    def __init__(self, solver: BranchSolver, a: Point, b: Point) -> None:
        self.solver, self.a, self.b = solver, a, b

    def curve(self, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and direction of the polynomial."""
        return between(self.a, self.b, s)

    def state(self, s: float) -> PETSc.Vec:
        """The equilibrium; raises :class:`ConvergenceError` where there is none."""
        start, direction = self.curve(s)
        return corrected(self.solver, start, self.solver.row(direction))

    def point(self, s: float) -> Point:
        """The equilibrium with its records; raises :class:`ConvergenceError` where it is not between the two points."""
        x, system = self.state(s), self.solver.system
        if max(system.distance(self.a.x, x), system.distance(x, self.b.x)) > system.distance(self.a.x, self.b.x):
            raise ConvergenceError(f"no equilibrium joins loads {self.a.load:.8g} and {self.b.load:.8g}")
        return self.solver.point(x, s, self.solver.tangent(self.solver.row(self.curve(s)[1]), at=x))

    def at_load(self, load: float) -> Point:
        """The point at exactly a ``load`` between those of both ends; raises :class:`ConvergenceError` without one.

        Close to a branch point Newton's method at a fixed load fails, or ends on the other branch: far from where the
        arc is.  On planes across it it does not, and the load is a function of arclength there, whose zero is found.
        """
        solver, system, a, b = self.solver, self.solver.system, self.a, self.b
        if (a.load - load) * (b.load - load) > 0:
            raise ConvergenceError(
                f"No equilibrium at {system.scene.load} = {load:g} between two points of the branch: use another load."
            )
        s = self._place(load, lambda s: self.curve(s)[0])
        guess = self.curve(s)[0]
        x, outcome = solver.at_load(guess, load, reach=1.0)
        near = min(system.distance(end.x, x) for end in (a, b))
        if not outcome.converged or (
            load not in (a.load, b.load) and system.distance(guess, x) > STRAYED * near + LEAST
        ):
            s = self._place(load, self.state)
            x = self.state(s)
            system.set_load(x, load)
        return solver.point(x, s, solver.load_tangent(x, b.load > a.load), outcome)

    def _place(self, load: float, state: Callable[[float], PETSc.Vec]) -> float:
        """Where states have a load; it is known at both ends, where equations may be singular."""
        first, last = self.a.arclength, self.b.arclength
        known = {first: self.a.load, last: self.b.load}

        def beyond(s: float) -> float:
            return (known[s] if s in known else self.solver.system.scalar(state(s))) - load

        low, high = sorted(known)
        margin = INSIDE * (high - low)  # never onto an end: a branch point is a state of the other branch, too
        return min(max(zero_between(beyond, first, last, 1e-15), low + margin), high - margin)  # exactly

    def lost_convexity(self) -> str:
        """Why a branch ends on the arc; empty where the stored energy stays convex."""
        solver, first, length = self.solver, self.a.arclength, self.b.arclength - self.a.arclength

        def holds(t: float) -> bool:
            try:
                return not solver.lost_convexity(self.b.x if t == 1.0 else self.state(first + t * length))
            except ConvergenceError:  # where the energy is not convex the equations may be singular
                return False

        lost = lost_between(solver.convexity, lambda t: self.curve(first + t * length)[0], holds)
        return "" if lost is None else solver.not_convex(self.curve(first + lost * length)[0])


def lost_between(
    convexity: Convexity, state: Callable[[float], PETSc.Vec], holds: Callable[[float], bool]
) -> float | None:
    """First ``t`` between 0 and 1 at which ``W`` is not convex along ``state(t)``, as it is along ``state(0)``.

    The least eigenvalue of the second derivative of ``W`` (:mod:`rodfem.fem.checks`) is a cubic, by its values and
    difference quotients at both ends.  Where that turns, and at the end, it may not be positive: ``holds(t)`` decides
    by an equilibrium.  None where ``W`` stays convex.
    """
    if not convexity.alters:
        return None
    scales = convexity.scales(state(0.0), state(1.0))
    margin = cache(lambda t: convexity.margin(state(t), scales))

    def node(t: float, other: float) -> Node:
        return _number(t, margin(t), (margin(other) - margin(t)) / (other - t))

    last = 0.0
    for t in [*places(node(0.0, DIFFERENCE), node(1.0, 1.0 - DIFFERENCE), 1), 1.0]:
        if margin(t) <= 0.0 and not holds(t):
            return zero_between(margin, last, t, LEAST) if margin(last) > 0.0 else t
        last = t
    return None


def _number(s: float, value: float, slope: float) -> Node:
    """Node of a number."""
    return Node(s, np.array([[value]]), np.array([[slope]]), 0)


def stepped(solver: BranchSolver, x: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """The equilibrium ``x`` after more steps of Newton's method, on the plane across ``row`` and without damping.

    Where an equilibrium was solved for with damping its factors see little of what a soft mode has left.  A state that
    slides away along a family makes one step with it.
    """
    system, settled = solver.system, x.copy()
    given = system.damping
    try:
        system.damping = 0.0
        if correct(system, settled, row, reach=1e-2).converged:
            return settled
    finally:
        system.damping = given
    system.set_phase(x)
    step = linear_step(system, x, row, given or solver.inertia.tolerance)
    return x if step is None else x - step


@dataclass(frozen=True, eq=False)
class Knot:
    """A state of the branch, and what is known there."""

    x: PETSc.Vec
    slope: PETSc.Vec  # derivative of the curve in the place
    speed: float  # derivative of the place along the unit tangent
    reduced: ReducedStiffness | None = None


class Chord(ABC):
    """The curve between the states ``a`` and ``b`` of a branch on the mesh of a ``solver``.

    Places are along the chord: ``s = d . M (x - x_a)`` with the unit vector ``d`` from the one state to the other.  A
    state at a place is solved for on the plane across the chord, so that places are smooth along the branch, and
    differences of the arclengths of neighbouring rows.
    """

    def __init__(self, solver: BranchSolver, a: Row, b: Row) -> None:
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
            x = corrected(solver, guess, self.row)
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


class Piece(Chord):
    """The piece from the row ``a`` to the row ``b`` of a branch on one mesh, with the reduced stiffness along it."""

    def __init__(self, solver: BranchSolver, condensation: Condensation, a: Point, b: Point, phi: np.ndarray) -> None:
        """Take the border ``phi`` of the matrices that ``condensation`` makes for the ``solver``."""
        super().__init__(solver, a, b)
        self.condensation, self.phi = condensation, phi
        self.moving = np.eye(phi.shape[1])

    def leave_out(self, still: np.ndarray) -> None:
        """Leave the amplitudes ``still`` (k, m), along which eigenvalues stay zero, out of nodes made from now on."""
        self.moving = np.linalg.svd(still)[0][:, still.shape[1] :]

    @property
    def still(self) -> int:
        """Number of amplitudes that were left out."""
        return self.moving.shape[0] - self.moving.shape[1]

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, reduced: ReducedStiffness | None = None) -> Node:
        """Node at a state with its unit tangent; its reduced stiffness may be known."""
        reduced = reduced or self.condensation.at(x, tangent, self.phi)
        speed, Q = float(self.row.dot(tangent)), self.moving
        knot = Knot(x, tangent * (1.0 / speed), speed, reduced)
        return Node(self.place(x), Q.T @ reduced.H @ Q, Q.T @ reduced.rate @ Q / speed, reduced.far, knot)

    def turn(self, p: Node, q: Node) -> float | None:
        """Where the load turns back between two nodes; None where it does not."""
        load = self.solver.system.scalar
        a, b = (_number(node.s, load(node.kept.x), load(node.kept.slope)) for node in (p, q))
        if a.slope.item() * b.slope.item() >= 0:
            return None
        return next((p.s + t * (q.s - p.s) for t in places(a, b, 1)), None)

r"""A piece of a branch between two of its states, as a curve whose second variation is known all along.

Places are along the chord: ``s = d . M (x - x_a)`` with the unit vector ``d`` from the one state to the other.  A state
at a place is solved for on the plane across the chord, so that places are smooth along the branch, and differences of
the arclengths of neighbouring rows.  Between two states with their tangents the branch is a cubic, and so is the
reduced stiffness matrix (:mod:`rodfem.continuation.crossings`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node
from rodfem.continuation.states_between import solve_at
from rodfem.errors import ConvergenceError
from rodfem.linalg.orthogonal import combine
from rodfem.stability.reduced_stiffness import Condensation, ReducedStiffness

STRAYED = 0.3
"""Distance of a state from where it is expected, over that from the nearer end, at which it is another branch's; of a
singular state over the piece."""
LEAST = 1e-9
"""That distance, in the metric, which is round-off."""


@dataclass(frozen=True, eq=False)
class Knot:
    """A state of the branch: ``x``, the derivative ``slope`` of the curve in the place, and its reduced stiffness.

    The ``speed`` is the derivative of the place along the unit tangent.
    """

    x: PETSc.Vec
    slope: PETSc.Vec
    speed: float
    reduced: ReducedStiffness


class Piece:
    """The piece from the row ``a`` to the row ``b`` of a branch on one mesh."""

    def __init__(self, solver: BranchSolver, condensation: Condensation, a: Point, b: Point, phi: np.ndarray) -> None:
        """Measure the chord; ``phi`` is the border of the matrices that ``condensation`` makes for the ``solver``."""
        self.solver, self.condensation, self.phi, self.begin = solver, condensation, phi, a.arclength
        self.chord = b.x - a.x
        self.length = self.solver.system.norm(self.chord)
        self.chord.scale(1.0 / self.length)
        self.row, self.origin = self.solver.row(self.chord), a.x
        self.moving = np.eye(phi.shape[1])

    def leave_out(self, still: np.ndarray) -> None:
        """Leave the amplitudes ``still`` (k, m), along which eigenvalues stay zero, out of nodes made from now on."""
        self.moving = np.linalg.svd(still)[0][:, still.shape[1] :]

    @property
    def still(self) -> int:
        """Number of amplitudes that were left out."""
        return self.moving.shape[0] - self.moving.shape[1]

    def place(self, x: PETSc.Vec) -> float:
        """Where a state is."""
        return float(self.row.dot(x - self.origin))

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, reduced: ReducedStiffness | None = None) -> Node:
        """Node at a state with its unit tangent; its reduced stiffness may be known."""
        reduced = reduced or self.condensation.at(x, tangent, self.phi)
        speed, Q = float(self.row.dot(tangent)), self.moving
        knot = Knot(x, tangent * (1.0 / speed), speed, reduced)
        return Node(self.place(x), Q.T @ reduced.H @ Q, Q.T @ reduced.rate @ Q / speed, reduced.far, knot)

    def curve(self, p: Node, q: Node, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and derivative at a place between two nodes."""
        h = q.s - p.s
        t = (s - p.s) / h
        parts = [p.kept.x, p.kept.slope, q.kept.x, q.kept.slope]
        value = np.array([(1 + 2 * t) * (1 - t) ** 2, h * t * (1 - t) ** 2, t * t * (3 - 2 * t), h * t * t * (t - 1)])
        slope = np.array([-6 * t * (1 - t) / h, (1 - t) * (1 - 3 * t), 6 * t * (1 - t) / h, t * (3 * t - 2)])
        return combine(parts, value), combine(parts, slope)

    def solve(self, p: Node, q: Node, s: float) -> Node | None:
        """Node at a place between two others; None where there is no equilibrium near where it is expected."""
        solver, (guess, slope) = self.solver, self.curve(p, q, s)
        try:
            x = solve_at(solver, lambda _: (guess, self.chord), s)
        except ConvergenceError:
            return None
        if solver.system.distance(x, guess) > STRAYED * min(s - p.s, q.s - s) + LEAST:
            return None
        try:
            tangent = solver.tangent(self.row, at=x)
        except ConvergenceError:
            tangent = slope * (1.0 / solver.system.norm(slope))
        return self.node(x, tangent)

    def turn(self, p: Node, q: Node) -> float | None:
        """Where the load turns back between two nodes; None where it does not."""
        load = self.solver.system.scalar
        a, b = load(p.kept.slope), load(q.kept.slope)
        if a * b >= 0:
            return None
        h, rise = q.s - p.s, load(q.kept.x) - load(p.kept.x)
        # the slope of the cubic in t: a + (6 r - 4 a - 2 b) t + (3 a + 3 b - 6 r) t^2, with r = rise/h
        r = rise / h
        roots = np.roots([3 * a + 3 * b - 6 * r, 6 * r - 4 * a - 2 * b, a])
        inside = [t.real for t in roots if abs(t.imag) < LEAST and 0 <= t.real <= 1]
        return p.s + h * inside[0] if inside else None

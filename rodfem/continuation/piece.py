r"""A piece of a branch between two of its states, as a curve whose second variation is known all along.

Between two states with their tangents the branch is a cubic, and so is the reduced stiffness matrix
(:mod:`rodfem.continuation.crossings`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import LEAST, Chord, Knot
from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node
from rodfem.stability.reduced_stiffness import Condensation, ReducedStiffness


@dataclass(frozen=True, eq=False)
class ReducedKnot(Knot):
    """A state with its ``reduced`` stiffness."""

    reduced: ReducedStiffness


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
        knot = ReducedKnot(x, tangent * (1.0 / speed), speed, reduced)
        return Node(self.place(x), Q.T @ reduced.H @ Q, Q.T @ reduced.rate @ Q / speed, reduced.far, knot)

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

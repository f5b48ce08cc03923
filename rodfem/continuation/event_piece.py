r"""Where a number of the state vanishes between two states of a branch: an event, by the cubic of the number.

By its values and its derivatives along the tangents at both states the number is a cubic of the place
(:mod:`rodfem.continuation.crossings`, with one row and one column).  Where its control values have one sign there is no
zero.  Else the places at which it turns are corrected to equilibria at which the derivative vanishes, and between these
the number is monotone.  Where it changes its sign the place is corrected to the equilibrium at which it is zero; at a
turn it may be zero, too.  Each correction is a zero of the cubic between the nearest states on either side.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby, pairwise
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import LEAST, STEADY, Chord, Knot, corrected, stepped
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node, clear, places
from rodfem.errors import ConvergenceError, SceneError
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import generic
from rodfem.problem.events import Event
from rodfem.tolerances import ROUND_OFF, TINY

DIFFERENCE, GENERIC = 1e-5, 1e-2
"""Steps of differences along the tangent, in the metric, and in a generic direction, in natural sizes."""
REACH = 0.02
"""Distance along the branch, in the metric, to which an event is sought again on another mesh."""


class End(NamedTuple):
    """An end of a piece: a state with its unit tangent."""

    arclength: float
    x: PETSc.Vec
    tangent: PETSc.Vec
    samples: list[dict[str, Any]]  # what the functions of events receive: there, ahead, behind, and aside


def end(solver: BranchSolver, arclength: float, x: PETSc.Vec, direction: PETSc.Vec) -> End:
    """End of a piece at a state ``x`` at an ``arclength``, with the ``direction`` of the branch."""
    tangent = direction * (1.0 / solver.system.norm(direction))
    states = x, x + tangent * DIFFERENCE, x - tangent * DIFFERENCE, x + _aside(solver.system, GENERIC)
    return End(arclength, x, tangent, [solver.shape.sample(state) for state in states])


class EventPiece(Chord):
    """A piece of a branch with the number of an event along it.

    It is zero to round-off up to the ``level``: :data:`~rodfem.tolerances.ROUND_OFF` times the rate at which it varies
    with the state in a generic direction, as along the branch it need not vary.
    """

    def __init__(self, solver: BranchSolver, event: Event, a: End, b: End) -> None:
        super().__init__(solver, a, b)
        self.event = event
        self.first, self.last = (self.node(end.x, end.tangent, end.samples) for end in (a, b))
        varied = (abs(self._change(p, x.samples[-1])) for p, x in ((self.first, a), (self.last, b)))
        self.level = ROUND_OFF / GENERIC * max(varied)

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, seen: list[dict[str, Any]] | None = None) -> Node:
        """Node at a state with its unit tangent; what the number receives there may have been ``seen``."""
        here, ahead, behind, *_ = seen or end(self.solver, 0.0, x, tangent).samples
        speed = float(self.row.dot(tangent))
        node = Node(self.place(x), np.array([[self.event(here)]]), np.zeros((1, 1)), 0)
        slope = (self._change(node, ahead) - self._change(node, behind)) / (2 * DIFFERENCE * speed)
        return replace(node, slope=np.array([[slope]]), kept=Knot(x, tangent * (1.0 / speed), speed))

    def is_zero(self, node: Node) -> bool:
        """Whether the number is zero to round-off."""
        return abs(node.H.item()) <= self.level

    def turns(self) -> list[Node]:
        """Nodes at which the number turns; raises :class:`ConvergenceError` where an equilibrium is not found."""
        first, last = self.first, self.last
        known, nodes = places(first, last, 1), [first, last]
        if len(known) > 1:
            nodes.insert(1, self._solved(first, last, float(np.mean(known))))
        return [self._located(p, q, 1) for p, q in pairwise(nodes) if p.slope.item() * q.slope.item() < 0]

    def zeros(self) -> list[Node]:
        """Nodes at which the number is zero, in order; neighbours among ends and turns are one place: the end.

        Raises :class:`ConvergenceError` where an equilibrium is not found.
        """
        first, last = self.first, self.last
        known, out = [first, *([] if clear(first, last, np.zeros((1, 1))) else self.turns()), last], list[Node]()
        for zero, group in groupby(known, self.is_zero):
            if zero:
                out.append(min(group, key=lambda node: min(node.s - first.s, last.s - node.s)))
        for p, q in pairwise(known):
            if p.H.item() * q.H.item() < 0 and not (self.is_zero(p) or self.is_zero(q)):
                out.append(self._located(p, q, 0))
        return sorted(out, key=lambda node: node.s)

    def uncertainty(self, node: Node) -> float:
        """How far the place of a node is uncertain, by its value and by what arithmetic leaves open.

        A number is below a level within ``2 level/rate``, and where it turns within ``2 (level/bend)^(1/2)``, with the
        mean second derivative of the piece.
        """
        x, system = node.kept.x, self.solver.system
        others = stepped(self.solver, x, self.row), x + _aside(system, ROUND_OFF)
        off = max(abs(self._change(node, self.solver.shape.sample(y))) for y in others)
        bend = abs(self.last.slope.item() - self.first.slope.item()) / (self.last.s - self.first.s)
        level = abs(node.H.item()) + STEADY * off + bend * LEAST**2 / 2
        return 2 * level / max(abs(node.slope.item()), sqrt(bend * level), TINY)

    def _change(self, node: Node, sample: dict[str, Any]) -> float:
        """Change of the number from a node to a state next to it; none where it has no value there."""
        try:
            with np.errstate(invalid="ignore"):
                return self.event(sample) - float(node.H.item())
        except SceneError:
            return 0.0

    def _located(self, p: Node, q: Node, order: int) -> Node:
        """Node between two others at which the number, or its derivative of an ``order``, changes its sign."""
        within, tries = (1e-13, LEAST)[order], 0  # in the metric: what round-off leaves open
        while True:
            tries += 1  # each fourth time the piece is halved: the cubic of a jump may come no nearer
            known = places(p, q, order) if tries % 4 else []
            node = self._solved(p, q, known[0] if known else 0.5)
            if min(node.s - p.s, q.s - node.s) <= within or (order == 0 and self.is_zero(node)):
                return node
            before, here = ((n.H, n.slope)[order].item() for n in (p, node))
            p, q = (node, q) if here * before > 0 else (p, node)

    def _solved(self, p: Node, q: Node, t: float) -> Node:
        """Node at a part of the way between two others, solved for from the curve of the whole piece."""
        node = self.solve(self.first, self.last, p.s + t * (q.s - p.s))
        if node is None:
            raise ConvergenceError(f"no equilibrium is found where the event {self.event.name!r} happens")
        return node


def nearest(solver: BranchSolver, event: Event, x: PETSc.Vec, tangent: PETSc.Vec) -> tuple[Node, float]:
    """Node at which an ``event`` happens nearest to a state ``x``, and how far its place is uncertain.

    A number that touches zero on another mesh may not reach it on that of the ``solver``: then it is where it turns.
    Raises :class:`ConvergenceError` where the event does not happen there.
    """
    row, both = solver.row(tangent), list[End]()
    for s in (-REACH, REACH):
        there = corrected(solver, x + tangent * s, row)
        both.append(end(solver, s, there, solver.tangent(row, at=there)))
    piece = EventPiece(solver, event, *both)
    nodes = piece.zeros() or piece.turns()
    if not nodes:
        raise ConvergenceError(f"the event {event.name!r} does not happen near there")
    node = min(nodes, key=lambda node: abs(node.s - piece.place(x)))
    return node, piece.uncertainty(node)


def _aside(system: System, size: float) -> PETSc.Vec:
    """A change of state in a generic direction, of a ``size`` in natural sizes."""
    out = system.new_vector()
    out.array[:] = size * generic(np.arange(*out.getOwnershipRange()))
    return system.in_units(out, 1)

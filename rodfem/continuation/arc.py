"""States of a branch between two of its points: the polynomial through both, corrected by Newton's method on a plane.

An :class:`Arc` answers where the branch is at an arclength, and at a load.  A :class:`Chord` is the same between nodes
of a number or a matrix of which the derivative is known as well, as in a :class:`Piece` the reduced stiffness; its
planes are across the chord.

In an :class:`EventPiece` it is the number of an event.  Where its control values have one sign there is no zero.  Else
the places at which it turns are corrected to equilibria at which the derivative vanishes, and between these the number
is monotone.  Where it changes its sign the place is corrected to the equilibrium at which it is zero; at a turn it may
be zero, too.  Each correction is a zero of the cubic between the nearest states on either side.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.crossings import Node, clear, places
from rodfem.continuation.curves import ALIGNED, cubic, interpolant, zero_between
from rodfem.continuation.kinds import EVENT, LEVEL, Kind
from rodfem.errors import SMALLER_STEPS, ConvergenceError, SceneError
from rodfem.fem.newton import correct, linear_step
from rodfem.fem.system import System
from rodfem.linalg.orthogonal import generic
from rodfem.problem.events import Event, Level
from rodfem.stability.reduced_stiffness import Condensation, ReducedStiffness
from rodfem.tolerances import INSIDE, ROUND_OFF, TINY

if TYPE_CHECKING:
    from rodfem.continuation.branch_solver import BranchSolver

STEADY = 3.0
"""Uncertainty of a result, in units of its change by one more step of Newton's method."""
STRAYED, LEAST = 0.3, 1e-9
"""Distance of a state from where it is expected, over that from the nearer end, at which it is another branch's; of a
singular state over the piece.  The second one, in the metric, is round-off."""
DIFFERENCE, GENERIC = 1e-5, 1e-2
"""Steps of differences along an arc or a tangent, and in a generic direction, in natural sizes."""


def corrected(solver: BranchSolver, start: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """Equilibrium on the plane through ``start`` across a ``row``; raises :class:`ConvergenceError`."""
    system, given = solver.system, solver.system.damping
    # next to a state that may move freely, where Newton's method slides away: with damping
    for damping in dict.fromkeys((given, given or solver.inertia.tolerance)):
        x = start.copy()
        with system.damped(damping):
            if correct(system, x, row).converged:
                return x
    raise ConvergenceError(
        f"No equilibrium near load {system.scalar(start):.8g} while locating a special point: {SMALLER_STEPS}."
    )


class Arc:
    """The branch of a ``solver`` from a point ``a`` to another one, ``b``, both on its mesh; places are arclengths."""

    def __init__(self, solver: BranchSolver, a: Point, b: Point) -> None:
        self.solver, self.a, self.b = solver, a, b

    def curve(self, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and direction of the polynomial."""
        return interpolant(self.a, self.b, s)

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


def _number(s: float, value: float, slope: float) -> Node:
    """Node of a number."""
    return Node(s, np.array([[value]]), np.array([[slope]]), 0)


def stepped(solver: BranchSolver, x: PETSc.Vec, row: PETSc.Vec) -> PETSc.Vec:
    """The equilibrium ``x`` after more steps of Newton's method, on the plane across ``row`` and without damping.

    A state that slides away along a family makes one step with it.
    """
    system, settled = solver.system, x.copy()
    with system.damped(0.0):
        if correct(system, settled, row, reach=1e-2).converged:
            return settled
    system.set_phase(x)
    step = linear_step(system, x, row, system.damping or solver.inertia.tolerance)
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

    def __init__(self, solver: BranchSolver, a: Point | End, b: Point | End) -> None:
        self.solver, self.begin = solver, a.arclength
        self.chord = b.x - a.x
        self.length = self.solver.system.norm(self.chord)
        self.chord.scale(1.0 / self.length)
        self.row, self.origin = self.solver.row(self.chord), a.x

    @abstractmethod
    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, known: Any = None) -> Node:
        """Node at a state with its unit tangent; what it is made of may be ``known``."""

    def place(self, x: PETSc.Vec) -> float:
        """Where a state is."""
        return float(self.row.dot(x - self.origin))

    def curve(self, p: Node, q: Node, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
        """State and derivative at a place between two nodes."""
        return cubic([p.kept.x, p.kept.slope, q.kept.x, q.kept.slope], q.s - p.s, s - p.s)

    def solve(self, p: Node, q: Node, s: float) -> Node | None:
        """Node at a place between two others; None where there is no equilibrium near where it is expected."""
        solver, (guess, slope), broken = self.solver, self.curve(p, q, s), self.solver.system.active_drifts
        try:
            x = corrected(solver, guess, self.row)
        except ConvergenceError:
            return None
        if solver.system.distance(x, guess) > STRAYED * min(s - p.s, q.s - s) + LEAST:
            return None
        if broken(x) > max(broken(p.kept.x), broken(q.kept.x)):  # it is on a branch of less symmetry
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
    def omissions(self) -> int:
        """Number of amplitudes that were left out."""
        return self.moving.shape[0] - self.moving.shape[1]

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, known: ReducedStiffness | None = None) -> Node:
        """Node at a state with its unit tangent; its reduced stiffness may be ``known``."""
        reduced = known or self.condensation.at(x, tangent, self.phi)
        speed, Q = float(self.row.dot(tangent)), self.moving
        knot = Knot(x, tangent * (1.0 / speed), speed, reduced)
        return Node(self.place(x), Q.T @ reduced.H @ Q, Q.T @ reduced.rate @ Q / speed, reduced.far, knot)

    def whole(self, node: Node) -> Node:
        """The same with all amplitudes."""
        found = node.kept.reduced
        return replace(node, H=found.H, slope=found.rate / node.kept.speed)

    def turn(self, p: Node, q: Node) -> float | None:
        """Where the load turns back between two nodes; None where it does not."""
        load = self.solver.system.scalar
        a, b = (_number(node.s, load(node.kept.x), load(node.kept.slope)) for node in (p, q))
        if a.slope.item() * b.slope.item() >= 0:
            return None
        return next((p.s + t * (q.s - p.s) for t in places(a, b, 1)), None)


@dataclass(eq=False)
class End:
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


class SoughtPiece(Chord):
    """A piece of a branch along which zeros of an ``event`` are sought."""

    kind: Kind

    def __init__(self, solver: BranchSolver, event: Any, a: End, b: End) -> None:
        super().__init__(solver, a, b)
        self.event = event
        self.first, self.last = (self.node(end.x, end.tangent, end.samples) for end in (a, b))

    @abstractmethod
    def zeros(self) -> list[Node]:
        """Nodes at which it happens, in order; raises :class:`ConvergenceError` where an equilibrium is not found."""

    def uncertainty(self, node: Node) -> float:
        """How far the place of a node is uncertain: the last of the halves of a piece."""
        return LEAST

    def turns(self) -> list[Node]:
        """Nodes at which it nearly happens."""
        return []

    def is_zero(self, node: Node) -> bool:
        """Whether it happens at a node, whatever is next to it."""
        return False

    def _solved(self, p: Node, q: Node, t: float) -> Node:
        """Node at a part of the way between two others, solved for from the curve of the whole piece."""
        node = self.solve(self.first, self.last, p.s + t * (q.s - p.s))
        if node is None:
            raise ConvergenceError(f"no equilibrium is found where the event {self.event.name!r} happens")
        return node


class EventPiece(SoughtPiece):
    """A piece of a branch with the number of an event along it.

    It is zero to round-off up to the ``level``: :data:`~rodfem.tolerances.ROUND_OFF` times the rate at which it varies
    with the state in a generic direction, as along the branch it need not vary.
    """

    kind = EVENT

    def __init__(self, solver: BranchSolver, event: Event, a: End, b: End) -> None:
        super().__init__(solver, event, a, b)
        varied = (abs(self._change(p, x.samples[-1])) for p, x in ((self.first, a), (self.last, b)))
        self.level = ROUND_OFF / GENERIC * max(varied)

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, known: list[dict[str, Any]] | None = None) -> Node:
        """Node at a state with its unit tangent; what the number receives there may be ``known``."""
        here, ahead, behind, *_ = known or end(self.solver, 0.0, x, tangent).samples
        speed = float(self.row.dot(tangent))
        node = _number(self.place(x), self.event(here), 0.0)
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


class LevelPiece(SoughtPiece):
    """A piece of a branch with the number of eigenvalues below a level along it, which changes where one equals it.

    Eigenvalues are sorted, and cross: counts in halves of the piece need none by itself.  ``far`` of a node is a count.
    """

    kind = LEVEL

    def node(self, x: PETSc.Vec, tangent: PETSc.Vec, known: Any = None) -> Node:
        """Node at a state with its unit tangent."""
        speed, zeros = float(self.row.dot(tangent)), self.solver.system.active_drifts(x) * (self.event.value > 0)
        below = zeros + self.solver.spectrum.at(x).eigenvalue_count(self.event.value / self.solver.units.omega2)
        return Node(self.place(x), np.zeros((0, 0)), np.zeros((0, 0)), below, Knot(x, tangent * (1.0 / speed), speed))

    def zeros(self) -> list[Node]:
        """Nodes at which the number changes; raises :class:`ConvergenceError` where an equilibrium is not found."""
        return self._changes(self.first, self.last)

    def _changes(self, p: Node, q: Node) -> list[Node]:
        if p.far == q.far or q.s - p.s <= LEAST:
            return [q] * (p.far != q.far)
        middle = self._solved(p, q, 0.5)
        return self._changes(p, middle) + self._changes(middle, q)


def piece_with(event: Event | Level, solver: BranchSolver, a: End, b: End) -> SoughtPiece:
    """Piece with what is sought along it."""
    kind: type[SoughtPiece] = EventPiece if isinstance(event, Event) else LevelPiece
    return kind(solver, event, a, b)


def nearest_event(solver: BranchSolver, event: Event | Level, x: PETSc.Vec, tangent: PETSc.Vec) -> tuple[Node, float]:
    """Node at which an ``event`` happens nearest to a state ``x``, and how far its place is uncertain.

    A number that touches zero on another mesh may not reach it on that of the ``solver``: then it is where it turns.
    Raises :class:`ConvergenceError` where the event does not happen there.
    """
    row, both = solver.row(tangent), list[End]()
    for s in (-0.02, 0.02):  # in the metric
        there = corrected(solver, x + tangent * s, row)
        both.append(end(solver, s, there, solver.tangent(row, at=there)))
    piece = piece_with(event, solver, *both)
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

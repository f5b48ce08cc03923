"""Search for the special points of one branch between its rows, as they are computed.

At a gap an imperfection has taken a branch point apart: two branches, that would cross without it, bend away from each
other.  The state and the load at which they would cross are known from :mod:`rodfem.continuation.singular`.  Steps in
proportion to the distance from there follow the bend of either branch, however sharp it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import chain
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.arc import Piece
from rodfem.continuation.branch import Branch, Point, SpecialPoint
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.crossings import Node, Zeros, clear, fourth, off
from rodfem.continuation.kinds import IMPERFECT
from rodfem.continuation.observer import Observer, Remark
from rodfem.continuation.singular import SingularState, SingularSystem
from rodfem.continuation.singular_points import (
    Candidate,
    is_fold,
    of_crossing,
    of_miss,
    of_turn,
    solved,
    special_point,
)
from rodfem.errors import SMALLER_STEPS
from rodfem.fem.newton import correct
from rodfem.linalg.orthogonal import orthonormalize
from rodfem.stability.dependence import taut_where_it_turns
from rodfem.stability.reduced_stiffness import ROTATED, Condensation, ReducedStiffness

if TYPE_CHECKING:
    from rodfem.adaptivity.mesh_sequence import Meshes

DIP = 0.1  # eigenvalue, over the lowest bending one, that an imperfect branch point leaves of a zero, at most
RISE = 1e-3  # part of an eigenvalue by which rows on both sides exceed a least one
HALVINGS = 0, 6, 36
"""Bisections after which a mode that passes zero is among those nearest zero: none in most steps, many next to dozens
of softer ones."""
ASIDE = 0.02  # distance of a regular state from a singular one in a piece, over the piece


LEAST = 1e-6  # least bound of a step next to a gap
ARM = 0.05  # distance, in the metric, at which the four arms that would meet are looked for, at least


class Unresolved(Exception):
    """A piece of a branch is to be looked at again, with shorter steps."""


class Gap(NamedTuple):
    """A gap: the ``point`` at which its branches would cross, and the ``unfolded`` state there."""

    point: Point
    unfolded: SingularState
    apart: float  # distance, in the metric, of the state from which the gap was seen


class SpecialSearch:
    """Special points between the rows of one branch, and bounds of its steps; ``gaps`` are those of the run so far."""

    def __init__(self, meshes: Meshes, observer: Observer) -> None:
        self.meshes, self.gaps, self.observer = meshes, list[Gap](), observer
        self.undecided = 0
        self._before: Point | None = None
        self._nearest = -inf
        self._short = 0.0, -inf  # largest step, up to an arclength
        self._condensation = cache(lambda mesh: Condensation(meshes.solvers[mesh].inertia))
        self._phi: np.ndarray | None = None
        self._made = -1, 0  # mesh of the border, and number of phase conditions there
        self._known: dict[int, tuple[Point, ReducedStiffness]] = {}
        self._lost: list[tuple[Point, Point]] = []

    def begin(self, first: Point, short: float = 0.0, until: float = -inf) -> None:
        """Begin a branch at its last row so far, with steps of at most ``short`` up to the arclength ``until``."""
        self._short = short, until
        self.undecided, self._nearest, self._before = first.zero, -inf, None
        self._known.clear()

    def reach(self, point: Point) -> float:
        """Largest step from a point: short ones near gaps, and at first."""
        short, until = self._short
        largest = max(self._from_gap(point, self.meshes.solvers[point.mesh]) / 4, LEAST)
        return min(largest, short) if point.arclength < until else largest

    def _from_gap(self, point: Point, solver: BranchSolver) -> float:
        """Distance of a point from the nearest gap."""
        known = (solver.interpolated(gap.point).x for gap in self.gaps)
        return min((solver.system.distance(point.x, x) for x in known), default=inf)

    def advance(self, a: Point, b: Point) -> list[SpecialPoint]:
        """Special points from a row to the next one, in order."""
        a = self.meshes.solvers[b.mesh].interpolated(a)
        found = self._search(a, b)
        self._before = a
        return found

    def beyond(self, a: Point, b: Point) -> list[SpecialPoint]:
        """Special points between a row and a point past the end of its branch; none where steps are too long."""
        try:
            return self.advance(a, b)
        except Unresolved:
            return []

    def _reduced(self, row: Point) -> ReducedStiffness:
        if id(row) not in self._known:
            assert self._phi is not None and row.tangent is not None
            self._known[id(row)] = row, self._condensation(row.mesh).at(row.x, row.tangent, self._phi)
            if len(self._known) > 6:  # two are those of a piece, one is before it
                del self._known[next(iter(self._known))]
        return self._known[id(row)][1]

    def _nodes(self, a: Point, b: Point) -> tuple[Piece, Node, Node]:
        """The piece from ``a`` to ``b`` with its ends, and a border with all modes that pass zero between them.

        Where the last one has become that of others, a step of inverse iteration improves it, which ``W`` is.  Where
        that does not serve, or it lacks one, it is made anew of the modes nearest zero: those of ``b``, else those
        where the index changes.
        """
        piece, p, q = self._ends(a, b, self._prepare(a))
        worst = max((p.kept.reduced, q.kept.reduced), key=lambda found: found.rotated)
        if worst.rotated >= ROTATED:
            piece, p, q = self._ends(a, b, self._border(self._condensation(b.mesh).improved(worst)))
        for halvings in HALVINGS:
            if p.far == q.far and max(n.kept.reduced.rotated for n in (p, q)) < ROTATED:
                break
            self._nearest = -inf
            x = self._changing(piece, p, q, halvings)
            piece, p, q = self._ends(a, b, self._border(self._condensation(b.mesh).border(x)))
        first, zeros = p.kept.reduced, min(n.kept.reduced.zero for n in (p, q))
        if zeros:
            values, vectors = np.linalg.eigh(first.H)
            piece.leave_out(vectors[:, np.argsort(abs(values))[:zeros]])
            p, q = (piece.node(n.kept.x, n.kept.slope * n.kept.speed, n.kept.reduced) for n in (p, q))
        return piece, p, q

    def _prepare(self, row: Point) -> np.ndarray:
        """The border, on the mesh of a row, made there unless there is one of as many phase conditions.

        A state of more symmetry has modes that one turns into each other, of which a phase condition here is one.
        """
        system = self.meshes.solvers[row.mesh].system
        system.set_phase(row.x)
        made = row.mesh, system.phase.count
        if self._made != made or self._phi is None:
            self._made, self._nearest = made, -inf
            self._border(self._condensation(row.mesh).border(row.x))
        assert self._phi is not None
        return self._phi

    def _border(self, phi: np.ndarray) -> np.ndarray:
        """Take another border."""
        self._known.clear()
        self._phi = phi
        return phi

    def _ends(self, a: Point, b: Point, phi: np.ndarray) -> tuple[Piece, Node, Node]:
        piece = Piece(self.meshes.solvers[b.mesh], self._condensation(b.mesh), a, b, phi)
        assert a.tangent is not None and b.tangent is not None
        ahead = self._reduced(b)  # first, as the matrix may hold that state
        return piece, piece.node(a.x, a.tangent, self._reduced(a)), piece.node(b.x, b.tangent, ahead)

    def _changing(self, piece: Piece, p: Node, q: Node, halvings: int) -> PETSc.Vec:
        """A state near which the index changes between two nodes."""
        for _ in range(halvings):
            middle = piece.solve(p, q, (p.s + q.s) / 2)
            if middle is None:
                break
            p, q = (middle, q) if middle.index == p.index else (p, middle)
        return q.kept.x

    def _search(self, a: Point, b: Point) -> list[SpecialPoint]:
        """Special points between two rows."""
        piece, p, q = self._nodes(a, b)
        self.undecided = piece.omissions + piece.solver.system.active_drifts(b.x)
        p = p if p.kept.reduced.zero <= piece.omissions else piece.solve(p, q, p.s + ASIDE * (q.s - p.s)) or p
        out, pieces = self._turning(piece, p, q)
        zeros, size = Zeros(piece.solve, piece.solver.inertia.tolerance), self._fourth(piece, p, q)
        for crossing in chain.from_iterable(zeros.crossings(*ends, size) for ends in pieces):
            turns = piece.turn(*crossing.piece) is not None
            special = self._located(piece, of_crossing(piece, crossing), turns=turns)
            if special is not None:
                out.append(special)
            else:
                self._lost.append((a, b))
        for node in zeros.misses:
            self._missed(piece, of_miss(piece, node), resolved=False)
        self._dip(piece, p, q, found=bool(out))
        return sorted(out, key=lambda special: special.point.arclength)

    def unlocated(self, branch: Branch) -> Iterator[Remark]:
        """Yield a sentence on each step with a crossing that was not located, on no mesh of the ``branch``."""
        loads, lost, self._lost = [s.point.load for s in branch.special if s.kind.singular], self._lost, []
        for a, b in lost:
            if not any((x - a.load) * (x - b.load) <= 0 for x in loads):
                words = f"A special point between loads {a.load:.8g} and {b.load:.8g} was not located; {SMALLER_STEPS}."
                yield Remark(words, a.load, b.load)

    def _dip(self, piece: Piece, p: Node, q: Node, *, found: bool) -> None:
        """Look for a branch point taken apart where the eigenvalue nearest zero is least at a row."""
        nearest, ahead = (float(abs(np.linalg.eigvalsh(node.H)).min()) for node in (p, q))
        least = (1 - RISE) * min(self._nearest, ahead)
        if not found and nearest < least and nearest < DIP * piece.solver.inertia.scale:
            self._missed(piece, of_miss(piece, p))
        self._nearest = -inf if found else nearest

    def _turning(self, piece: Piece, p: Node, q: Node) -> tuple[list[SpecialPoint], list[tuple[Node, Node]]]:
        """The branch point at which the load turns back, if there is one, and the pieces on both sides of it."""
        turn = piece.turn(p, q)
        folded = turn is not None and _turns_in_fold(piece, p, q, of_turn(piece, p, q, turn))
        found = None if turn is None or folded else self._touch_point(piece, (p, q), turn)
        if found is None:
            return [], [(p, q)]
        (touch, *made), pieces = found, list[tuple[Node, Node]]()
        s = piece.place(touch.point.x)
        for end, node in zip((p, q), made, strict=True):
            low, high = sorted((s, end.s))
            inside = node if low < node.s < high else piece.solve(p, q, (low + high) / 2) if low < high else None
            if inside is not None:
                pieces.append((end, inside) if end is p else (inside, end))
        return [touch], pieces

    def _fourth(self, piece: Piece, p: Node, q: Node) -> np.ndarray:
        """Size of the fourth derivative in a piece, by the row before it."""
        row, size = self._before, fourth(p, q, None)
        if row is None or row.mesh != self._made[0] or row.tangent is None:
            return size
        if id(row) not in self._known and clear(p, q, off(p, q, size)):  # of another border
            return size
        before = piece.node(row.x, row.tangent, self._reduced(row))
        return fourth(p, q, before if before.s < p.s else None)

    def _touch_point(self, piece: Piece, ends: tuple[Node, Node], s: float) -> tuple[SpecialPoint, Node, Node] | None:
        """Branch point at which the load turns back, where a side branch ends, and states next to it.

        An eigenvalue touches zero there.
        """
        (p, q), solver = ends, piece.solver
        margin = ASIDE * (q.s - p.s)
        sides = max(s - margin, (p.s + s) / 2), min(s + margin, (s + q.s) / 2)
        left, right = (piece.solve(p, q, at) for at in sides)
        if left is None or right is None or (turn := piece.turn(left, right)) is None:
            return None
        at = of_turn(piece, left, right, turn)
        if why := taut_where_it_turns(solver.shape, at.x):
            self.observer.warn(Remark(why, solver.system.scalar(at.x)))
            return None
        found = None if _turns_in_fold(piece, left, right, at) else solved(solver, at, fold=False)
        if found is None or found.size > found.noise:
            return None
        return replace(special_point(piece, at, found, fold=False), test_function="slope"), left, right

    def _located(self, piece: Piece, at: Candidate, *, turns: bool) -> SpecialPoint | None:
        """The fold or branch point of a crossing; None where there is no singular state."""
        clearly = is_fold(piece.solver, at.x, at.null)
        tried = dict[bool, SingularState | None]()
        for fold in {True: (turns, not turns), False: (False,)}[clearly]:
            found = tried[fold] = solved(piece.solver, at, fold=fold)
            if found is not None and (fold or found.size <= found.noise):
                return self._found(piece, at, found, fold=fold)
        branch = tried[False]
        special = None if branch is None else self._imperfect(piece, at, branch)
        if not clearly and (turns or special is None) and (found := solved(piece.solver, at, fold=True)) is not None:
            return self._found(piece, at, found, fold=True)
        return special

    def _found(self, piece: Piece, at: Candidate, found: SingularState, *, fold: bool) -> SpecialPoint:
        """The special point at a singular state; of a fold the branch on its other side is looked for."""
        if fold:
            self._missed(piece, at, fold=found)
        return special_point(piece, at, found, fold=fold)

    def _imperfect(self, piece: Piece, at: Candidate, found: SingularState) -> SpecialPoint:
        """The branch point at a state whose unfolding parameters are not round-off."""
        gap = self._open_gap(piece, at, found, resolved=False)
        special = special_point(piece, at, found, fold=False)
        if gap is not None:
            special.kind, special.note = IMPERFECT, f"imperfect, unfolding {found.size:.0e}"
        return special

    def _open_gap(self, piece: Piece, at: Candidate, found: SingularState, *, resolved: bool) -> Gap | None:
        """The gap at a singular state whose unfolding parameters are not round-off.

        Steps about a new one are shorter, unless they have ``resolved`` it.

        None where the mesh makes them, which need not have a symmetry of the scene: those of a richer one are smaller.
        """
        special, richer = special_point(piece, at, found, fold=False), self.meshes.richer(piece.solver.mesh)
        modes = [richer.transfer(v, state=False) for v in special.null_vectors]
        orthonormalize(modes, richer.system.metric)
        again = SingularSystem(richer.solver, modes, len(modes), fold=False).solve(richer.transfer(found.x, state=True))
        if again is not None and again.size < 0.5 * found.size + again.noise:  # lowered by half: the mesh's own
            return None
        point = replace(special.point, x=found.x, load=found.load)
        gap = Gap(point, found, piece.solver.system.distance(at.x, found.x))
        new = self._from_gap(gap.point, piece.solver) >= LEAST  # else smaller steps have not resolved it
        self.gaps += [gap] * new
        if new and not resolved:
            raise Unresolved
        return gap

    def _missed(self, piece: Piece, at: Candidate, *, resolved: bool = True, fold: SingularState | None = None) -> None:
        """Look for the branch on the other side where an eigenvalue comes near zero and turns back, or at a ``fold``.

        A fold may be a branch point with an imperfection.  Of a pitchfork ``lam x - x^3 + eps`` its load is off by
        ``1.9 eps^(2/3)``, times the rate of the eigenvalue in the load, and the least eigenvalue on the other side is
        ``2.4 eps^(2/3)``.
        """
        solver = piece.solver
        found = SingularSystem(solver, at.modes, at.count, fold=False).solve(at.x)
        if found is None or found.size <= found.noise:
            return
        if fold is not None and abs(found.rate * (found.load - fold.load)) >= DIP * solver.inertia.scale:
            return
        self._open_gap(piece, at, found, resolved=resolved)


def _turns_in_fold(piece: Piece, p: Node, q: Node, at: Candidate) -> bool:
    """Whether the load clearly turns back in a fold between two nodes."""
    return p.index != q.index and is_fold(piece.solver, at.x, at.null)


def arms(solver: BranchSolver, gap: Gap) -> list[Point]:
    """Equilibria on the branches that would cross at a gap, a little away from it: up to four."""
    system, arm, out = solver.system, max(ARM, gap.apart), []
    for direction in gap.unfolded.directions:
        row = solver.row(direction)
        for sign in (1.0, -1.0):
            x = gap.unfolded.x + direction * (sign * arm)
            outcome = correct(system, x, row, reach=arm)
            if outcome.converged:
                out.append(solver.point(x, 0.0, solver.tangent(row, at=x), outcome))
    return out

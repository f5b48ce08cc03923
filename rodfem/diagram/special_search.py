"""Search for the special points of one branch between its rows, as they are computed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import inf

from petsc4py import PETSc

from rodfem.adaptivity.gaps import Gap, Gaps
from rodfem.adaptivity.mesh_sequence import Meshes
from rodfem.continuation.branch import Point, SpecialPoint
from rodfem.continuation.determinants import Crossing
from rodfem.continuation.index_chain import Row, chained
from rodfem.continuation.kinds import BRANCH_POINT, FOLD, IMPERFECT
from rodfem.continuation.observer import Observer
from rodfem.continuation.opposite_crossings import opposite_crossing
from rodfem.continuation.pair_search import arclength, zeros
from rodfem.continuation.special_points import COUPLED, Taut, find_special, same_point
from rodfem.continuation.states_between import midpoint
from rodfem.continuation.touching import Touching, beside_zero
from rodfem.diagram.shorter_steps import PARTS, ShorterSteps, Unresolved
from rodfem.diagram.step_check import StepCheck
from rodfem.errors import SMALLER_STEPS, ConvergenceError
from rodfem.stability.round_off import clear_of_zero, resolve

HALVINGS = 4
"""How many times a piece of a branch is halved until its special points explain the indices of its ends."""
ROUNDS = 4
"""How many times pairs are looked for beside the special points of one step that are known."""
ALIKE = 1e-3
"""Distance of two special points, relative to their step, below which a mesh may have parted one."""
PATIENCE = 4
"""Rows with an eigenvalue near zero after which it is asked whether it stays zero."""


def crossings(found: Sequence[SpecialPoint]) -> list[Crossing]:
    """Those of some special points at which the index changes."""
    known = [Crossing.at(special) for special in found]
    return [crossing for crossing in known if crossing.changes]


class SpecialSearch:
    """Special points between the rows of one branch, and bounds of its steps where they are hard to tell apart.

    Attributes
    ----------
    level
        Number of eigenvalues that are zero at both ends of the piece looked at: those stay zero along the branch, or
        beside zero, with the sign that they have.
    undecided
        Number of those of which not even the sign is known.
    """

    def __init__(self, meshes: Meshes, gaps: Gaps, observer: Observer) -> None:
        """Nothing is known about a branch before :meth:`begin`."""
        self.meshes, self.gaps, self.observer = meshes, gaps, observer
        self.solver = meshes.solvers[0]
        self.level = self.undecided = 0
        self._open: list[Point] = []
        self._touching, self._check = Touching(), StepCheck(observer)
        self._steps = ShorterSteps()
        self._lost: tuple[Row, Row] | None = None
        self._early: Point | None = None

    def begin(self, first: Point, short: float = 0.0, until: float = -inf) -> None:
        """Begin a branch at its last row so far, with steps of at most ``short`` up to the arclength ``until``."""
        self._steps = ShorterSteps(short or inf, until)
        self.level = self.undecided = first.zero
        self._touching = Touching()

    def resume(self, history: Sequence[Point]) -> None:
        """Go on from the last row of a branch, up to which everything has been found."""
        self._open = [history[-1]]
        self._touching.restart(history)

    def after(self, a: Point, b: Point, rows: Sequence[Point] = ()) -> list[SpecialPoint]:
        """Special points that the row ``b`` after ``a`` shows, in order of arclength.

        An eigenvalue within the tolerance of zero has no sign yet: rows with one wait until it has.  One that stays
        zero to working accuracy belongs to a family of equilibria at one load, and is not waited for.  One that stays
        within the tolerance, and is not zero, has the sign of its Rayleigh quotient.  The ``rows`` are
        those that the step to ``b`` was predicted from.

        Raises
        ------
        Gap
            For one that an imperfection takes apart, unless it is known.
        Unresolved
            If shorter steps are to be tried.
        """
        self._on(b)
        settled, self._early = self._open[0], None
        try:
            found = self._shown_by(a, b)
            self._check(self.solver, [*rows, b], self._steps)
        except (Gap, Unresolved):
            self._open = [self._early or settled]
            raise
        return found

    def _shown_by(self, a: Point, b: Point) -> list[SpecialPoint]:
        """Special points that the row ``b`` shows; raises as :meth:`after`."""
        rows = [self._here(p) for p in self._open]
        stay = min(rows[0].zero, b.zero)
        before, clear = self._clear(rows[0], stay), self._clear(b, stay)
        self.undecided = stay - max(before, clear)
        if before == clear and self._below(rows[0]) == self._below(b):
            before = clear = 0  # it keeps its sign, beside zero
        # one that differs from zero at either end does not stay: it crosses slowly, within the tolerance
        slow = max(before, clear)
        self.level = stay - slow
        settled = 0 < slow == clear  # nothing is to be waited for
        if b.zero > self.level and not settled:  # the rows that follow settle the sign of one within the tolerance
            self._open.append(b)
            if len(self._open) <= PATIENCE or self.row(b).decided:
                return []
        changed = len(rows) > 1 or a.negative != b.negative or a.slope * b.slope < 0
        changed |= settled and self.row(a).low != self.row(b).low
        self._open = [b]
        return self._examined(self._in_step([*rows, b], changed))

    def _in_step(self, rows: list[Point], changed: bool) -> list[SpecialPoint]:
        """Special points between the first and the last of some ``rows``, whose index has ``changed`` or not.

        Those that the index shows come first, and then pairs beside them, which it does not.
        """
        a, b, inserted = rows[0], rows[-1], False
        found = self._among(rows) if changed else []
        for _ in range(ROUNDS):
            known = crossings(found)
            # an eigenvalue that touches zero, as where a side branch ends, leaves the determinant as a pair would
            blind = (changed or inserted) and not 0 < len(found) == len(known)
            new = [] if blind else self._touching.between(self.solver, a, b, known)
            if new and new[0].arclength < a.arclength:  # the step before is the one that may be too long
                self._early = self._touching.clear(new[0], self.level)
                if self._touching.knows(new[0], a):  # points of it are in the branch already
                    self._steps.ask(new[0], a)
                    self.observer.warn(
                        f"Between loads {new[0].load:.8g} and {a.load:.8g} there are more special points than were "
                        f"found; {SMALLER_STEPS}."
                    )
                    new = []
            if not new:
                break
            if known:  # so many in one step show better in shorter ones
                self._steps.ask(min(a, new[0], key=arclength), b)
            rows = sorted({id(row): row for row in (*rows, *new)}.values(), key=arclength)
            found, inserted = self._among(rows), True
        if not changed and not inserted:
            found = self._among(rows)
        self._shorten_about(a, b, found)
        self._touching.add(b, crossings(found), blind=blind)
        return found

    def _shorten_about(self, a: Point, b: Point, found: Sequence[SpecialPoint]) -> None:
        """Raise :class:`Unresolved` where two special points are nearer to each other than the rows ``a`` and ``b``.

        Those ``found`` last are between these; two opposite crossings at one load are such.  Others beside the two
        would leave no trace in rows so far apart: from the row before ``a`` steps are shortened, once.
        """
        first = self._touching.before(a)
        near = [crossing.arclength for crossing in self._touching.known if crossing.arclength > first.arclength]
        places = sorted([*near, *(special.point.arclength for special in found)])
        step = b.arclength - a.arclength
        # a branch that ends, and turns back, has one side: there the index is the same, too
        crossing = [special for special in found if special.test_function == "mu"]
        opposite = any(special.negative_before == special.negative_after for special in crossing)
        if opposite or (found and any(ALIKE * step < q - p < step for p, q in pairwise(places))):
            early, self._early = self._early, self._touching.clear(first, self.level)
            self._steps.ask(first, b, 2 * PARTS, once=True)
            self._early = early

    @property
    def settled(self) -> float:
        """Arclength of the row up to which everything has been found: those after it wait for the sign of a zero."""
        return self._open[0].arclength

    def rest(self) -> list[SpecialPoint]:
        """Special points among the last rows of a branch that only its end shows.

        They are those of rows with an eigenvalue near zero, and pairs beside the last row.  The branch has ended:
        nothing is tried with shorter steps.
        """
        self._on(self._open[-1])
        rows = self._open if len(self._open) > 1 else self._touching.ending(self.solver)
        if not rows:
            return []
        return self._examined(self._among([self._here(p) for p in rows], ended=True), ended=True)

    def beyond(self, a: Point, b: Point) -> list[SpecialPoint]:
        """Special points between a row and a point past the end of its branch, as they are found on one piece."""
        self._on(b)
        self.level = min(a.zero, b.zero)
        return find_special(self.solver, a, b, self.row(a).crossing(self.row(b)), self._persistent(a.x))

    def reach(self, point: Point) -> float:
        """Largest step from a point: near gaps, and where the indices are not explained, short ones."""
        return min(self.gaps.reach(self.meshes.solvers[point.mesh], point), self._steps.reach(point))

    def row(self, point: Point) -> Row:
        """Index of a point, small eigenvalues by their Rayleigh quotients."""
        if point.zero <= self.level:
            return Row(point, point.negative, point.negative)
        return Row(point, *resolve(self.solver.inertia.at(point.x)))

    def _clear(self, point: Point, stay: int) -> int:
        """Number of eigenvalues of a point, of ``stay`` within the tolerance of a count, that are not zero."""
        if stay <= self.solver.system.active_drifts(point.x):
            return 0
        return min(clear_of_zero(self.solver.inertia.at(point.x)), stay)

    def _below(self, point: Point) -> int:
        """Number of eigenvalues of a point within the tolerance of a count that are negative."""
        low, _ = resolve(self.solver.inertia.at(point.x))
        return low - point.negative

    def _on(self, point: Point) -> None:
        self.solver = self.meshes.solvers[point.mesh]

    def _here(self, point: Point) -> Point:
        return self.meshes.here(point, self.solver)

    def _persistent(self, x: PETSc.Vec) -> int:
        """Number of eigenvalues that stay zero without a symmetry, at a state on the way."""
        return max(self.level - self.solver.system.active_drifts(x), 0)

    def _among(self, points: Sequence[Point], ended: bool = False) -> list[SpecialPoint]:
        """Special points among rows: inner ones have an eigenvalue near zero, or another index than their neighbours.

        Raises :class:`Unresolved` where they do not explain the indices, and shorter steps have not been tried, unless
        the branch has ``ended``.
        """
        rows, found = [self.row(p) for p in points], []
        why: list[str] = []
        # invariant: from one decided row to the next the special points in between explain the change of the index
        sure = [rows[0], *(row for row in rows[1:-1] if row.decided), rows[-1]]
        for p, q in pairwise(sure):
            self._lost = None
            specials = self._between(p, q, why)
            found += specials
            if not ended and not chained(p.low, p.high, specials, q.low, q.high):
                self._jumped(p, q)
                self._steps.ask(points[0], points[-1])
        for i, special in enumerate(found):
            if same_point(self.solver, special, found[:i]) is not None:
                load = special.point.load
                why.append(f"Near load {load:.8g} one special point was found twice, and another may be missing.")
        near = [p for p in points if p.zero > self.level]
        if len(near) == 1 and not found and len(points) <= 3:  # a pair may begin or end there
            other = beside_zero(self.solver, points, near[0])
            if other:
                return self._among(sorted([*points, *other], key=arclength), ended)
        inner = [p for p in near if p is not points[0]]
        if inner and not found and points[-1].zero <= self.level:
            found = self._opposite(points, inner, rows[0].low)
        if inner and not found and points[-1].zero <= self.level:
            why.append(
                f"Near load {inner[0].load:.8g} an eigenvalue is nearly zero, and "
                f"the index is {rows[0].low} on either side: whether it passes zero and comes back is not known."
            )
        for trouble in why:
            self.observer.warn(trouble)
        return found

    def _opposite(self, points: Sequence[Point], near: Sequence[Point], index: int) -> list[SpecialPoint]:
        """Branch point beside one of the ``near`` ones among points, that leaves the ``index`` as it is; or none."""
        state = max(near, key=zeros)
        clear = [p for p in points if p.zero <= self.level]
        before = [p for p in clear if p.arclength < state.arclength]
        after = [p for p in clear if p.arclength > state.arclength]
        if not before or not after:
            return []
        special = opposite_crossing(self.solver, [before[-1], state, after[0]], index, self._persistent(state.x))
        return [special] if special is not None else []

    def _jumped(self, p: Row, q: Row) -> None:
        """Raise :class:`Gap` if the step from ``p`` to ``q``, which is not explained, has jumped one.

        No special point can be located on a piece that begins on one branch and ends on another, but each end of the
        shortest such piece is near the states at which the two would cross, with nearly their null vectors.
        """
        if self._lost is None:
            return
        a, b = self._lost
        if a.low == b.low or self._persistent(a.point.x):
            return
        for row in (a, b):
            vectors = self.solver.inertia.modes_near_zero(row.point.x, abs(b.low - a.low))
            apart = abs(b.point.load - a.point.load)
            special = SpecialPoint(IMPERFECT, row.point, a.low, b.low, apart, vectors)
            gap = self.gaps.examine(self.solver, special)
            step = q.point.arclength - p.point.arclength
            if gap is not None and self.solver.system.distance(gap.point.x, row.point.x) < step:
                if self.gaps.open(gap, self.solver):
                    raise gap
                return

    def _examined(self, specials: list[SpecialPoint], ended: bool = False) -> list[SpecialPoint]:
        """Branch points with the size of their unfolding parameters; raises :class:`Gap` where they are not one.

        One on a branch that has ``ended`` is marked as imperfect instead.

        Steps that jump a gap may meet a change of slope there: a fold whose null vector is nearly orthogonal to the
        load derivative is asked, too, and is one if the equations of a branch point have no solution.
        """
        for special in specials:
            # phi.F_lam is nearly zero: fold or branch point is decided by the unfolding parameters
            unchanged = special.negative_before == special.negative_after
            weak = special.kind == FOLD and (special.coupling <= COUPLED or (unchanged and special.multiplicity == 1))
            if weak or unchanged or special.kind == BRANCH_POINT:
                gap = self.gaps.examine(self.solver, special)
                if gap is not None and not ended and self.gaps.open(gap, self.solver):
                    raise gap
                if weak and gap is None and special.unfolding >= 0:  # nan: no such point near by
                    special.kind = BRANCH_POINT
                if (ended or not weak) and gap is not None:
                    special.kind, special.note = IMPERFECT, str(gap)
        return specials

    def _between(self, p: Row, q: Row, troubles: list[str], halvings: int = HALVINGS) -> list[SpecialPoint]:
        """Folds and branch points between two rows, on halves of the piece where a whole one is not resolved.

        It is where they explain the indices of both rows.  ``troubles`` gets sentences on pieces that are not.
        """
        found, why, turned = [], "", ""
        try:
            found = find_special(self.solver, p.point, q.point, p.crossing(q), self._persistent(p.point.x))
        except Taut as state:
            turned = str(state)
        except ConvergenceError as trouble:
            why = str(trouble)
        if p.decided and q.decided and found and sum(s.multiplicity for s in found) == abs(q.low - p.low):
            # counts beside a zero may lie beyond the next one: those of the rows hold for the first and the last
            found[0].negative_before, found[-1].negative_after = p.low, q.low
        if not why and chained(p.low, p.high, found, q.low, q.high):
            troubles += [turned] if turned else []
            return found
        # bisection: on a shorter piece fewer crossings fall together, until each half explains its own ends
        middle = midpoint(self.solver, p.point, q.point) if halvings else None
        if middle is None:
            self._lost = self._lost or (p, q)
            if why:
                loads = f"{p.point.load:.8g} and {q.point.load:.8g}"
                troubles.append(f"A special point between loads {loads} is missing: {why}")
            return found
        row = self.row(middle)
        first = self._between(p, row, troubles, halvings - 1)
        return first + self._between(row, q, troubles, halvings - 1)

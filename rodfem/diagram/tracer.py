"""Tracing one branch: its points, its special points and loads asked for, where and why it ends, error bars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from itertools import pairwise
from math import isnan

from rodfem.adaptivity.accuracy_control import AccuracyControl
from rodfem.adaptivity.gaps import Gap, Gaps
from rodfem.adaptivity.mesh_sequence import Meshes, TooCoarse
from rodfem.adaptivity.soft_rows import SoftRows
from rodfem.adaptivity.zero_stretch import LOCATED, zero_stretch
from rodfem.continuation.branch import NOT_TRACED, Branch, Point, SpecialPoint
from rodfem.continuation.index_chain import explain, merge_doubles, persistent_zeros
from rodfem.continuation.invariants import Invariants
from rodfem.continuation.kinds import END, USER
from rodfem.continuation.locate import solve_at
from rodfem.continuation.observer import Observer, Recorder
from rodfem.continuation.solvers import VERTICAL, BranchSolver, distance, follow, hermite
from rodfem.continuation.special_points import FIRST
from rodfem.diagram.bookkeeper import Bookkeeper, Recalled
from rodfem.diagram.events import Events
from rodfem.diagram.journal import Journal
from rodfem.diagram.plan import Plan
from rodfem.diagram.special_search import SpecialSearch, Unresolved
from rodfem.errors import ConvergenceError
from rodfem.faults import as_failure, without
from rodfem.problem.units import Units
from rodfem.roots import zero_between
from rodfem.stability.round_off import resolve
from rodfem.tolerances import DRIFT, INSIDE, SAME_SPECIAL, SAME_STATE, unit

BEYOND = 0.02
"""How far past a singular end of the range, relative to half the range, an equilibrium is sought to locate it."""
EXACT, ALONG = 1e-15, 1e-11
"""Arclength, in the metric, to which a load is located before it is set, and to which a stretch vanishes."""
SAME_END = 1e-6
"""A special point nearer to the end of the range than this, in spans, is the last state."""
NO_CONVERGENCE = "no convergence"
"""How the reason begins for which a branch ends that no step leads on from."""
NEAR_START = 8
"""Steps of a branch that begins near another special point are as short as its first for so many times their length."""


class Tracer:
    """Traces branches one by one, each knowing those before it.

    ``branches`` grows as the run goes; ``finished`` is called after each branch that is complete, so that nothing
    is lost.
    """

    def __init__(
        self,
        solver: BranchSolver,
        plan: Plan,
        observer: Observer,
        finished: Callable[[], None],
        journal: Journal | None = None,
    ) -> None:
        """Start with no branch; the plan must have passed its :meth:`Plan.check`.

        ``solver`` has the first mesh, the ``observer`` hears of the progress, ``finished()`` is called after each
        branch.  The ``plan`` has range, depth and steps; the ``journal`` knows the steps of a run that goes on.
        """
        self.solver, self.plan, self.observer, self.finished = solver, plan, observer, finished
        self.scene = solver.system.scene
        self.span = plan.over(self.scene)
        self.low, self.high = sorted(self.span)
        self.branches: list[Branch] = []
        self.meshes = Meshes(solver, plan.accuracy)
        self.gaps = Gaps(self.meshes)
        self.warned = False
        self.specials = SpecialSearch(self.meshes, self.gaps, observer)
        self.events = Events(plan.events)
        self.invariants: dict[int, Invariants] = {}
        self.soft = SoftRows(self.meshes, error_bars=bool(plan.error_bars or plan.accuracy))
        said = observer if isinstance(observer, Recorder) else None
        self.book = Bookkeeper(journal or Journal(), self.meshes, self.gaps, self.branches, plan.events, said)

    @property
    def solvers(self) -> Sequence[BranchSolver]:
        """Solvers by the number of their mesh."""
        return self.meshes.solvers

    def use(self, mesh: int) -> None:
        """Go on with the solver of that mesh."""
        self.solver = self.meshes.solvers[mesh]

    def here(self, point: Point) -> Point:
        """Point on the mesh in use."""
        return self.meshes.here(point, self.solver)

    def trace(self, branch: Branch) -> None:
        """Follow a branch to its end, insert its special points, estimate errors, hand it on as finished."""
        if branch.ended == NOT_TRACED:
            if self._recalled(branch.name):
                return
            self.book.begin()
        self.branches.append(branch)
        if branch.ended == NOT_TRACED:
            self.observer.branch(branch)
        self.use(branch.points[-1].mesh)
        self.control = AccuracyControl(self.meshes, (self.low, self.high))
        self.solver.damp(self._extra(branch.points[-1]) if branch.parent else 0)
        self._attempt(branch)
        self._finish(branch)

    def _attempt(self, branch: Branch) -> None:
        try:
            with as_failure(self.solver.system.comm):
                self._follow(branch)
        except ConvergenceError as trouble:
            branch.ended = f"{NO_CONVERGENCE}: {trouble}"
            self.observer.warn(str(trouble))

    def without(self, what: str) -> AbstractContextManager[None]:
        """Go on where the block fails, and warn of ``what`` did not happen and why."""
        return without(what, self.solver.system.comm, self.observer.warn)

    def trace_whole(self, point: Point, name: str, depth: int) -> None:
        """Follow a branch through a point in both directions, as one.

        Raises :class:`ValueError` for a point without a tangent.
        """
        if point.tangent is None:
            raise ValueError("A point without a tangent is no start of a branch.")
        if self._recalled(name):
            return
        self.book.begin()
        back = Branch(name, None, depth, [reversed_point(point, 0.0)])
        self.use(point.mesh)
        self.observer.branch(back)
        self.control = AccuracyControl(self.meshes, (self.low, self.high))
        self.solver.damp(0)
        self._attempt(back)
        branch = reversed_branch(back)
        branch.ended = back.ended
        if back.ended == "closed loop":
            self.branches.append(back)
            self._finish(back)
            return
        first = branch.points[0]
        branch.special.append(self.solver.given(END, first))
        branch.special[-1].note = f"begins here: {back.ended}"
        branch.renumber()
        self.trace(branch)

    def _follow(self, branch: Branch) -> None:
        """Follow a branch to its end; where its mesh is too coarse, from there on with another."""
        special = {id(s.point) for s in branch.special}
        history, begun = [p for p in branch.points if id(p) not in special], False
        first = history[-1].arclength
        if branch.parent and 0 < first < FIRST / 2:  # it begins near something: see start_branch
            self.specials.begin(history[-1], short=first, until=NEAR_START * first)
        else:
            self.specials.begin(history[-1])
        while True:
            try:
                self.control.row(history[-1], self.solver)
                if not begun:
                    self._first_users(branch)
                    begun = True
                self._advance(branch, history)
                return
            except TooCoarse as trouble:
                history = self._remesh(branch, history, trouble)

    def _remesh(self, branch: Branch, history: list[Point], trouble: TooCoarse) -> list[Point]:
        """Points to go on from, carried to a mesh that resolves what was too coarse; what lies beyond is dropped.

        Rows before the trouble stay what they are on the mesh that was made for them.
        """
        solver = self.control.another(trouble, self.observer)
        if solver is not None:
            solver.damp(self.solver.system.damping > 0)
            with self.solver.system.clock.scope("location"):
                pairs = self.meshes.carry(history, solver, branch.parent is not None)
            moved = {id(old): new for old, new in pairs if old is trouble.point}
            branch.points = [moved.get(id(p), p) for p in branch.points]
            history = [new for _, new in pairs]
            self.solver = solver
            self.observer.mesh(solver.system, trouble.point.load, str(trouble))
        return _cut(branch, history, history[-1].arclength)

    def _advance(self, branch: Branch, history: list[Point]) -> None:
        """Append points until the branch ends, which :attr:`Branch.ended` then says."""
        self.specials.resume(history)
        for item in follow(self.solver, history, self.plan.steps, (self.low, self.high), self.specials.reach):
            if isinstance(item, str):
                branch.ended = self._rest(branch) or item
                if branch.ended.startswith(NO_CONVERGENCE):
                    self.observer.warn(f"{branch.name} ends: {branch.ended}; use more elements or smaller steps.")
                return
            previous = history[-1]
            self._check_symmetry(item)
            self._check_invariants(item)
            self.control.row(item, self.solver)
            self._check_zeros(history, item)
            if item.stretch <= 0:
                self._end_at_zero_stretch(branch, previous, item)
                return
            if self.solver.convexity is not None and self.solver.convexity.lowest(item.x) <= 0:
                why = f"the stored energy is not convex any more at {self.scene.load} = {item.load:.6g}"
                branch.ended = self._rest(branch) or why
                return
            try:
                reason = self._between(branch, previous, item)
            except (Gap, Unresolved):  # the step was too long, or led to another branch: back, to smaller ones
                self._advance(branch, _cut(branch, history, self.specials.settled))
                return
            if reason:
                branch.ended = reason
                return
            history.append(item)
            branch.points.append(item)
            self.observer.progress(branch, item)
            if self._closes(branch, previous, item):
                branch.ended = self._rest(branch) or "closed loop"
                return

    def _between(self, branch: Branch, a: Point, b: Point) -> str:
        """Insert folds, branch points and user points between two points; a reason if the branch ends there."""
        with self.solver.system.clock.scope("location"):
            specials = [] if a is branch.points[0] and branch.parent else self.specials.after(a, b)
            pieces = [a, *(s.point for s in specials if s.point.arclength > a.arclength), b]
            users = [u for p, q in pairwise(pieces) for u in self._users(branch, p, q, a, b)]
            users += self.events.between(self.solver, a, b)
            return self._insert(branch, specials + users)

    def _rest(self, branch: Branch) -> str:
        """Insert the special points that only the end of a branch shows; a reason if the branch ends at one."""
        with self.solver.system.clock.scope("location"):
            return self._insert(branch, self.specials.rest())

    def _insert(self, branch: Branch, specials: list[SpecialPoint]) -> str:
        """Insert special points into a branch, up to one at which it ends: then the reason."""
        for special in specials:
            self._check_invariants(special.point)
            self.control.special(special)
        for special in sorted(specials, key=lambda s: s.point.arclength):
            reason = self._meeting(branch, special) if special.kind.branches else ""
            branch.insert(special)
            self.observer.special(branch, special)
            if reason:  # it ends before a row that was taken for one of it
                branch.points = [p for p in branch.points if p.arclength <= special.point.arclength]
                return reason
        return ""

    def _users(self, branch: Branch, p: Point, q: Point, a: Point, b: Point) -> list[SpecialPoint]:
        """User points between two neighbours among which the load is monotone."""
        found = []
        for load in self.plan.at:
            if (
                (p.load - load) * (q.load - load) < 0
                or (load == p.load and p is branch.points[0])
                or (load == q.load and q is b)
            ):
                s = p.arclength + (load - p.load) / (q.load - p.load) * (q.arclength - p.arclength)
                for _ in range(3):
                    x, direction = hermite(a, b, s)
                    slope = self.solver.system.scalar(direction)
                    if slope:
                        s = min(max(s + (load - self.solver.system.scalar(x)) / slope, p.arclength), q.arclength)
                point = self._user_between(a, b, load, (p, q), s)
                found.append(self.solver.given(USER, point))
        return found

    def _first_users(self, branch: Branch) -> None:
        """User points between the special point that a branch leaves and its first point, if they are on the branch."""
        if len(branch.points) != 2 or branch.parent is None:
            return
        a, b = map(self.here, branch.points)
        for special in self._users(branch, a, b, a, b):
            self.control.special(special)
            branch.insert(special)
            self.observer.special(branch, special)

    def _user_between(self, a: Point, b: Point, load: float, rows: tuple[Point, Point], s: float) -> Point:
        """Point at exactly ``load`` between two ``rows`` of the piece from ``a`` to ``b``, expected at arclength ``s``.

        Close to a branch point Newton's method at a fixed load fails, or ends on the other branch.  On planes across
        the branch it does not, and the load is a function of arclength there, whose zero is found.
        """
        system, (p, q), guess = self.solver.system, rows, hermite(a, b, s)[0]
        x, outcome = self.solver.at_load(guess, load, reach=1.0)
        on_branch = outcome.converged and (
            a.x is not p.x or distance(system, guess, x) < 0.5 * distance(system, a.x, x) or p.load == load
        )
        if not on_branch:
            if (p.load - load) * (q.load - load) >= 0:
                raise ConvergenceError(self._no_equilibrium(load))

            def beyond(s: float) -> float:
                return system.scalar(solve_at(self.solver, lambda t: hermite(a, b, t), s)) - load

            margin = INSIDE * (q.arclength - p.arclength)
            s = zero_between(beyond, p.arclength + margin, q.arclength - margin, EXACT)
            x = solve_at(self.solver, lambda t: hermite(a, b, t), s)
            system.set_load(x, load)
        return self.solver.point(x, s, self.solver.load_tangent(x, q.load > p.load), outcome)

    def _no_equilibrium(self, load: float) -> str:
        return f"No equilibrium at {self.scene.load} = {load:g} between two points of the branch: use another load."

    def _meeting(self, branch: Branch, special: SpecialPoint) -> str:
        """Recognise a branch point that is known already; a reason if the branch ends there."""
        for other in self.branches:
            for i, known in enumerate(other.special):
                if other is branch and special.point.arclength - known.point.arclength < 0.5:
                    continue  # a neighbour on this branch: a nearly double eigenvalue
                if known.kind.branches and self.alike(known.point, special.point, SAME_SPECIAL):
                    special.connects_to = (other.name, i)
                    special.switched = known.switched = True
                    if branch.parent == special.connects_to:
                        return "closed loop"
                    if special.test_function == "mu" and known.test_function == "slope":
                        return ""  # the branch on which the known one ended: it goes on
                    return f"meets {other.name} at {self.scene.load} = {special.point.load:.8g}"
        if special.test_function == "slope":
            return f"meets another branch at {self.scene.load} = {special.point.load:.8g}"
        return ""

    def _end_at_zero_stretch(self, branch: Branch, a: Point, b: Point) -> None:
        """Add the last admissible point, where the smallest stretch vanishes, and say so."""
        shape = self.solver.shape
        branch.ended = "stretch reaches zero"

        def stretch(s: float) -> float:
            return shape.stretch(solve_at(self.solver, lambda t: hermite(a, b, t), s))

        h = b.arclength - a.arclength
        s = zero_between(stretch, a.arclength + INSIDE * h, b.arclength, ALONG)
        x = solve_at(self.solver, lambda t: hermite(a, b, t), s)
        row = self.solver.row(hermite(a, b, s)[1])
        last = self.solver.point(x, s, self.solver.tangent(row, at=x))
        if self._between(branch, a, last):
            return
        special = SpecialPoint(
            END,
            last,
            last.negative,
            last.negative,
            LOCATED * self.solver.units.load,
            test_function="stretch",
        )
        if self.plan.error_bars:
            try:
                with self.solver.system.clock.scope("error bars"):
                    special = zero_stretch(self.solver, last)
            except ConvergenceError as trouble:
                special.note = f"no error estimate: {trouble}"
            else:
                self.control.check(special)
        branch.points.append(special.point)
        branch.special.append(special)

    def _singular_start(self, branch: Branch) -> None:
        """Record that a range begins at a singular state: a branch point there is not located, and not followed."""
        first = branch.points[0]
        extra = first.zero - persistent_zeros(branch.points)
        located = any(s.point is first and s.kind.branches for s in branch.special)
        if branch.parent is None and extra > 0 and not located:
            branch.singular_start = extra
            self.observer.warn(branch.start_in_words(self.scene.load))

    def _singular_end(self, branch: Branch, last: Point) -> None:
        """Report a branch point on the very end of the range, located on a piece of the branch that goes past it."""
        parameter, load = self.scene.parameters[self.scene.load], last.load
        beyond = load + BEYOND * (load - sum(self.span) / 2)
        previous = self.here(branch.points[-2])
        if not parameter.admissible[0] < beyond < parameter.admissible[1] or previous.x is last.x:
            return
        try:
            with self.solver.system.clock.scope("location"):
                x, outcome = self.solver.at_load(last.x, beyond, reach=1.0)
                if not outcome.converged:
                    raise ConvergenceError(self._no_equilibrium(beyond))
                s = last.arclength + distance(self.solver.system, last.x, x)
                point = self.solver.point(x, s, self.solver.load_tangent(x, beyond > load), outcome)
                found = [s for s in self.specials.beyond(previous, point) if s.kind.branches]
        except ConvergenceError as trouble:
            self.observer.warn(
                f"The last state, at {self.scene.load} = {load:g}, is singular, and was not resolved: {trouble}"
            )
            return
        for special in found:
            if abs(special.point.load - load) < SAME_END * abs(self.high - self.low):
                branch.points[-1] = special.point
                branch.special.append(special)
                branch.renumber()
                self.observer.special(branch, special)
                return

    def _closes(self, branch: Branch, a: Point, b: Point) -> bool:
        """Whether the branch passes its own beginning again between two points."""
        if len(branch.points) < 12:
            return False
        first = branch.points[1]
        if max(abs(a.slope), abs(b.slope)) < VERTICAL * (self.high - self.low):  # equal loads: compare the states
            return distance(self.solver.system, b.x, self.here(branch.points[0]).x) < b.arclength - a.arclength
        if (
            (a.load - first.load) * (b.load - first.load) > 0
            or not near(first, a, self.solver.units, 4)
            or a.slope * first.slope <= 0
        ):
            return False
        s = a.arclength + (first.load - a.load) / (b.load - a.load) * (b.arclength - a.arclength)
        guess = hermite(a, b, s)[0]
        x, outcome = self.solver.at_load(guess, first.load, reach=1.0)
        if not outcome.converged:  # beside a fold, say: not there
            return False
        return self.alike(self.solver.point(x, s, None, outcome), first, SAME_STATE)

    def alike(self, a: Point, b: Point, tolerance: float) -> bool:
        """Whether two points are equivalent, up to what the accuracy leaves open where they are on two meshes."""
        across = 0.0 if a.mesh == b.mesh or self.meshes.accuracy is None else 30 * self.meshes.accuracy
        return equivalent(a, b, self.solver.units, max(tolerance, across), across**0.5)

    def _check_symmetry(self, point: Point) -> None:
        for notice in self.solver.notices():
            self.observer.warn(notice)
        if point.drift > DRIFT * self.solver.inertia.scale:
            self.control.drifting(point)
            raise ConvergenceError(
                f"The mesh does not resolve a symmetry of the scene any more: the drift is {point.drift:.2g} at "
                f"{self.scene.load} = {point.load:.6g} where it should vanish; use more elements, or ask for an "
                "accuracy."
            )

    def _check_invariants(self, point: Point) -> None:
        if point.mesh not in self.invariants:
            self.invariants[point.mesh] = Invariants(self.meshes.solvers[point.mesh])
        self.invariants[point.mesh](point)

    def _check_zeros(self, history: list[Point], point: Point) -> None:
        """Say once where eigenvalues stay zero without a symmetry: the state is one of a family at the same load."""
        extra = self._extra(point)
        recent = [p for p in history[-4:] if p.arclength > 0.0]  # a branch point has zeros of its own
        stay = extra > 0 and bool(recent) and all(p.zero == point.zero for p in recent)
        self.solver.damp(extra if stay else 0)
        if stay and len(recent) == 4 and point.zero <= self.specials.level and not self.warned:
            self.warned = True
            self._say_zeros(recent[0], point, extra)

    def _say_zeros(self, before: Point, point: Point, extra: int) -> None:
        """Report eigenvalues that count as zero at two rows: within round-off, or persistently zero."""
        system, inertia, still = self.solver.system, self.solver.inertia, 0
        own = point.zero - system.active_drifts(point.x) - extra
        for p in (before, point):
            low, high = resolve(inertia.at(p.x))
            still = min(max(still, high - low - own), extra)
        if still:
            self.observer.note(
                f"  {still} eigenvalue(s) stay zero that no symmetry of the scene explains: these states may turn or "
                "move freely at one and the same load"
            )
        if extra > still:
            self.observer.note(
                f"  {extra - still} eigenvalue(s) are within {inertia.tolerance / inertia.scale:.0e} of zero, relative "
                "to the lowest bending eigenvalue, without being zero: a critical load is close to "
                f"{self.scene.load} = {before.load:.8g}"
            )

    def _extra(self, point: Point) -> int:
        """Zero eigenvalues, beside symmetries' and the branch's own, of a point."""
        vertical = abs(point.slope) < VERTICAL * (self.high - self.low)  # the branch itself is a family at one load
        return point.zero - self.solver.system.active_drifts(point.x) - vertical

    def _finish(self, branch: Branch) -> None:
        branch.renumber()
        explain(branch)
        self._singular_start(branch)
        last = branch.points[-1]
        if branch.ended == "end of range" and last.zero > self.solver.system.active_drifts(last.x):
            self._singular_end(branch, last)
            last = branch.points[-1]
        if not any(s.point is last for s in branch.special):
            branch.special.append(self.solver.given(END, last))
            branch.renumber()
        if self.plan.error_bars or self.plan.accuracy:
            self._error_bars(branch)
            merge_doubles(branch)
        self._soft_modes(branch)
        for unexplained in branch.unexplained:
            self.observer.warn(str(unexplained))
        self.observer.finished(branch)
        self.control.summary(branch, self.observer)
        self.book.keep(branch.name, branch, {"warned": self.warned, "mesh": self.solver.mesh})
        self.finished()

    def _soft_modes(self, branch: Branch) -> None:
        with self.without(f"Soft modes of {branch.name} were not found"):
            self.soft.examine(branch)
        for sentence in self.soft.undecided(branch):
            self.observer.warn(sentence)

    def _recalled(self, name: str) -> bool:
        """Whether the journal knows a branch of that name, which is then one of those that have been traced."""
        known = self.book.recall(name)
        if known is None:
            return False
        branch: Branch = known.found
        self.branches.append(branch)
        self.warned = known.left["warned"]
        self.use(known.left["mesh"])
        self.observer.branch(branch)
        for special in branch.special:
            if special.kind != END:
                self.observer.special(branch, special)
        self._repeat(known)
        self.observer.finished(branch)
        self.finished()
        return True

    def _repeat(self, known: Recalled) -> None:
        """Say once more what was said in a step."""
        for note in known.notes:
            self.observer.note(f"  {note}")
        for warning in known.warnings:
            self.observer.warn(warning)

    def _error_bars(self, branch: Branch) -> None:
        with self.solver.system.clock.scope("error bars"):
            for special in branch.special:
                if isnan(special.error_estimate):
                    with self.without(f"No error was estimated at {self.scene.load} = {special.point.load:.8g}"):
                        self.meshes.richer(special.point.mesh).estimate(special)
                self.control.label(special)


def _cut(branch: Branch, history: list[Point], last: float) -> list[Point]:
    """Drop what lies beyond the arclength ``last`` from a branch; what is left of the rows it is followed from."""
    branch.points = [p for p in branch.points if p.arclength <= last]
    branch.special = [s for s in branch.special if s.point.arclength <= last]
    return [p for p in history if p.arclength <= last]


def equivalent(a: Point, b: Point, units: Units, tolerance: float = 1e-8, of_strain: float = 0.0) -> bool:
    """Whether two points agree in all that a symmetry leaves alone: load, energy and stretch.

    Loads and energies of ``a`` and ``b`` may differ by ``tolerance``, relative to values greater than the rod's
    ``units``; so may stretches, or by ``of_strain`` where that is larger.
    """
    strain = max(tolerance, of_strain)
    pairs = (
        (a.load, b.load, tolerance, units.load),
        (a.energy, b.energy, tolerance, units.energy),
        (a.stretch, b.stretch, strain, 1.0),
    )
    return all(abs(p - q) <= allowed * unit(p, q, one=one) for p, q, allowed, one in pairs)


def reversed_point(point: Point, total: float) -> Point:
    """The same equilibrium on the branch of length ``total`` followed the other way."""
    tangent = None if point.tangent is None else -point.tangent
    return replace(point, arclength=total - point.arclength, tangent=tangent, slope=-point.slope)


def reversed_branch(branch: Branch) -> Branch:
    """The same branch followed the other way, from its end."""
    total = branch.points[-1].arclength
    points = {id(p): reversed_point(p, total) for p in branch.points}
    special = [
        replace(s, point=points[id(s.point)], negative_before=s.negative_after, negative_after=s.negative_before)
        for s in branch.special
    ]
    out = Branch(branch.name, branch.parent, branch.depth, list(points.values()), special)
    out.renumber()
    return out


def near(a: Point, b: Point, units: Units, steps: float = 2.0) -> bool:
    """Whether points ``a``, ``b`` of a rod with these ``units`` could be neighbours, ``steps`` apart, on one branch."""
    reach = 0.05 * steps
    close = abs(a.load - b.load) <= reach * unit(a.load, one=units.load)
    return close and abs(a.energy - b.energy) <= reach * unit(a.energy, one=units.energy)

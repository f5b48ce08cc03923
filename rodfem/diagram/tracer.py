"""Tracing one branch: its points, its special points and loads asked for, where and why it ends, error bars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from math import isnan
from typing import NoReturn

from rodfem.adaptivity.error_estimate import before_the_end, end_at_zero_stretch, last_admissible, located
from rodfem.adaptivity.mesh_sequence import AccuracyControl, Meshes, TooCoarse
from rodfem.adaptivity.soft_states import SoftRows
from rodfem.continuation.branch import NOT_TRACED, Branch, Point, SpecialPoint, merge_doubles, persistent_zeros
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.follow import END_OF_RANGE, MOST_REACHED, ON_BOUND, follow, require_equilibrium
from rodfem.continuation.kinds import END, USER
from rodfem.continuation.observer import Observer, Remark
from rodfem.continuation.switching import FIRST
from rodfem.diagram.doubts import PersistentZeros, Quadrature
from rodfem.diagram.equivalence import connection, equivalent, image_of, loop_end
from rodfem.diagram.events import Events, Step, at_loads
from rodfem.diagram.plan import Plan
from rodfem.diagram.special_search import SpecialSearch, Unresolved
from rodfem.errors import ConvergenceError
from rodfem.ranks import as_failure, guard
from rodfem.stability.soft_mode import index_range
from rodfem.tolerances import DRIFT, ROUND_OFF

NO_CONVERGENCE = "no convergence"
REMEDIES = {
    NO_CONVERGENCE: "use more elements or smaller steps",
    MOST_REACHED: "use longer steps (StepControl(largest=...)) or more points (StepControl(most=...))",
}
"""What to try where a branch ends for a reason, by its words."""
NEAR_START = 8
"""Steps of a branch that begins near another special point are as short as its first for so many times their length."""


class Ended(Exception):
    """A branch ends where it is, for the reason that the exception names."""


class Tracer:
    """Traces branches one by one, each knowing those before it; ``finished`` is called after each that is complete."""

    def __init__(self, solver: BranchSolver, plan: Plan, observer: Observer, finished: Callable[[], None]) -> None:
        """Start with no branch, on the mesh of the ``solver``; the ``plan`` must have passed its :meth:`Plan.check`."""
        self.solver, self.plan, self.observer, self.finished = solver, plan, observer, finished
        self.scene = solver.system.scene
        self.span = plan.load_range(self.scene)
        self.low, self.high = sorted(self.span)
        self.branches: list[Branch] = []
        self.meshes = Meshes(solver, plan.accuracy)
        self.solvers: Sequence[BranchSolver] = self.meshes.solvers
        self.zeros = PersistentZeros(observer, self.high - self.low)
        self.specials = SpecialSearch(self.meshes, observer)
        self.events = Events(plan.events)
        self.soft = SoftRows(self.meshes, error_bars=bool(plan.error_bars or plan.accuracy))
        self.quadrature = Quadrature(self.meshes.solvers, observer, self.scene.load)

    def use(self, mesh: int) -> None:
        """Go on with the solver of that mesh."""
        self.solver = self.meshes.solvers[mesh]

    def trace(self, branch: Branch) -> None:
        """Follow a branch to its end, insert its special points, estimate errors, hand it on as finished."""
        self.branches.append(branch)
        if branch.ended == NOT_TRACED:
            self.observer.branch(branch)
        self._attempt(branch)
        self._finish(branch)

    def _attempt(self, branch: Branch) -> None:
        """Follow a branch to its end, or to where that fails."""
        self.use(branch.points[-1].mesh)
        self.control = AccuracyControl(self.meshes, (self.low, self.high))
        self.zeros.damp(self.solver, branch.points[-1])
        try:
            with as_failure(self.solver.system.comm):
                self._follow(branch)
        except ConvergenceError as trouble:
            branch.ended = f"{NO_CONVERGENCE}: {trouble}"
            self.observer.warn(Remark(str(trouble), branch.points[-1].load))

    def guard(self, what: str) -> AbstractContextManager[None]:
        """Go on where the block fails, and warn of ``what`` did not happen and why."""
        return guard(what, self.solver.system.comm, self.observer.warn)

    def trace_whole(self, point: Point, name: str, depth: int) -> None:
        """Follow a branch through a point, which has a tangent, in both directions, as one."""
        back = Branch(name, None, depth, [point.backwards(0.0)])
        self.observer.branch(back)
        self._attempt(back)
        branch = back.backwards()
        if back.ended == "closed loop":
            self.branches.append(back)
            self._finish(back)
            return
        first = branch.points[0]
        branch.special.append(self.solver.request(END, first))
        branch.special[-1].note = f"begins here: {back.ended}"
        branch.renumber()
        self.trace(branch)

    def _follow(self, branch: Branch) -> None:
        """Follow a branch to its end; where its mesh is too coarse, from there on with another."""
        history, begun = self._begin(branch), False
        while True:
            try:
                self.control.row(history[-1], self.solver)
                if not begun:
                    self._first_specials(branch)
                begun = True
                while not self._advance(branch, history):  # each time from where it has gone back to
                    pass
                return
            except TooCoarse as trouble:
                history = self._remesh(branch, history, trouble)

    def _begin(self, branch: Branch) -> list[Point]:
        """Rows that a branch goes on from."""
        special = {id(s.point) for s in branch.special}
        history = [p for p in branch.points if id(p) not in special]
        if not history or history[-1].arclength < branch.points[-1].arclength:  # a load asked for is where it goes on
            history.append(branch.points[-1])
        first = history[-1].arclength
        if branch.parent and 0 < first < FIRST / 2:  # it begins near something: see start_branch
            self.specials.begin(history[-1], short=first, until=NEAR_START * first)
        else:
            self.specials.begin(history[-1])
        return history

    def _remesh(self, branch: Branch, history: list[Point], trouble: TooCoarse) -> list[Point]:
        """Points to go on from, on a mesh that resolves what was too coarse; rows before the trouble stay."""
        solver = self.control.another(trouble, self.observer)
        if solver is not None:
            solver.damp(self.solver.system.damping > 0)
            with self.solver.system.clock.scope("location"):
                pairs = self.meshes.carry(history, solver, branch.parent is not None)
            anew = [trouble.point, *history] if len(history) == 1 else [trouble.point]  # else others stay
            branch.replace({id(old): new for old, new in pairs if any(old is point for point in anew)})
            history = [new for _, new in pairs]
            self.solver = solver
            self.observer.mesh(solver.system, trouble.point.load, str(trouble))
        branch.cut(history[-1].arclength)
        return history

    def _advance(self, branch: Branch, history: list[Point]) -> bool:
        """Append points until the branch ends; False where both are as before a step that was too long."""
        try:
            for item in follow(self.solver, history, self.plan.steps, (self.low, self.high), self.specials.reach):
                if isinstance(item, str):
                    raise Ended(item)
                self._take(branch, history, item)
        except Unresolved:  # the step was too long, or led to another branch: back, to smaller ones
            branch.cut(history[-1].arclength)
            return False
        except Ended as end:
            branch.ended = str(end)
            for remedy in (remedy for reason, remedy in REMEDIES.items() if reason in branch.ended):
                words = f"{branch.name} ends: {branch.ended}; {remedy}."
                self.observer.warn(Remark(words, branch.points[-1].load))
        return True

    def _say_unstable(self, branch: Branch) -> None:
        """Say of the first branch that it begins unstable, as far as richer meshes have not left that open."""
        point = branch.points[0]
        if self.branches and branch is self.branches[0] and point.negative:
            index = index_range(point.negative, point.undecided)
            words = f"  the first state is unstable already (index {index}): stability was lost outside the range"
            self.observer.note(Remark(words, point.load))

    def _take(self, branch: Branch, history: list[Point], row: Point) -> None:
        """Append a row to a branch, with the special points before it."""
        previous = history[-1]
        last = loop_end(branch, Step(self.solver, previous, row), self.high - self.low, self.alike)
        row = last or row
        self._check_symmetry(row)
        require_equilibrium(self.solvers[row.mesh], row)
        self.control.row(row, self.solver)
        # a branch point has zeros of its own
        known = [p for p in history if p.arclength > 0.0 or branch.parent is None]
        self.zeros.check(self.solver, known, row, self.specials.undecided)
        if row.stretch <= 0:
            self._end_at_zero_stretch(branch, previous, row)
        self._require_convexity(branch, row)
        self._add_special_points(branch, previous, row, "closed" if last else "")
        history.append(row)
        self._append(branch, row)
        if last:
            raise Ended("closed loop")

    def _append(self, branch: Branch, row: Point) -> None:
        branch.append(row)
        self.observer.progress(branch, row)

    def _add_special_points(self, branch: Branch, a: Point, b: Point, last: str = "") -> None:
        """Insert special points between two points, the second maybe where it is ``closed``, or ``unstretched``.

        In an unstretched state eigenvalues vanish, which is no special point of its own.
        """
        with self.solver.system.clock.scope("location"):
            specials = [] if a is branch.points[0] and branch.parent else self.specials.advance(a, b)
            if last == "unstretched":
                close = located(self.solver, b)
                specials = [s for s in specials if abs(s.point.load - b.load) > close]
            self._leave(branch, specials, b)
            step = Step(self.solver, a, b, specials, begins=a is branch.points[0], closed=last == "closed")
            self._insert(branch, specials + self._requests(step))

    def _leave(self, branch: Branch, specials: list[SpecialPoint], b: Point) -> None:
        """End a branch where it leaves the range before one of its ``specials``, found up to ``b``."""
        margin = ON_BOUND * (self.high - self.low)
        out = next((s for s in specials if not self.low - margin <= s.point.load <= self.high + margin), None)
        if out is None:
            return
        last = max((p for p in branch.points if p.arclength < out.point.arclength), key=lambda p: p.arclength)
        a = self.solver.interpolated(last)
        begins = len(branch.points) == 1  # else what is at its first point has been found
        step = Step(self.solver, a, b, specials, begins=begins).up_to((self.low, self.high))
        branch.cut(a.arclength)
        known = [s for s in specials if s.point.arclength < a.arclength]
        self._insert(branch, [*known, *step.singular, *self._requests(step)])
        require_equilibrium(self.solvers[step.b.mesh], step.b)
        self._append(branch, step.b)
        raise Ended(END_OF_RANGE)

    def _requests(self, step: Step) -> list[SpecialPoint]:
        """What the plan asks for in a step."""
        return at_loads(step, self.plan.at) + self.events.special_points(step)

    def _first_specials(self, branch: Branch) -> None:
        """Insert special points between the branch point that a branch leaves and its first point."""
        if len(branch.points) == 2 and branch.parent is not None:
            a, b = map(self.solver.interpolated, branch.points)
            self._insert(branch, self._requests(Step(self.solver, a, b, begins=a is branch.points[0])))

    def _insert(self, branch: Branch, specials: list[SpecialPoint]) -> None:
        """Insert special points into a branch, up to one at which it ends."""
        for special in specials:
            if not special.unfolding > ROUND_OFF:  # else the mesh has an equilibrium next to it only
                require_equilibrium(self.solvers[special.point.mesh], special.point)
            self.control.special(special)
        for special in sorted(specials, key=lambda s: s.point.arclength):
            reason = ""
            if any(s.kind == special.kind and s.point is special.point for s in branch.special):
                continue  # at a row that the branch has gone back to
            if special.kind.branches:
                reason = connection(branch, special, self.branches, self.alike, self.scene.load)
            branch.insert(special)
            self.observer.special(branch, special)
            if reason:  # it ends before rows, and loads asked for, that were taken for some of it
                branch.cut(special.point.arclength)
                raise Ended(reason)

    def _require_convexity(self, branch: Branch, row: Point) -> None:
        """End a branch before a ``row`` at which the stored energy is not convex."""
        if why := self.solver.lost_convexity(row.x):
            raise Ended(why)

    def _end_at_zero_stretch(self, branch: Branch, a: Point, b: Point) -> NoReturn:
        """End a branch at the last admissible point, where the smallest stretch vanishes, or before."""
        last = last_admissible(self.solver, a, b)
        near = before_the_end(self.solver, a, last)
        if near is not None:
            self._require_convexity(branch, near)
            if near.negative != a.negative:  # what passes zero before is zero at the end once more
                require_equilibrium(self.solvers[near.mesh], near)
                self._add_special_points(branch, a, near)
                branch.append(near)
                a = near
        self._add_special_points(branch, a, last, "unstretched")
        end = end_at_zero_stretch(self.solver, last, error_bars=self.plan.error_bars)
        if not isnan(end.error_estimate):
            self.control.check(end)
        branch.append(end.point)
        branch.special.append(end)
        raise Ended("stretch reaches zero")

    def _singular_start(self, branch: Branch) -> None:
        """Record that a range begins at a singular state: a branch point there is not located, and not followed."""
        first = branch.points[0]
        extra = first.zero - persistent_zeros(branch.points)
        located = any(s.point is first and s.kind.branches for s in branch.special)
        if branch.parent is None and extra > 0 and not located:
            branch.singular_start = extra
            self.observer.warn(Remark(branch.start_in_words(self.scene.load), first.load))

    def _singular_end(self, branch: Branch, last: Point) -> None:
        """Insert a branch point on the very end of the range, located on a piece of the branch that goes past it."""
        previous, load = branch.points[-2], last.load + 0.02 * (last.load - sum(self.span) / 2)
        low, high = self.scene.parameters[self.scene.load].admissible
        width = 1e-6 * (self.high - self.low)  # nearer is the last state
        if previous.x is last.x or not low < load < high or _near(branch.special, last, width):
            return
        with self.solver.system.clock.scope("location"):
            x, outcome = self.solver.at_load(last.x, load, reach=1.0)
            if not outcome.converged:
                raise ConvergenceError(f"there is no equilibrium at {self.scene.load} = {load:g}")
            s = last.arclength + self.solver.system.distance(last.x, x)
            further = self.solver.point(x, s, self.solver.load_tangent(x, load > last.load), outcome)
            found = self.specials.beyond(previous, further)
        for special in _near(found, last, width)[:1]:
            if not any(s.point is last for s in branch.special):  # else a load asked for, which stays
                branch.replace({id(last): special.point})
            branch.insert(special)
            self.observer.special(branch, special)

    def alike(self, a: Point, b: Point, tolerance: float) -> bool:
        """Whether two points are equivalent, up to what the accuracy leaves open where they are on two meshes."""
        across = 0.0 if a.mesh == b.mesh or self.meshes.accuracy is None else 30 * self.meshes.accuracy
        return equivalent(a, b, self.solver.units, max(tolerance, across), across**0.5)

    def _check_symmetry(self, point: Point) -> None:
        if point.drift > DRIFT * self.solver.inertia.scale:
            self.control.drifting(point)
            raise ConvergenceError(
                f"The mesh does not resolve a symmetry of the scene any more: the drift is {point.drift:.2g} at "
                f"{self.scene.load} = {point.load:.6g} where it should vanish; use more elements, or ask for an "
                "accuracy."
            )

    def _finish(self, branch: Branch) -> None:
        self.events.finish(self.observer)
        branch.renumber()
        branch.explain()
        self._singular_start(branch)
        last = branch.points[-1]
        if branch.ended == END_OF_RANGE and last.zero > self.specials.undecided:
            with self.guard(f"The last state, at {self.scene.load} = {last.load:g}, is singular, and was not resolved"):
                self._singular_end(branch, last)
            last = branch.points[-1]
        if not any(s.point is last for s in branch.special if s.kind != USER):
            branch.special.append(self.solver.request(END, last))
            branch.renumber()
        if self.plan.error_bars or self.plan.accuracy:
            self._error_bars(branch)
            merge_doubles(branch)
        self._soft_modes(branch)
        self._say_unstable(branch)
        self.quadrature.examine(branch)
        branch.image = image_of(branch, self.solver)
        changes = (Remark(str(change), change.a.load, change.b.load) for change in branch.unexplained)
        for remark in (*self.specials.unlocated(branch), *changes):
            self.observer.warn(remark)
        self.observer.finished(branch)
        self.control.summary(branch, self.observer)
        self.finished()

    def _soft_modes(self, branch: Branch) -> None:
        with self.guard(f"Soft modes of {branch.name} were not found"):
            self.soft.examine(branch)
            branch.explain()  # once more: richer meshes may have decided more than a factorisation does
        for sentence in self.soft.undecided(branch):
            self.observer.warn(sentence)

    def _error_bars(self, branch: Branch) -> None:
        with self.solver.system.clock.scope("error bars"):
            for special in branch.special:
                if isnan(special.error_estimate):
                    with self.guard(f"No error was estimated at {self.scene.load} = {special.point.load:.8g}"):
                        self.meshes.richer(special.point.mesh).estimate(special)
                self.control.label(special)


def _near(specials: Sequence[SpecialPoint], point: Point, width: float) -> list[SpecialPoint]:
    """Branch points among some special points whose load is that of a ``point``, but for a ``width``."""
    return [s for s in specials if s.kind.branches and abs(s.point.load - point.load) < width]

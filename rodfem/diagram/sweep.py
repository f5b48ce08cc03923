"""Frequencies against the load for a rod under loads without a potential, and the loads at which they become unstable.

At each load the equilibrium is solved for, and the left-most eigenvalues ``mu = omega^2`` of its pencil are found
(:mod:`rodfem.diagram.frequency_rows`).  Between them critical loads are located
(:mod:`rodfem.diagram.critical_loads`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import isnan

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.branch import FIRST_BRANCH, Branch, Point, SpecialPoint, Unexplained
from rodfem.continuation.convexity_between import lost_between
from rodfem.continuation.eigenvalue_curves import Curves
from rodfem.continuation.invariants import Invariants
from rodfem.continuation.kinds import DIVERGENCE, END, FLUTTER, USER
from rodfem.continuation.observer import Observer
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.critical_loads import CriticalLoads
from rodfem.diagram.far_meetings import FarMeetings
from rodfem.diagram.first_name import name_of_first
from rodfem.diagram.first_state import first_state
from rodfem.diagram.frequency_rows import FREQUENCIES, NONE, FrequencyRows, Row, leftmost
from rodfem.diagram.held import at_load
from rodfem.diagram.hidden_events import missed_loads
from rodfem.diagram.load_steps import LoadSteps
from rodfem.diagram.persistent_zeros import family_of
from rodfem.diagram.plan import Plan
from rodfem.diagram.quadrature import Quadrature
from rodfem.diagram.sweep_errors import SweepErrors
from rodfem.diagram.unfollowed import Unfollowed
from rodfem.errors import ConvergenceError, SceneError
from rodfem.faults import as_failure, without
from rodfem.stability.census import census
from rodfem.stability.cluster import Cluster
from rodfem.stability.dependence import may_depend, require_independent_constraints
from rodfem.stability.frequencies import REAL, Frequencies
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import unit

LOADS = 101
"""Number of loads at which a range is sampled."""
ONE_LOAD = 1e-12
"""Distance of two loads, over the greatest, up to which they are one: a step between them would be round-off."""


class Sweep:
    """Sweeps the load of a scene over a range from its start state; used like the explorer of conservative scenes."""

    def __init__(self, solver: StaticSolver, plan: Plan, observer: Observer, finished: Callable[[], None]) -> None:
        """Allocate the pencil; the plan must have passed its check.

        ``solver`` has the mesh, the ``observer`` hears of the progress, ``finished()`` is called when the sweep is
        complete.  The ``plan`` names the loads.
        """
        self.solver, self.plan, self.observer, self.finished = solver, plan, observer, finished
        self.span, self.units = plan.over(solver.system.scene), solver.system.scene.units
        self._least = ONE_LOAD * max(map(abs, self.span))
        self._asked = list[float]()
        for load in plan.at:
            known = (other for other in (*self.span, *self._asked) if abs(load - other) <= self._least)
            self._asked.append(next(known, load))
        self.eigensolver = NonsymmetricSolver(solver.system)
        self.number = plan.spectrum or FREQUENCIES
        self.rows = FrequencyRows(self.eigensolver, self.number)
        self.curves = Curves(solver.system.comm)
        self.critical = CriticalLoads(solver, self.eigensolver, self.number, observer.warn)
        self.unfollowed = Unfollowed(self.eigensolver, FarMeetings(self.critical.hidden), observer)
        self.invariants = Invariants(solver)
        self.last: Row | None = None
        self._still = self.number  # frequencies that are zero at all loads
        self.branches: list[Branch] = []
        self._load = solver.system.scene.load

    @property
    def solvers(self) -> Sequence[StaticSolver]:
        """The one solver, as the points' mesh number 0 names it."""
        return [self.solver]

    def run(self) -> list[Branch]:
        """Sweep, locate flutter, estimate errors."""
        branch, comm = Branch(FIRST_BRANCH, None, 0), self.solver.system.comm
        self.branches.append(branch)
        try:
            with as_failure(comm):
                branch.ended = self._sweep(branch) or "end of range"
        except ConvergenceError as trouble:
            if not branch.points:
                raise
            branch.ended = f"no convergence: {trouble}"
            self.observer.warn(str(trouble))
        last = branch.points[-1]
        branch.special.append(self.solver.given(END, last))
        branch.renumber()
        if self.plan.error_bars:
            self._error_bars(branch)
        Quadrature([self.solver], self.observer, self._load).examine(branch)
        self._within_bars(branch)
        self.observer.finished(branch)
        with without("Whether frequencies stay zero was not examined", comm, self.observer.warn):
            self._family(last)
        with without("The asymmetry of the tangent matrix was not measured", comm, self.observer.warn):
            self._asymmetry(last)
        self.finished()
        return self.branches

    def _sweep(self, branch: Branch) -> str:
        """Compute the points of a branch, load by load, and the special points between them; why it ends early."""
        a, b = self.span
        stops = [load for load in self.solver.system.scene.stops if min(a, b) < load < max(a, b)]
        own = np.unique([*np.linspace(a, b, LOADS), *stops])
        apart = [load for load in own if all(abs(load - at) > self._least for at in self._asked)]
        loads = np.unique([*apart, *self._asked])
        loads = loads if a < b else loads[::-1]
        x, _ = first_state(self.solver, a)
        branch.name = name_of_first(self.solver.shape, [x, self.solver.at_load(x, float(loads[1]))[0]])
        self.observer.branch(branch)
        x = at_load(self.solver, x, float(loads[0]))
        self.solver.require_convexity(x)
        if words := self.rows.first(x):
            self.observer.warn(
                f"The eigenvalues omega^2 of the first state are not well defined ({words}): do not trust any of this "
                "sweep. Constraints may follow from others, or sizes of the rod's numbers may be too far apart."
            )
        for motion in self.solver.system.free_motions(x):
            self.observer.note(f"  nothing holds the rod against the {motion}: its frequency, zero, is left out")
        try:
            steps, latest = None, None
            for load in loads.tolist():
                state = x if steps is None else steps.to(load)
                if latest is not None and (why := self._lost_convexity(latest.x, state) or self._dependent(state)):
                    return why
                if steps and load in stops:
                    steps.known = steps.known[-1:]
                latest = self._point(state)
                steps = steps or LoadSteps(self.solver, latest, self.span)
                for notice in self.solver.notices():
                    self.observer.warn(notice)
                self._take(branch, self.rows.add(latest))
        finally:  # also where there is no equilibrium, or at an interrupt: nothing that has been computed is lost
            self._take(branch, self.rows.finish())
        return ""

    def _lost_convexity(self, a: PETSc.Vec, b: PETSc.Vec) -> str:
        """Why a sweep ends between the equilibria ``a`` and ``b``; empty where the stored energy stays convex."""
        solver = self.solver

        def state(t: float) -> PETSc.Vec:
            return a * (1.0 - t) + b * t

        def holds(t: float) -> bool:
            x = b if t == 1.0 else at_load(solver, a, solver.system.scalar(state(t)))
            return not solver.lost_convexity(x)

        lost = lost_between(solver.convexity, state, holds)
        return "" if lost is None else solver.not_convex(state(lost))

    def _dependent(self, x: PETSc.Vec) -> str:
        """Why a sweep ends before the equilibrium ``x``; empty where its constraints do not depend on one another.

        Where they do, as those of a rod that is pulled taut, frequencies are not defined.
        """
        if may_depend(self.solver.shape, x):
            try:
                require_independent_constraints(self.solver.shape, x)
            except SceneError as trouble:
                why = f"no frequencies at {self._load} = {self.solver.system.scalar(x):.8g}: {trouble}"
                self.observer.warn(why)
                return why
        return ""

    def _take(self, branch: Branch, rows: list[Row]) -> None:
        """Take rows of the grid into a branch, and the special points before each."""
        for row in rows:
            point, before, self.last = row.point, self.last, row
            self._record(point, row.found, on_the_way=True)
            self.unfollowed.look(point, last=point.load == self.span[1])
            if before is not None:
                self._between(branch, before, row)
            branch.points.append(point)
            if point.load in self._asked:
                self._special(branch, self.solver.given(USER, point))
            self.observer.progress(branch, point)

    def _family(self, last: Point) -> None:
        """Say where frequencies are zero at all loads, without a symmetry, to which the ``last`` one belongs, too."""
        if self._still:
            pencil = self.eigensolver.at(last.x)
            if words := family_of(pencil, leftmost(pencil, self.number), self._still):
                self.observer.warn(words)

    def _asymmetry(self, last: Point) -> None:
        """Say what the load does to the tangent matrix at the last point."""
        rank, size = self.eigensolver.at(last.x).asymmetry()
        self.observer.note(
            f"  the load makes the tangent matrix non-symmetric by a matrix of rank {rank} "
            f"(largest entry {size:.1e} of |S|)"
        )

    def at(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of an equilibrium by itself; unstable are all eigenvalues of the mesh that are."""
        point = self._beside(x)
        if (everything := census(self.eigensolver.at(x))) is not None:
            point.negative = max(point.negative, len(everything.unstable))
        return point

    def _beside(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of an equilibrium that is not on the way of the sweep."""
        point, before = self._point(x), NONE if self.last is None else self.last.found
        self._record(point, leftmost(self.eigensolver.at(x), self.number, before), on_the_way=False)
        return point

    def _point(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of the equilibrium ``x``, but for those of its frequencies, and check its invariants.

        Beside a state whose matrix is singular Newton's method ends early by its own measure: where the invariants are
        violated the equations are solved once more.
        """
        point = self._evaluated(x)
        try:
            self.invariants(point)
        except ConvergenceError:
            point = self._evaluated(at_load(self.solver, x, point.load))
            self.invariants(point)
        return point

    def _evaluated(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of a state ``x`` that do not depend on its frequencies."""
        solver, load = self.solver, self.solver.system.scalar(x)
        return Point(
            x=x,
            tangent=None,
            arclength=abs(load - self.span[0]),
            load=load,
            ordinate=solver.shape.ordinate(x),
            **solver.energies(x)._asdict(),
            stretch=solver.shape.stretch(x),
            negative=0,
            zero=solver.system.active_drifts(x),
            slope=float("nan"),
            drift=0.0,
            error=0.0,
        )

    def _record(self, point: Point, found: Frequencies, *, on_the_way: bool) -> None:
        """Record the frequencies ``found`` at a point; a special point is not ``on_the_way`` of the curves."""
        values = found.values
        point.negative = found.unstable(found.noise)
        still = int((abs(values) < min(found.noise, REAL * self.units.omega2)).sum())
        point.zero += still
        self._still = min(self._still, still)
        point.omega2 = [[float(v.real), float(v.imag)] for v in values[: self.number]]
        point.motion = list(found.kinds[: self.number])
        point.curve = self.curves.numbers(found, keep=on_the_way)[: self.number]

    def _between(self, branch: Branch, first: Row, second: Row) -> None:
        """Take what happens between two loads into a branch: critical loads, in their order, each with its state."""
        a, b = first.point, second.point
        with self.solver.system.clock.scope("location"):
            told = self.critical.between(first, second)
        events, negative = told.events, a.negative
        explained = negative + sum(e.change for e in events) + told.entered == b.negative
        for i, event in enumerate(events):
            point = a if event.load == a.load else b if event.load == b.load else None
            point = point or self._beside(at_load(self.solver, a.x, event.load))
            after_it = negative + event.change
            if explained and i == len(events) - 1 and all(e.kind == FLUTTER for e in events):
                after_it = b.negative  # of all eigenvalues that are recorded
            if event.cluster is not None:
                self._name(point, event.cluster, event.cluster.size - event.still)
            if event.kind == DIVERGENCE and (zero := point.negative - min(negative, after_it)) > 0:
                point.negative, point.zero = point.negative - zero, point.zero + zero
            special = SpecialPoint(event.kind, point, negative, after_it, event.uncertainty, omega2=event.omega2)
            special.cluster, special.note = event.cluster, event.note
            if point is not a and point is not b:
                branch.points.append(point)
            self._special(branch, special)
            negative = after_it
        if not explained:
            change = Unexplained(branch.points[-1], b, negative, b.negative, "use a smaller range or more elements")
            branch.unexplained.append(change)
            self.observer.warn(str(change))
        elif told.entered > 0:
            self.observer.warn(
                f"{told.entered} eigenvalues that are found at {self._load} = {b.load:.6g} and not at {a.load:.6g} are "
                f"complex at both: the rows before, which count {a.negative}, may count too few. Ask for more "
                "frequencies."
            )

    def _within_bars(self, branch: Branch) -> None:
        """Say of which frequencies that meet, and part at the next special point, that is not known.

        Where two pass one another, of motions in two planes, round-off makes a complex pair of them for a while: the
        two loads differ by less than their bars, or than what their location leaves open where there are none.  At one
        load frequencies are double whatever the mesh.
        """
        for s, t in pairwise(branch.special):
            changes = [x.negative_after - x.negative_before for x in (s, t)]
            bars = [x.located_to if isnan(x.error_estimate) else x.error_estimate for x in (s, t)]
            apart = abs(s.point.load - t.point.load)
            if s.kind == t.kind == FLUTTER and sum(changes) == 0 and 0 < apart <= sum(bars):
                what, loads = "meet" if changes[0] > 0 else "part", f"{s.point.load:.8g} and {t.point.load:.8g}"
                self.observer.warn(
                    f"Whether frequencies {what} between {self._load} = {loads} is not known: these loads differ by "
                    "less than their bars. Use another mesh, without very short elements."
                )

    def _name(self, point: Point, cluster: Cluster, number: int) -> None:
        """Name the ``number`` of motions that meet at a point by all that a cluster does: their vectors are one."""
        name = self.eigensolver.at(point.x).motion(cluster.basis)
        distance = [abs(complex(*value) - cluster.mean) for value in point.omega2]
        for i in np.argsort(distance, kind="stable")[:number]:
            point.motion[i] = name

    def _special(self, branch: Branch, special: SpecialPoint) -> None:
        branch.special.append(special)
        self.observer.special(branch, special)

    def _error_bars(self, branch: Branch) -> None:
        """Estimate the errors of all special points, and say where an accuracy that was asked for is not reached."""
        asked = self.plan.accuracy
        with self.solver.system.clock.scope("error bars"):
            comm, warn, errors = self.solver.system.comm, self.observer.warn, SweepErrors(self.solver, self.span)
            for s in branch.special:
                with without(f"No error of the {s.kind.words} at {s.point.load:.6g} was estimated", comm, warn):
                    errors.estimate(s)
                if asked is not None and s.error_estimate > asked * unit(s.point.load, one=self.units.load):
                    s.note = s.note or f"accuracy {asked:g} not reached"
            with without("Whether a richer mesh has more critical loads was not examined", comm, warn):
                for words in missed_loads(branch, self.critical.hidden.near, errors.measured, self._load):
                    warn(words)

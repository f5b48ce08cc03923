"""Frequencies against the load for a rod under loads without a potential, and the loads at which they become unstable.

At each load the equilibrium is solved for, and all eigenvalues ``mu = omega^2`` that the mesh has are found
(:mod:`rodfem.stability.spectrum`); the left-most ones are recorded.  Between loads critical ones are located
(:mod:`rodfem.diagram.critical_loads`), whose errors a richer discretisation bounds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import Enriched, bound, derived
from rodfem.continuation.branch import FIRST_BRANCH, Branch, Point, SpecialPoint, Unexplained
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.eigenvalue_curves import Curves, zero_near
from rodfem.continuation.follow import require_equilibrium
from rodfem.continuation.kinds import DIVERGENCE, END, FLUTTER, USER
from rodfem.continuation.observer import Observer, Remark
from rodfem.diagram.critical_loads import Critical, CriticalLoads, Mean, Measuring, Side, located_flutter
from rodfem.diagram.doubts import Quadrature
from rodfem.diagram.equilibria import LoadSteps, at_load, first_state, name_of_first
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError, SceneError, many
from rodfem.fem.shape import halved
from rodfem.ranks import as_failure, guard
from rodfem.stability.cluster import Cluster
from rodfem.stability.dependence import may_depend, require_independent_constraints
from rodfem.stability.inertia import Index
from rodfem.stability.nonsymmetric import FREQUENCIES, REAL, Frequencies, NonsymmetricSolver, begins_slowly, label
from rodfem.tolerances import DRIFT, ROUND_OFF, round_off

LOADS = 101  # number of loads at which a range is sampled


class Row(NamedTuple):
    """A ``point`` of a sweep, its ``side`` of the steps there, and its left-most frequencies ``found``."""

    point: Point
    side: Side
    found: Frequencies


class Sweep:
    """Sweeps the load of a scene over a range from its start state; used like the explorer of conservative scenes."""

    def __init__(self, solver: BranchSolver, plan: Plan, observer: Observer, finished: Callable[[], None]) -> None:
        """Allocate the pencil on the mesh of the ``solver``; ``finished()`` is called at the end."""
        self.solver, self.plan, self.observer, self.finished = solver, plan, observer, finished
        self.solvers: Sequence[BranchSolver] = [solver]
        scene = solver.system.scene
        self.span, self.units, self._load = plan.load_range(scene), scene.units, scene.load
        self._asked = [self._snap(load) for load in plan.at]
        self.eigensolver = NonsymmetricSolver(solver.system)
        self.number = plan.spectrum or FREQUENCIES
        self.curves = Curves(solver.system.comm)
        self.critical = CriticalLoads(solver, self.eigensolver, observer.warn)
        self._rows: list[Row] = []  # the last two, the latter of which is not taken into the branch yet
        self._zeros = self.number  # frequencies that are zero at all loads
        self._massless, self._counted = 0, False  # unstable motions without inertia, of no finite eigenvalue: 1 or 0
        self.branches: list[Branch] = []

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
        branch.special.append(self.solver.request(END, last))
        branch.renumber()
        if self.plan.error_bars:
            self._error_bars(branch)
        Quadrature(self.solvers, self.observer, self._load).examine(branch)
        self.observer.finished(branch)
        if self._zeros:
            with guard("Whether frequencies stay zero was not examined", comm, self.observer.warn):
                self._family(last)
        self.finished()
        return self.branches

    def _snap(self, load: float, others: Sequence[float] = ()) -> float:
        """An end of the range, or one of ``others``, from which a load differs by round-off; else that load."""
        least = 1e-12 * max(map(abs, self.span))  # a step that is less is round-off
        return next((other for other in (*self.span, *others) if abs(load - other) <= least), load)

    def _loads(self) -> tuple[list[float], list[float]]:
        """Loads at which tables have corners, and all those of the sweep, in its order."""
        a, b = self.span
        stops = [load for load in self.solver.system.scene.stops if min(a, b) < load < max(a, b)]
        own = [self._snap(load, self._asked) for load in (*np.linspace(a, b, LOADS).tolist(), *stops)]
        loads = np.unique([*own, *self._asked]).tolist()
        return stops, loads if a < b else loads[::-1]

    def _sweep(self, branch: Branch) -> str:
        """Compute the points of a branch, load by load, and the special points between them; why it ends early."""
        stops, loads = self._loads()
        x, _ = first_state(self.solver, self.span[0])
        branch.name = name_of_first(self.solver.shape, [x, self.solver.at_load(x, loads[1])[0]])
        self.observer.branch(branch)
        x = at_load(self.solver, x, loads[0])
        self.solver.require_convexity(x)
        if not (spectrum := self.eigensolver.at(x).spectrum).complete:
            self.observer.note("  the mesh has too many unknowns to find all frequencies: those nearest zero are found")
        self.eigensolver.slow = begins_slowly(spectrum)
        for motion in self.solver.system.free_motions(x):
            self.observer.note(f"  nothing holds the rod against the {motion}: its frequency, zero, is left out")
        try:
            first = self._point(x)
            steps = LoadSteps(self.solver, first, self.span)
            self._take(branch, first)
            for load in loads[1:]:
                state = steps.reach(load)
                point = self._point(state)
                if why := self.solver.lost_convexity(state) or self._dependent(state):
                    return why
                if load in stops:
                    steps.known = steps.known[-1:]
                self._take(branch, point)
        finally:  # also where there is no equilibrium, or at an interrupt: nothing that has been computed is lost
            self._close(branch, None)
        return ""

    def _dependent(self, x: PETSc.Vec) -> str:
        """Why a sweep ends before ``x``: constraints depend on one another, as of a rod pulled taut; empty if not."""
        if may_depend(self.solver.shape, x):
            try:
                require_independent_constraints(self.solver.shape, x)
            except SceneError as trouble:
                why = f"no frequencies at {self._load} = {self.solver.system.scalar(x):.8g}: {trouble}"
                self.observer.warn(why)
                return why
        return ""

    def _take(self, branch: Branch, point: Point) -> None:
        """Find the eigenvalues of the next row; the step before the last one can be taken then."""
        row = self._row(point)
        self._close(branch, row)
        self._rows = [*self._rows[-1:], row]

    def _close(self, branch: Branch, following: Row | None) -> None:
        """Take the last row, before the ``following`` one, into a branch, and the special points before it."""
        if not self._rows:
            return
        before, row = self._rows[-2:-1], self._rows[-1]
        self._record(row, on_the_way=True)
        if before:
            self._insert(branch, before[0], row, following)
        branch.points.append(row.point)
        if row.point.load in self._asked:
            self._special(branch, self.solver.request(USER, row.point))
        self.observer.progress(branch, row.point)

    def _row(self, point: Point) -> Row:
        """A point with all its eigenvalues, and its left-most frequencies with the names of those that are recorded."""
        pencil = self.eigensolver.at(point.x)
        found = label(pencil.system, pencil.leftmost(self.number), pencil.turned, self.number)
        return Row(point, Side(point.load, point.x, pencil.spectrum), found)

    def _family(self, last: Point) -> None:
        """Say which frequencies are zero at all loads, to which the ``last`` one belongs, too, without a symmetry.

        Frequencies and critical loads are those of one state of a family then: a rod may turn about its axis, between
        springs that are not alike all around it.  Zero eigenvalues of a symmetry's Jordan block are none of these: ``S
        v = -d M g`` with its generator ``g``, and a drift scalar ``d`` that is not zero.  A rod that floats has many of
        both: nothing is said of it.
        """
        pencil, system, moving = self.eigensolver.at(last.x), self.solver.system, list[str]()
        found = pencil.leftmost(self.number)
        if found.floating:
            return
        for i in np.flatnonzero(abs(found.values) < found.noise).tolist():
            mode = system.new_vector(found.vectors[:, i].real)
            if system.drift(mode) <= DRIFT * system.stiffness_scale * system.norm(mode):
                moving.append(pencil.motion(found.vectors[:, [i]].real))
        if number := min(len(moving), self._zeros):
            self.observer.warn(
                f"{many(number, 'frequency stays', 'frequencies stay')} zero that no symmetry of the scene explains "
                f"({', '.join(dict.fromkeys(moving))}): the rod may turn or move freely, and frequencies and critical "
                "loads are those of the state that its start leads to; others differ."
            )

    def at(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of an equilibrium that is not on the way of the sweep."""
        point = self._point(x)
        self._record(self._row(point), on_the_way=False)
        return point

    def _point(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of the equilibrium ``x``, but for those of its frequencies, and check it."""
        point = self._evaluated(x)
        try:
            require_equilibrium(self.solver, point)
        except ConvergenceError:
            point = self._evaluated(at_load(self.solver, x, point.load))
            require_equilibrium(self.solver, point)
        return point

    def _evaluated(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of a state ``x`` that do not depend on its frequencies."""
        system = self.solver.system
        index = Index(0, system.active_drifts(x))
        return self.solver.point(x, abs(system.scalar(x) - self.span[0]), None, index=index)

    def _record(self, row: Row, *, on_the_way: bool) -> None:
        """Record the frequencies of a row at its point; a special point is not ``on_the_way`` of the curves."""
        point, found = row.point, row.found
        point.negative = row.side.spectrum.unstable + self._massless
        zeros = int((abs(found.values) < min(found.noise, REAL * self.units.omega2)).sum())
        point.zero += zeros
        self._zeros = min(self._zeros, zeros)
        point.omega2 = [[float(v.real), float(v.imag)] for v in found.values[: self.number]]
        point.motion = list(found.kinds[: self.number])
        point.curve = self.curves.numbers(found, keep=on_the_way)[: self.number]

    def _insert(self, branch: Branch, first: Row, second: Row, following: Row | None) -> None:
        """Take what happens between two loads into a branch: critical loads, in their order, each with its state."""
        a, b, behind = first.point, second.point, following and following.side
        zeros = min(first.found.zeros(), second.found.zeros())
        with self.solver.system.clock.scope("location"):
            events = self.critical.critical_loads(first.side, second.side, behind, zeros)
        negative = a.negative
        for event in events:
            after = negative + event.change
            if event.cluster is not None:
                self._critical(branch, event, (a, b), (negative, after))
            negative = after
        if hidden := sum(max(event.change, 0) for event in events if event.cluster is None):
            self._hidden(hidden, a, b)
        negative += self._through_infinity(branch, second) if self.critical.poles else 0
        if negative != b.negative:
            change = Unexplained(branch.points[-1], b, negative, b.negative, "use a smaller range or more elements")
            branch.unexplained.append(change)
            self.observer.warn(Remark(str(change), a.load, b.load))

    def _through_infinity(self, branch: Branch, row: Row) -> int:
        """Change of the number of unstable motions at poles before a ``row``, and of the rows before the first."""
        lacking, poles = 0, self.critical.poles
        if not self._counted:
            lacking = (self.eigensolver.at(row.side.x).massless + len(poles)) % 2
            for point in (*branch.points, row.point):
                point.negative += lacking
            for special in branch.special:
                special.negative_before += lacking
                special.negative_after += lacking
            self._counted, self._massless = True, lacking
        turned = (self._massless + len(poles)) % 2 - self._massless
        self._massless += turned
        row.point.negative += turned
        return lacking + sum(poles) + turned

    def _hidden(self, change: int, a: Point, b: Point) -> None:
        """Say that round-off hides collisions between two rows; where some are unstable only their number is open."""
        report = self.observer.note if a.negative else self.observer.warn
        words = (
            f"{change} eigenvalues that are complex at {self._load} = {b.load:.6g} are so at {a.load:.6g} by no "
            f"more than round-off: the rows before, which count {a.negative}, may count too few."
        )
        report(Remark(words, a.load, b.load))

    def _critical(self, branch: Branch, event: Critical, ends: tuple[Point, Point], negative: tuple[int, int]) -> None:
        """Take a critical load between two rows into a branch, at which the number of unstable eigenvalues changes."""
        row = next((end for end in ends if end.load == event.load), None)
        point = row or self.at(at_load(self.solver, ends[0].x, event.load))
        assert event.cluster is not None
        frequency = event.omega2**0.5 if self.solver.system.scene.inertia.order == 1 else 0.0
        self._name(point, event.cluster, event.cluster.size - event.zeros, frequency)
        if event.kind == DIVERGENCE and (zero := point.negative - min(negative)) > 0:
            point.negative, point.zero = point.negative - zero, point.zero + zero
        special = SpecialPoint(event.kind, point, *negative, event.uncertainty, omega2=event.omega2)
        special.cluster, special.note = event.cluster, event.note
        if row is None:
            branch.points.append(point)
        self._special(branch, special)

    def _name(self, point: Point, cluster: Cluster, number: int, frequency: float) -> None:
        """Name the ``number`` of motions that meet at a point by all that a cluster does: their vectors are one.

        Of rates they have a ``frequency`` there.
        """
        name = self.eigensolver.at(point.x).motion(cluster.basis)
        there = cluster.mean + 1j * frequency
        distance = [abs(complex(value[0], abs(value[1])) - there) for value in point.omega2]
        for i in np.argsort(distance, kind="stable")[:number]:
            point.motion[i] = name

    def _special(self, branch: Branch, special: SpecialPoint) -> None:
        branch.special.append(special)
        self.observer.special(branch, special)

    def _error_bars(self, branch: Branch) -> None:
        """Estimate the errors of all special points."""
        with self.solver.system.clock.scope("error bars"):
            comm, warn, errors = self.solver.system.comm, self.observer.warn, SweepErrors(self.solver, self.span)
            for s in branch.special:
                with guard(f"No error of the {s.kind.words} at {s.point.load:.6g} was estimated", comm, warn):
                    errors.estimate(s)


class SweepErrors(Enriched):
    """Estimates the errors of special points of a sweep over a ``span`` of loads."""

    def __init__(self, solver: BranchSolver, span: tuple[float, float]) -> None:
        super().__init__(solver)
        self.span, self.units, self.eigensolver = span, solver.units, NonsymmetricSolver(self.system)
        self.part = halved(solver.system.fields.discretization.degree)

    def estimate(self, s: SpecialPoint) -> None:
        """Set all error bars of a special point, or none: then raises :class:`~rodfem.errors.ConvergenceError`."""
        point, rho, ordinate = s.point, self.part, self.solver.shape.ordinate
        guess = self.transfer(point.x, state=True)
        x = moved = at_load(self.solver, guess, point.load)
        of_ordinate = of_load = self.of_ordinate(point.x, x, round_off(point.ordinate, self.units.ordinate), rho)
        if s.cluster is not None:
            vectors = self.coarse.system.vectors(s.cluster.basis)
            columns = [self.transfer(v, state=False).array_r.real for v in vectors]
            cluster = Cluster(np.stack(columns, axis=1), s.cluster.mean)
            measured = Measuring(self.solver, self.eigensolver, guess)
            if s.kind == FLUTTER and self.system.scene.inertia.order == 2:
                load, left = self._flutter(measured, cluster, s)
            else:
                zeros = cluster.size - abs(s.negative_after - s.negative_before)
                mean = Mean(measured, cluster, zeros)
                load, left = zero_near(mean, mean.noise, point.load, self.units.load)
                left = max(left, s.located_to)
                if s.kind == FLUTTER:
                    s.omega2_error = bound(s.omega2, measured(load, cluster).frequency ** 2, ROUND_OFF * s.omega2, rho)
            of_load = max(bound(point.load, load, left, rho), s.located_to)
            low, high = sorted(self.span)  # into which the state goes on over the bar, up to half of the range
            step = min(of_load, (high - low) / 2) * (1.0 if point.load < (low + high) / 2 else -1.0)
            moved = at_load(self.solver, x, point.load + step)
            of_ordinate += abs(ordinate(moved) - ordinate(x))
        s.error_estimate, s.ordinate_error = of_load, of_ordinate  # none of them where one is not estimated
        s.bounds = cache(partial(derived, (self.coarse, self.solver), (point.x, x, moved - x), rho))

    def _flutter(self, measured: Measuring, cluster: Cluster, s: SpecialPoint) -> tuple[float, float]:
        """Flutter load on the richer discretisation and its uncertainty there; sets the error of the eigenvalue."""
        load, left, doubt = s.point.load, 0.0, 0.0
        if s.note:  # double there, whatever the mesh
            mu = measured(load, cluster).cluster.mean
        else:
            width = 0.01 * max(abs(load), abs(self.span[1] - self.span[0]))
            located = located_flutter(measured, cluster, load, width)
            load, left = located.load, located.uncertainty
            mu, doubt = located.cluster.mean, located.left + abs(located.drift) * located.uncertainty
        s.omega2_error = bound(s.omega2, mu, max(doubt, 10.0 * abs(mu) * ROUND_OFF), self.part)
        return load, left

"""Frequencies against the load for a rod under loads without a potential, and the loads at which they become unstable.

At each load the equilibrium is solved for, and the left-most eigenvalues ``mu = omega^2`` of its pencil are found
(:mod:`rodfem.diagram.frequency_rows`).  Where two real ones collide and become a complex pair, the square of half
their difference ``D = ((mu1 - mu2)/2)^2`` passes through zero.  Unlike the eigenvalues, which have a square root
there, ``D`` is a smooth function of the load: the discriminant of the pencil projected on the two of them.  Its zero
is found by Chebyshev interpolation, at spectral accuracy and without ever solving at the double eigenvalue.  Where a
single real one passes through zero the rod diverges: the eigenvalue itself is smooth there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from petsc4py import PETSc

from rodfem.adaptivity.error_estimate import bound, halved
from rodfem.adaptivity.inside import Inside
from rodfem.continuation.branch import FIRST_BRANCH, Branch, Point, SpecialPoint
from rodfem.continuation.eigenvalue_curves import Curves
from rodfem.continuation.flutter import AtLoad, locate_flutter, unmatched
from rodfem.continuation.interpolant import real_root, zero_uncertainty
from rodfem.continuation.kinds import DIVERGENCE, END, FLUTTER, USER, Kind
from rodfem.continuation.locate import SHARP
from rodfem.continuation.observer import Observer
from rodfem.continuation.prediction import ROWS, predict_at_load
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.first_name import name_of_first
from rodfem.diagram.frequency_rows import FREQUENCIES, NONE, SHIFT, FrequencyRows, Row, leftmost
from rodfem.diagram.plan import Plan
from rodfem.errors import ConvergenceError, SceneError
from rodfem.faults import as_failure, without
from rodfem.fem.transfer import Transfer, richer_system
from rodfem.roots import zero_between
from rodfem.stability.cluster import Cluster, Measured, as_vectors, cluster_of, measure
from rodfem.stability.frequencies import MULTIPLE, REAL, Frequencies
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.stability.rank import require_independent_constraints
from rodfem.tolerances import ROUND_OFF, round_off, unit

LOADS = 101
"""Number of loads at which a range is sampled."""
SAME = 1e-9
"""Loads, or eigenvalues, that differ by less than this, relative to them, are one."""
DRIVEN = 1e-7
"""Drift, over the rod's lowest bending eigenvalue, above which loads drive a motion that nothing holds."""
MEAN = 10.0
"""Most that the mean of two eigenvalues that meet changes by, relative to it, over the relative change of the load."""
BESIDE = 1e-4
"""Relative distance of the first two loads of a secant method."""
AROUND = 1e-4
"""Half width, relative to a divergence load, over which its eigenvalues are sampled."""
TOGETHER = 1e-6
"""Divergence loads that differ by less than this, relative, are those of a multiple eigenvalue with its round-off."""


@dataclass
class _Event:
    """A special point between two loads, before it is evaluated: by how much ``change`` of the unstable eigenvalues."""

    kind: Kind
    load: float
    change: int
    uncertainty: float
    omega2: float
    cluster: Cluster | None = None
    note: str = ""


class Sweep:
    """Sweeps the load of a scene over a range from its start state; used like the explorer of conservative scenes."""

    def __init__(self, solver: StaticSolver, plan: Plan, observer: Observer, finished: Callable[[], None]) -> None:
        """Allocate the pencil; the plan must have passed its check.

        ``solver`` has the mesh, the ``observer`` hears of the progress, ``finished()`` is called when the sweep is
        complete.  The ``plan`` names the loads.
        """
        self.solver, self.plan, self.observer, self.finished = solver, plan, observer, finished
        self.span, self.units = plan.over(solver.system.scene), solver.system.scene.units
        self.eigensolver = NonsymmetricSolver(solver.system)
        self.number = plan.spectrum or FREQUENCIES
        self.rows = FrequencyRows(self.eigensolver, self.number)
        self.curves = Curves(solver.system.comm)
        self.last: Row | None = None
        self.latest: list[Point] = []
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
                self._sweep(branch)
            branch.ended = "end of range"
        except ConvergenceError as trouble:
            if not branch.points:
                raise
            branch.ended = f"no convergence: {trouble}"
            self.observer.warn(str(trouble))
        last = branch.points[-1]
        branch.special.append(self.solver.given(END, last))
        branch.renumber()
        warn = self.observer.warn
        if self.plan.error_bars:
            with without("No errors were estimated", comm, warn):
                self._error_bars(branch)
        self.observer.finished(branch)
        with without("The asymmetry of the tangent matrix was not measured", comm, warn):
            self._asymmetry(last)
        self.finished()
        return self.branches

    def _sweep(self, branch: Branch) -> None:
        """Compute the points of a branch, load by load, and the special points between them."""
        a, b = self.span
        loads = np.unique([*np.linspace(a, b, LOADS), *self.plan.at])
        loads = loads if a < b else loads[::-1]
        x, _ = self.solver.first(a)
        branch.name = name_of_first(self.solver.shape, [x, self.solver.at_load(x, float(loads[1]))[0]])
        self.observer.branch(branch)
        if self.solver.system.scene.constraints:  # others are independent
            require_independent_constraints(self.solver.system, x)
        x = at_load(self.solver, x, float(loads[0]))
        if words := self.rows.first(x):
            self.observer.warn(
                f"The eigenvalues omega^2 of the first state are not well defined ({words}): do not trust any of this "
                "sweep. Constraints may follow from others, or sizes of the rod's numbers may be too far apart."
            )
        for motion in self.solver.system.free_motions(x):
            self.observer.note(f"  nothing holds the rod against the {motion}: its frequency, zero, is left out")
        try:
            for load in loads.tolist():
                self.latest = [*self.latest[1 - ROWS :], self._point(self._next(load, x))]
                for notice in self.solver.notices():
                    self.observer.warn(notice)
                self._take(branch, self.rows.add(self.latest[-1]))
        finally:  # also where there is no equilibrium, or at an interrupt: nothing that has been computed is lost
            self._take(branch, self.rows.finish())

    def _next(self, load: float, first: PETSc.Vec) -> PETSc.Vec:
        """Equilibrium at the next ``load``, predicted by the last ones; the ``first`` one where there are none."""
        if not self.latest:
            return first
        x, outcome = self.solver.at_load(predict_at_load(self.solver.system, self.latest, load), load, nearby=True)
        if not outcome.converged:
            return at_load(self.solver, self.latest[-1].x, load)
        require_held(self.solver, x)
        return x

    def _take(self, branch: Branch, rows: list[Row]) -> None:
        """Take rows of the grid into a branch, and the special points before each."""
        for row in rows:
            point, before, self.last = row.point, self.last, row
            self._record(point, row.found, on_the_way=True)
            if before is not None:
                self._between(branch, before, row)
            branch.points.append(point)
            if point.load in self.plan.at:
                self._special(branch, self.solver.given(USER, point))
            self.observer.progress(branch, point)

    def _asymmetry(self, last: Point) -> None:
        """Say what the load does to the tangent matrix at the last point."""
        rank, size = self.eigensolver.at(last.x).asymmetry()
        self.observer.note(
            f"  the load makes the tangent matrix non-symmetric by a matrix of rank {rank} "
            f"(largest entry {size:.1e} of |S|)"
        )

    def at(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of an equilibrium that is not on the way of the sweep."""
        point, before = self._point(x), NONE if self.last is None else self.last.found
        self._record(point, leftmost(self.eigensolver.at(x), self.number, before), on_the_way=False)
        return point

    def _point(self, x: PETSc.Vec) -> Point:
        """Evaluate the records of the equilibrium ``x``, but for those of its frequencies."""
        solver, load = self.solver, self.solver.system.scalar(x)
        return Point(
            x=x,
            tangent=None,
            arclength=abs(load - self.span[0]),
            load=load,
            ordinate=solver.shape.ordinate(x),
            energy=solver.energy(x),
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
        point.zero += int((abs(values) < REAL * self.units.omega2).sum())
        point.omega2 = [[float(v.real), float(v.imag)] for v in values[: self.number]]
        point.motion = list(found.kinds[: self.number])
        point.curve = self.curves.numbers(found, keep=on_the_way)[: self.number]

    def _between(self, branch: Branch, first: Row, second: Row) -> None:
        """Locate what happens between two loads: eigenvalues that collide, and real ones that pass through zero."""
        (a, before), (b, after) = ((row.point, row.found) for row in (first, second))
        with self.solver.system.clock.scope("location"):
            events = self._collisions(a, b, before, after)
            real = [f.diverged() for f in (before, after)]
            for event in events:
                if event.omega2 < 0:  # both are unstable before and after, but fewer are real
                    real[0] -= event.change
                    event.change = 0
            events += self._diverging(a, b, *real)
        events.sort(key=lambda e: abs(e.load - a.load))
        negative = a.negative
        for i, event in enumerate(events):
            point = a if event.load == a.load else b if event.load == b.load else None
            point = point or self.at(at_load(self.solver, a.x, event.load))
            after_it = negative + event.change
            if i == len(events) - 1 and all(e.kind == FLUTTER for e in events):
                after_it = b.negative  # of all eigenvalues that are recorded
            if event.cluster is not None:
                self._name(point, event.cluster)
            special = SpecialPoint(event.kind, point, negative, after_it, event.uncertainty, omega2=event.omega2)
            special.cluster, special.note = event.cluster, event.note
            if point is not a and point is not b:
                branch.points.append(point)
            self._special(branch, special)
            negative = after_it

    def _name(self, point: Point, cluster: Cluster) -> None:
        """Name the motions of the eigenvalues that collide at a point by all that they do: their vectors are one."""
        name = self.eigensolver.at(point.x).motion(cluster.basis)
        distance = [abs(complex(*value) - cluster.mean) for value in point.omega2]
        for i in np.argsort(distance, kind="stable")[: cluster.size]:
            point.motion[i] = name

    def _collisions(self, a: Point, b: Point, before: Frequencies, after: Frequencies) -> list[_Event]:
        """Collisions between two loads, those at one and the same load together."""
        events: list[_Event] = []
        for here, there, found, others, sign in ((b, a, after, before, 1), (a, b, before, after, -1)):
            for chosen in unmatched(found, others.values):
                try:
                    event = self._collision(here, there, found, chosen)
                except ConvergenceError as trouble:
                    value = found.values[chosen[0]]
                    self.observer.warn(
                        f"The eigenvalue {value:.6g} at {self._load} = {here.load:.6g} was not "
                        f"followed to where it becomes complex ({str(trouble).rstrip('.')}): use a smaller range."
                    )
                    continue
                if event is None:
                    continue
                event.change *= sign
                same = [e for e in events if abs(e.load - event.load) < SAME * unit(e.load, one=self.units.load)]
                if same:
                    same[0].change += event.change
                    if abs(event.omega2) < abs(same[0].omega2):
                        same[0].omega2, same[0].cluster = event.omega2, event.cluster
                else:
                    events.append(event)
        return events

    def _collision(self, here: Point, there: Point, found: Frequencies, chosen: list[int]) -> _Event | None:
        """Collision, on the way ``there``, of eigenvalues complex ``here``; None where they are complex there too."""
        cluster = cluster_of(self.eigensolver.at(here.x), found, chosen)
        other = measure(self.eigensolver.at(there.x), cluster)
        scale = abs(other.values).max()
        if abs(other.discriminant) < (MULTIPLE * scale) ** 2:
            side = ">" if here.load > there.load else "<"
            note = (
                f"the frequencies are double at {self._load} = {there.load:.6g} and become complex at once: "
                f"flutter at every {self._load} {side} {there.load:.6g} next to it"
            )
            floor = round_off(there.load, self.units.load)
            return _Event(FLUTTER, there.load, cluster.size, floor, other.cluster.mean, other.cluster, note)
        if other.discriminant < 0:
            return None
        located = locate_flutter(
            self._measured(self.solver, self.eigensolver, here.x),
            cluster,
            (there.load + here.load) / 2,
            abs(here.load - there.load),
        )
        return _Event(FLUTTER, located.load, cluster.size, located.uncertainty, located.cluster.mean, located.cluster)

    @staticmethod
    def _measured(solver: StaticSolver, eigensolver: NonsymmetricSolver, guess: PETSc.Vec) -> AtLoad:
        """How a cluster is measured at a load: at the equilibrium near ``guess``."""

        def measured(load: float, cluster: Cluster) -> Measured:
            return measure(eigensolver.at(at_load(solver, guess, load)), cluster)

        return measured

    def _diverging(self, a: Point, b: Point, first: int, last: int) -> list[_Event]:
        """Locate the loads at which real eigenvalues pass through zero, from ``first`` negative ones to ``last``."""
        loads = sorted((a.load, b.load))
        found: list[float] = []
        for number in range(min(first, last), max(first, last)):

            def mu(load: float, number: int = number) -> float:
                return self._real(a.x, load)[number]

            try:
                found.append(zero_between(mu, loads[0], loads[1], ROUND_OFF * max(map(abs, loads))))
            except (ConvergenceError, IndexError, ValueError):
                self.observer.warn(
                    f"Divergence between {a.load:.6g} and {b.load:.6g} could not be located: use a smaller range."
                )
                return []
        together: list[list[float]] = []
        for load in sorted(found):
            if together and abs(load - together[-1][0]) < TOGETHER * unit(load, one=self.units.load):
                together[-1].append(load)
            else:
                together.append([load])
        return [self._divergence(a.x, group, 1 if last > first else -1) for group in together]

    def _divergence(self, guess: PETSc.Vec, loads: list[float], sign: int) -> _Event:
        """Divergence of as many eigenvalues as ``loads``, where their mean, which is smooth, is zero."""
        pencil, number = self.eigensolver.at(at_load(self.solver, guess, loads[0])), len(loads)
        found = pencil.near(number + 2, SHIFT * self.units.omega2)
        cluster = cluster_of(pencil, found, np.argsort(abs(found.values), kind="stable")[:number].tolist())
        load, uncertainty = _zero_between(
            self._measured(self.solver, self.eigensolver, guess), cluster, loads[0], self.units.load
        )
        uncertainty = max(uncertainty, abs(loads[-1] - loads[0]), SHARP * unit(load, one=self.units.load))
        return _Event(DIVERGENCE, load, sign * number, uncertainty, 0.0, cluster)

    def _real(self, guess: PETSc.Vec, load: float) -> list[float]:
        """Real eigenvalues at a load near the origin, in ascending order."""
        pencil = self.eigensolver.at(at_load(self.solver, guess, load))
        before = NONE if self.last is None else self.last.found
        return sorted(v.real for v in leftmost(pencil, self.number, before).values if v.imag == 0)

    def _special(self, branch: Branch, special: SpecialPoint) -> None:
        branch.special.append(special)
        self.observer.special(branch, special)

    def _error_bars(self, branch: Branch) -> None:
        with self.solver.system.clock.scope("error bars"):
            system = self.solver.system
            richer = StaticSolver(richer_system(system))
            eigensolver, transfer = NonsymmetricSolver(richer.system), Transfer(system, richer.system)
            rho, inside = halved(system.fields.discretization.degree), Inside(self.solver.shape, richer.shape)
            for s in branch.special:
                point = s.point
                guess = transfer(point.x, state=True)
                x = at_load(richer, guess, point.load)
                left = round_off(point.ordinate, self.units.ordinate)
                again, about = richer.shape.ordinate(x), inside.change(point.x, x)
                s.ordinate_error = s.error_estimate = bound(point.ordinate, again, left, rho, about)
                if s.kind == FLUTTER:
                    load, left, mu = self._richer_flutter(richer, eigensolver, transfer, guess, s)
                    s.error_estimate = max(bound(point.load, load, left, rho), s.located_to)
                    relative = left / max(abs(load), abs(self.span[1] - self.span[0]) * ROUND_OFF)
                    s.omega2_error = bound(s.omega2, mu, MEAN * abs(mu) * max(relative, ROUND_OFF), rho)
                elif s.kind == DIVERGENCE:
                    measured, cluster = self._measured(richer, eigensolver, x), self._transferred(transfer, s)
                    load = _zero(measured, cluster, point.load, self.units.load)
                    s.error_estimate = max(bound(point.load, load, s.located_to, rho), s.located_to)
                if s.kind in (FLUTTER, DIVERGENCE):
                    s.ordinate_error += self._moved(richer, x, s)
                asked = self.plan.accuracy
                if asked is not None and s.error_estimate > asked * unit(s.point.load, one=self.units.load):
                    s.note = s.note or f"accuracy {asked:g} not reached"

    def _moved(self, richer: StaticSolver, x: PETSc.Vec, s: SpecialPoint) -> float:
        """Change of the ordinate, on the ``richer`` mesh, over the error bar of a special point's load, where ``x`` is.

        Of a bar wider than half of the range no more is asked for.
        """
        low, high = sorted(self.span)
        step = min(s.error_estimate, (high - low) / 2) * (1.0 if s.point.load < (low + high) / 2 else -1.0)
        beside = at_load(richer, x, s.point.load + step)
        return abs(richer.shape.ordinate(beside) - richer.shape.ordinate(x))

    def _transferred(self, transfer: Transfer, s: SpecialPoint) -> Cluster:
        """The cluster of a special point on another discretisation."""
        assert s.cluster is not None
        columns = [transfer(v, state=False).array_r.real for v in as_vectors(self.solver.system, s.cluster.basis)]
        return Cluster(np.stack(columns, axis=1), s.cluster.mean)

    def _richer_flutter(
        self,
        richer: StaticSolver,
        eigensolver: NonsymmetricSolver,
        transfer: Transfer,
        guess: PETSc.Vec,
        s: SpecialPoint,
    ) -> tuple[float, float, float]:
        """Flutter load on the richer discretisation, its uncertainty there, and the double eigenvalue."""
        measured, cluster = self._measured(richer, eigensolver, guess), self._transferred(transfer, s)
        if s.note:  # double there, whatever the mesh
            return s.point.load, 0.0, measured(s.point.load, cluster).cluster.mean
        width = max(0.05 * abs(s.point.load), 0.01 * abs(self.span[1] - self.span[0]))
        located = locate_flutter(measured, cluster, s.point.load, width)
        return located.load, located.uncertainty, located.cluster.mean


def at_load(solver: StaticSolver, guess: PETSc.Vec, load: float) -> PETSc.Vec:
    """Equilibrium at a load from a ``guess`` nearby; raises :class:`ConvergenceError` where there is none.

    Raises :class:`SceneError` where a load drives a motion that nothing holds.
    """
    x, outcome = solver.at_load(guess, load)
    if not outcome.converged:
        raise ConvergenceError(f"No equilibrium at {solver.system.scene.load} = {load:g}: use a smaller range.")
    require_held(solver, x)
    return x


def require_held(solver: StaticSolver, x: PETSc.Vec) -> None:
    """Raise :class:`SceneError` where the loads of a state ``x`` drive a motion that nothing holds."""
    system = solver.system
    if system.drift(x) > DRIVEN * system.stiffness_scale:
        raise SceneError(
            f"There is no equilibrium at {system.scene.load} = {system.scalar(x):g}: nothing holds the rod against the "
            f"{' or the '.join(system.free_motions(x))}, and the loads drive it; hold that motion at one end, or "
            "balance the loads."
        )


def _zero_between(measured: AtLoad, cluster: Cluster, load: float, one: float) -> tuple[float, float]:
    """Load near ``load`` at which the mean of a cluster vanishes, and what round-off of the mean leaves open.

    The mean is sampled over :data:`AROUND`, and interpolated: its scatter shows in the last coefficients.
    """
    half = AROUND * unit(load, one=one)
    nodes = np.cos(np.pi * (np.arange(6)[::-1] + 0.5) / 6)
    series = chebyshev.chebfit(nodes, [measured(load + half * t, cluster).cluster.mean for t in nodes.tolist()], 5)
    root = real_root(series, 0.0)
    if root is None:
        raise ConvergenceError(f"The divergence load near {load:.6g} could not be located: use a smaller range.")
    return load + half * root, half * zero_uncertainty(series, root)


def _zero(measured: AtLoad, cluster: Cluster, load: float, one: float) -> float:
    """Load near ``load``, of natural size ``one``, at which the mean of the eigenvalues of a cluster vanishes."""
    from scipy.optimize import newton  # slow to load

    def mean(load: float) -> float:
        return measured(load, cluster).cluster.mean

    return float(newton(mean, load, x1=load + BESIDE * unit(load, one=one), tol=round_off(load, one)))

"""Loads of flutter and of divergence between two loads of a sweep.

Where two real ones collide and become a complex pair, the square of half
their difference ``D = ((mu1 - mu2)/2)^2`` passes through zero.  Unlike the eigenvalues, which have a square root
there, ``D`` is a smooth function of the load: the discriminant of the pencil projected on the two of them.  Its zero
is found by Chebyshev interpolation, at spectral accuracy and without ever solving at the double eigenvalue.  Where a
single real one passes through zero the rod diverges: the eigenvalue itself is smooth there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from rodfem.continuation.complex_pairs import strange
from rodfem.continuation.interpolant import SHARP
from rodfem.continuation.kinds import DIVERGENCE
from rodfem.continuation.static_solver import StaticSolver
from rodfem.diagram.collisions import Collisions, Critical, Measuring, Told
from rodfem.diagram.divergence_loads import Mean, interpolated_zero
from rodfem.diagram.frequency_rows import Row, leftmost
from rodfem.diagram.held import at_load
from rodfem.diagram.hidden_events import HiddenEvents, signature
from rodfem.diagram.side import Side
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.stability.cluster import cluster_of
from rodfem.stability.finite_pairs import SHIFT
from rodfem.stability.frequencies import REAL, Frequencies
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, unit

PARTS, PART = 16, 0.47
"""Times that a step is parted, at most, and where: not in its middle, at which a step is likely to be special."""
PATIENCE = 3
"""Steps of a sweep that are not clear, whatever is tried, after which no other one is parted."""
SMALL = 1e-3
"""Change of negative eigenvalues, relative, that takes none of them to zero."""
CLEAR = 1e-4
"""Distance from a collision, relative to a step of the sweep, at which its eigenvalues are counted: they are apart."""
TOGETHER = 1e-6
"""Divergence loads that differ by less than this, relative, are those of a multiple eigenvalue with its round-off."""


class CriticalLoads:
    """Locates the critical loads between two loads of a sweep."""

    def __init__(
        self, solver: StaticSolver, eigensolver: NonsymmetricSolver, number: int, warn: Callable[[str], None]
    ) -> None:
        """Know what computes equilibria (``solver``) and their ``number`` of eigenvalues, and whom to ``warn``.

        The ``eigensolver`` is that of the pencils.
        """
        self.solver, self.eigensolver, self.number, self.warn = solver, eigensolver, number, warn
        self.units, self._load = solver.system.scene.units, solver.system.scene.load
        self.collisions, self._still, self._parted = Collisions(solver, eigensolver), 0, 0
        self.hidden = HiddenEvents(lambda x: Measuring(solver, eigensolver, x))
        self._last: Side | None = None
        self._unclear = 0

    def between(self, first: Row, second: Row) -> Told:
        """What happens between two rows, in its order: eigenvalues that collide, real ones that pass through zero.

        Where the rows are neighbours, ``first`` comes before ``second`` in the sweep.  A step in which not all is
        clear is parted.  What is not clear then is said.
        """
        a, b = (Side(row.point.load, row.point.x, row.found) for row in (first, second))
        self._before, self._still = b.found, min(a.found.still(), b.found.still())
        self._parted = 0
        told, self._last = self._hidden(self._last, a, b), a
        self._unclear += bool(told.doubts)
        for words in dict.fromkeys(told.doubts):
            self.warn(words)
        told.events.sort(key=lambda e: abs(e.load - a.load))
        return told

    def _hidden(self, last: Side | None, a: Side, b: Side) -> Told:
        """What happens in a step, also what comes and goes in it or at its first load, as the ``last`` side suggests.

        Nothing does in the step between that one and this.
        """
        told = self._told(a, b)
        if told.doubts:
            return told
        return self._beside(told, a, b) if told.events else self._quiet(told, last, a, b)

    def _quiet(self, told: Told, last: Side | None, a: Side, b: Side) -> Told:
        """The same of a step of which no events are ``told``."""
        before, here, after = (None if side is None else signature(side.found) for side in (last, a, b))
        try:
            if last is not None and here != after == before:
                told.doubts += [self._near_at(a.load)] if self.hidden.at_row(a, last) else []
            if here != after:
                return told
            if last is None or last.load == a.load or before != here:
                last = self._side(a, a.load + PART * (b.load - a.load))
                if signature(last.found) != here:
                    return self._told(a, last).and_then(self._told(last, b))
            for load in self.hidden.between(last, a, b):
                middle = self._side(a, load)
                told = self._told(a, middle).and_then(self._told(middle, b))
                if not told.events and not told.doubts:
                    told.doubts.append(self._near_at(load))
                return told
        except ConvergenceError as trouble:
            told.doubts.append(self._unknown(a.load, b.load, trouble))
        return told

    def _beside(self, told: Told, a: Side, b: Side) -> Told:
        """What happens in a step, also what comes and goes on either side of the events that were ``told`` of it."""
        for low, high in self._pieces(a, b, [event.load for event in told.events]):
            ends = [side if load == side.load else None for side, load in ((a, low), (b, high))]
            try:
                first, last = (end or self._side(a, load) for end, load in zip(ends, (low, high), strict=True))
            except ConvergenceError as trouble:
                told.doubts.append(self._unknown(low, high, trouble))
                continue
            self.hidden.forget()
            more = self._quiet(Told(), None, first, last)
            if sum(event.change for event in more.events) == 0:
                told = told.and_then(replace(more, entered=0))
        self.hidden.forget()
        return told

    def _unknown(self, low: float, high: float, trouble: ConvergenceError) -> str:
        """Words for two loads between which something may come and go, for a reason."""
        return (
            f"Whether frequencies meet, and part again, between {self._load} = {low:.6g} and {high:.6g} is not known "
            f"({str(trouble).rstrip('.')})."
        )

    def _near_at(self, load: float) -> str:
        """Words for a load at which something may come and go at once."""
        return (
            f"Two frequencies come so near one another at {self._load} = {load:.8g}, or one so near zero, that "
            "whether they meet there, and part again, is not known."
        )

    def _told(self, a: Side, b: Side) -> Told:
        """What happens in a step, which is parted where not all of it is clear."""
        told = self._whole(a, b)
        if not told.doubts or self._parted >= (PARTS if self._unclear < PATIENCE else 0):
            return told
        self._parted += 1
        try:
            middle = self._side(a, a.load + PART * (b.load - a.load))
        except ConvergenceError:
            return told
        return self._told(a, middle).and_then(self._told(middle, b))

    def _side(self, a: Side, load: float) -> Side:
        """A load of a step that begins at a side: the equilibrium, and what is found there."""
        x = at_load(self.solver, a.x, load)
        return Side(load, x, leftmost(self.eigensolver.at(x), self.number, self._before))

    def _whole(self, a: Side, b: Side) -> Told:
        """What happens in a step that is not parted."""
        told = self.collisions.between(a, b)
        negative = [event for event in told.events if event.omega2 < 0]
        left = sum(event.change for event in negative)
        for event in negative:  # both are unstable before and after
            event.change = 0
        known, passed = {a.load: a.found, b.load: b.found}, 0
        for piece in self._pieces(a, b, [event.load for event in negative]):
            first, last = ((known[x] if x in known else self._near(a.x, x)).diverged() for x in piece)
            told = told.and_then(self._diverging(a.x, piece, first, last))
            passed += last - first
        if a.found.diverged() + passed - left != b.found.diverged() and not told.doubts:
            told.doubts.append(
                f"Between {self._load} = {a.load:.6g} and {b.load:.6g} the number of negative eigenvalues changes from "
                f"{a.found.diverged()} to {b.found.diverged()}, which what was found does not explain: use a smaller "
                "range."
            )
        if not negative and not told.doubts and self._exchanged(a.found, b.found):
            told.doubts.append(
                f"Whether eigenvalues that are negative at {self._load} = {a.load:.6g} and at {b.load:.6g} are the "
                "same ones, or some pass through zero between them, others back, is not known: use a smaller range."
            )
        return told

    def _exchanged(self, before: Frequencies, after: Frequencies) -> bool:
        """Whether other eigenvalues may be negative after a step than before, by vectors.

        Near rigid motions vectors are round-off.  What passes through zero in a small part of a step changes all the
        same by as much as it is.
        """
        mine, others = before.negative(), after.negative()
        if not strange(self.solver.system.comm, before, after, mine, others):
            return False
        if not self._parted or len(mine) != len(others):
            return True
        a, b = before.values[mine].real, after.values[others].real
        return bool((abs(a - b) > SMALL * abs(a)).any())

    @staticmethod
    def _pieces(a: Side, b: Side, between: list[float]) -> list[tuple[float, float]]:
        """Ranges of the load between ``a`` and ``b``, in their order, without the loads ``between`` them.

        Where two negative eigenvalues collide, fewer are real on one side: what passes through zero has another number
        in ascending order.
        """
        width, edges = b.load - a.load, [a.load]
        for load in sorted(between, key=lambda x: abs(x - a.load)):
            edges += [load - CLEAR * width, load + CLEAR * width]
        edges.append(b.load)
        return [(x, y) for x, y in zip(edges[::2], edges[1::2], strict=True) if (y - x) * width > 0]

    def _diverging(self, guess: PETSc.Vec, span: tuple[float, float], first: int, last: int) -> Told:
        """Locate the loads at which real eigenvalues pass through zero, from ``first`` negative ones to ``last``.

        At the loads of the ``span``, in the order of the sweep, so many are negative.
        """
        loads = sorted(span)
        found: list[float] = []
        for number in range(min(first, last), max(first, last)):

            def mu(load: float, number: int = number) -> float:
                return self._real(guess, load)[number]

            try:
                found.append(self._zero(mu, loads[0], loads[1], self._near(guess, loads[0]).noise))
                ends = min(abs(mu(loads[0])), abs(mu(loads[1])))
                beyond = abs(mu(found[-1])) > max(ends, self.units.omega2)
            except (ConvergenceError, IndexError, ValueError):
                words = f"Divergence between {span[0]:.6g} and {span[1]:.6g} could not be located: use a smaller range."
                return Told(doubts=[words])
            if beyond:  # a pole: of a rod whose mass is all at a few points, where these do not move
                words = (
                    f"At {self._load} = {found[-1]:.8g} an eigenvalue changes its sign through infinity, not zero: the "
                    "motion there has no inertia; give the rod a mass along it."
                )
                return Told(doubts=[words])
        together: list[list[float]] = []
        for load in sorted(found):
            if together and abs(load - together[-1][0]) < TOGETHER * unit(load, one=self.units.load):
                together[-1].append(load)
            else:
                together.append([load])
        out = Told()
        for group in together:
            try:
                out.events.append(self._divergence(guess, group, loads, 1 if last > first else -1))
            except ConvergenceError as trouble:
                out.doubts.append(str(trouble))
        return out

    def _zero(self, mu: Callable[[float], float], low: float, high: float, noise: float) -> float:
        """Load at which ``mu`` vanishes: a bound where it does there but for ``noise``: its sign says nothing then."""
        for load in (low, high):
            if abs(mu(load)) <= min(noise, REAL * self.units.omega2):
                return load
        return zero_between(mu, low, high, ROUND_OFF * max(abs(low), abs(high)))

    def _divergence(self, guess: PETSc.Vec, loads: list[float], bounds: list[float], sign: int) -> Critical:
        """Divergence of as many eigenvalues as ``loads``, where their mean, which is smooth, is zero.

        Those that are zero at all loads are among them: there they are not told apart, and they add nothing.  The load
        is within ``bounds``.
        """
        pencil, number = self.eigensolver.at(at_load(self.solver, guess, loads[0])), len(loads)
        size = number + self._still
        found = pencil.near(size + 2, SHIFT * self.units.omega2)
        cluster = cluster_of(pencil, found, np.argsort(abs(found.values), kind="stable")[:size].tolist())
        mean = Mean(Measuring(self.solver, self.eigensolver, guess), cluster, self._still)
        load, uncertainty = interpolated_zero(mean, loads[0], self.units.load)
        uncertainty = max(uncertainty, abs(loads[-1] - loads[0]), SHARP * unit(load, one=self.units.load))
        inside = min(max(load, bounds[0]), bounds[1])
        load, uncertainty = inside, uncertainty + abs(load - inside)
        return Critical(DIVERGENCE, load, sign * number, uncertainty, 0.0, cluster, still=self._still)

    def _real(self, guess: PETSc.Vec, load: float) -> list[float]:
        """Real eigenvalues at a load near the origin, in ascending order, but for those that are zero at all loads."""
        real = [v.real for v in self._near(guess, load).values if v.imag == 0]
        return sorted(sorted(real, key=abs)[self._still :])

    def _near(self, guess: PETSc.Vec, load: float) -> Frequencies:
        """Eigenvalues at a load near the origin, and what became of the complex ones after it."""
        return leftmost(self.eigensolver.at(at_load(self.solver, guess, load)), self.number, self._before)

"""Loads of flutter and of divergence between two loads of a sweep, from all eigenvalues at both.

Where two real ones collide and become a complex pair, the square of half their difference ``D = ((mu1 - mu2)/2)^2``
passes through zero.  Unlike the eigenvalues, which have a square root there, ``D`` is a smooth function of the load:
the discriminant of the pencil projected on the two of them.  Its zero is found by Chebyshev interpolation, at spectral
accuracy and without ever solving at the double eigenvalue.  Where a single real one passes through zero the rod
diverges: the eigenvalue itself is smooth there.

A step in which what is found does not explain the numbers at both ends is parted.  So is one in which eigenvalues may
meet and part again (:mod:`rodfem.diagram.meetings`).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.flutter import SHARP
from rodfem.continuation.kinds import DIVERGENCE
from rodfem.diagram.collisions import (
    Collisions,
    Critical,
    Findings,
    Mean,
    Measuring,
    Side,
    cluster_at,
    interpolated_zero,
    others_negative,
)
from rodfem.diagram.equilibria import at_load
from rodfem.diagram.meetings import Meeting, meetings
from rodfem.errors import ConvergenceError
from rodfem.roots import zero_between
from rodfem.stability.cluster import measure, noise_of
from rodfem.stability.nonsymmetric import NonsymmetricSolver
from rodfem.tolerances import ROUND_OFF, unit

PARTS, PART = 16, 0.47
"""Times that a step is parted, at most, and where: not in its middle, which is likely to be special."""
PATIENCE = 3
"""Steps of a sweep that are not clear, whatever is tried, after which no other one is parted."""
SMALL = 1e-3
"""Change of negative eigenvalues, relative, that takes none of them to zero."""
CLEAR = 1e-4
"""Distance from a collision, relative to a step of the sweep, at which its eigenvalues are counted: they are apart."""
TOGETHER = 1e-6
"""Divergence loads that differ by less than this, relative, are those of a multiple eigenvalue with its round-off."""
NEARER, CLOSEST, NEAR = 10, 1e-6, 1e-2
"""Loads at which a meeting is looked for, at most, their least distance, over a step, and that of the meeting found."""
SAME = 1e-2
"""Change of the mean of eigenvalues, relative, within which they are the same ones at a load nearby."""


class CriticalLoads:
    """Locates the critical loads between two loads of a sweep."""

    def __init__(self, solver: BranchSolver, eigensolver: NonsymmetricSolver, warn: Callable[[str], None]) -> None:
        """Take equilibria and their eigenvalues from the solvers; ``warn`` gets sentences on what is not clear."""
        self.solver, self.eigensolver, self.warn = solver, eigensolver, warn
        self.units, self._load = solver.system.scene.units, solver.system.scene.load
        self.collisions, self._still, self._parted, self._unclear = Collisions(solver, eigensolver), 0, 0, 0
        self._ahead = list[Meeting]()  # parts of the next step at which eigenvalues may meet

    def between(self, a: Side, b: Side, behind: Side | None, still: int) -> Findings:
        """What happens between two rows, ``a`` and ``b``, in its order: collisions, and real ones that vanish.

        Steps are given one after the other, each with the row ``behind`` it; ``still`` eigenvalues are zero at all
        loads.
        """
        self._still, self._parted = still, 0
        findings, sides = Findings(), [a]
        for side in [*self._met(findings, a, b, behind), b]:
            findings += self._parted_step(sides[-1], side)
            sides.append(side)
        self._unclear += bool(findings.doubts)
        for words in dict.fromkeys(findings.doubts):
            self.warn(words)
        findings.events.sort(key=lambda e: abs(e.load - a.load))
        return findings

    def _met(self, findings: Findings, a: Side, b: Side, behind: Side | None) -> list[Side]:
        """Loads of a step at which eigenvalues come nearest to one another, or to zero, and may meet; in its order."""
        ahead, self._ahead, width = self._ahead, [], b.load - a.load
        found, reach = (_meetings(a, b, behind), behind.load - b.load) if behind else ([], 0.0)
        for m in found:
            if abs(m.t) < CLOSEST:
                self._examine(findings, b, m.places)
            elif m.t < 0.0:
                ahead.append(m._replace(t=1.0 + m.t * reach / width))
            else:
                self._ahead.append(m)
        out = [a]
        for m in sorted(ahead):
            load = a.load + m.t * width
            if min(abs(load - side.load) for side in (*out, b)) > CLOSEST * abs(width):
                try:
                    out.append(self._nearest(findings, out[-1], b, m._replace(t=load)))
                except ConvergenceError as trouble:
                    findings.doubts.append(
                        f"Whether frequencies meet, and part again, between {self._load} = {a.load:.6g} and "
                        f"{b.load:.6g} is not known ({str(trouble).rstrip('.')})."
                    )
        return out[1:]

    def _nearest(self, findings: Findings, a: Side, b: Side, meeting: Meeting) -> Side:
        """Where the eigenvalues of a ``meeting``, about its load ``t``, are nearest, or a load where they met."""
        low, high, mine = a, b, self._side(a, meeting.t)
        for _ in range(NEARER):
            if mine.spectrum.numbers != a.spectrum.numbers:
                return mine
            move = _move(low, mine, high, meeting.mean)
            if abs(move) < CLOSEST * abs(b.load - a.load):
                break
            low, high = (mine, high) if move * (b.load - a.load) > 0.0 else (low, mine)
            mine = self._side(mine, mine.load + move)
        for m in _meetings(a, mine, b):
            if abs(m.t) < NEAR:
                self._examine(findings, mine, m.places)
        return mine

    def _examine(self, findings: Findings, side: Side, places: list[int]) -> None:
        """Say that eigenvalues may meet at a side where round-off leaves that open."""
        pencil = self.eigensolver.at(side.x)
        cluster = cluster_at(pencil, side.spectrum, places)
        if len(places) == 1:
            value, noise = cluster.mean, 2.0 * side.spectrum.zero
        else:
            here = measure(pencil, cluster)
            value, noise = here.discriminant, noise_of(pencil, here).of_discriminant
        if abs(value) <= noise:
            findings.doubts.append(
                f"Two frequencies come so near one another at {self._load} = {side.load:.8g}, or one so near zero, "
                "that whether they meet there, and part again, is not known."
            )

    def _parted_step(self, a: Side, b: Side) -> Findings:
        """What happens in a step, which is parted where not all of it is clear."""
        findings = self._whole(a, b)
        if not findings.doubts or self._parted >= (PARTS if self._unclear < PATIENCE else 0):
            return findings
        self._parted += 1
        try:
            middle = self._side(a, a.load + PART * (b.load - a.load))
        except ConvergenceError:
            return findings
        return self._parted_step(a, middle) + self._parted_step(middle, b)

    def _side(self, a: Side, load: float) -> Side:
        """A load of a step that begins at a side: the equilibrium, and its eigenvalues."""
        x = at_load(self.solver, a.x, load)
        return Side(load, x, self.eigensolver.at(x).spectrum)

    def _whole(self, a: Side, b: Side) -> Findings:
        """What happens in a step that is not parted."""
        findings = self.collisions.between(a, b)
        negative = [event for event in findings.events if event.omega2 < 0]
        left = sum(event.change for event in negative)
        for event in negative:  # both are unstable before and after
            event.change = 0
        sides, passed = {a.load: a, b.load: b}, 0
        for piece in self._pieces(a, b, [event.load for event in negative]):
            first, last = (len((sides.get(x) or self._side(a, x)).spectrum.negative) for x in piece)
            findings += self._diverging(a, piece, first, last)
            passed += last - first
        if not findings.doubts:
            findings.doubts += self._unexplained(a, b, passed - left, collided=bool(negative))
        return findings

    def _unexplained(self, a: Side, b: Side, change: int, *, collided: bool) -> list[str]:
        """Sentence on negative eigenvalues of which a ``change`` in a step does not tell all; none if it does."""
        numbers = [len(side.spectrum.negative) for side in (a, b)]
        if numbers[0] + change != numbers[1]:
            return [
                f"Between {self._load} = {a.load:.6g} and {b.load:.6g} the number of negative eigenvalues changes from "
                f"{numbers[0]} to {numbers[1]}, which what was found does not explain: use a smaller range."
            ]
        if not collided and self._exchanged(a, b):
            return [
                f"Whether eigenvalues that are negative at {self._load} = {a.load:.6g} and at {b.load:.6g} are the "
                "same ones, or some pass through zero between them, others back, is not known: use a smaller range."
            ]
        return []

    def _exchanged(self, a: Side, b: Side) -> bool:
        """Whether other eigenvalues may be negative after a step, by vectors: near rigid motions they are round-off."""
        if not others_negative(a.spectrum, b.spectrum):
            return False
        before, after = (np.sort(s.spectrum.values[s.spectrum.negative].real) for s in (a, b))
        if not self._parted or len(before) != len(after):
            return True
        return bool((abs(before - after) > SMALL * abs(before)).any())

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

    def _diverging(self, a: Side, span: tuple[float, float], first: int, last: int) -> Findings:
        """Locate the loads at which real eigenvalues pass through zero, from ``first`` negative ones to ``last``.

        At the loads of the ``span``, in the order of the sweep, so many are negative.
        """
        loads = sorted(span)
        found: list[float] = []
        for number in range(min(first, last), max(first, last)):

            def mu(load: float, number: int = number) -> float:
                return self._real(a, load)[number]

            try:
                found.append(self._zero(mu, loads[0], loads[1], self._side(a, loads[0]).spectrum.zero))
                ends = min(abs(mu(loads[0])), abs(mu(loads[1])))
                beyond = abs(mu(found[-1])) > max(ends, self.units.omega2)
            except (ConvergenceError, IndexError, ValueError):
                words = f"Divergence between {span[0]:.6g} and {span[1]:.6g} could not be located: use a smaller range."
                return Findings(doubts=[words])
            if beyond:  # a pole: of a rod whose mass is all at a few points, where these do not move
                words = (
                    f"At {self._load} = {found[-1]:.8g} an eigenvalue changes its sign through infinity, not zero: the "
                    "motion there has no inertia; give the rod a mass along it."
                )
                return Findings(doubts=[words])
        together: list[list[float]] = []
        for load in sorted(found):
            if together and abs(load - together[-1][0]) < TOGETHER * unit(load, one=self.units.load):
                together[-1].append(load)
            else:
                together.append([load])
        out = Findings()
        for group in together:
            try:
                out.events.append(self._divergence(a, group, loads, 1 if last > first else -1))
            except ConvergenceError as trouble:
                out.doubts.append(str(trouble))
        return out

    def _zero(self, mu: Callable[[float], float], low: float, high: float, noise: float) -> float:
        """Load at which ``mu`` vanishes: a bound where it does there but for ``noise``: its sign says nothing then."""
        for load in (low, high):
            if abs(mu(load)) <= noise:
                return load
        return zero_between(mu, low, high, ROUND_OFF * max(abs(low), abs(high)))

    def _divergence(self, a: Side, loads: list[float], bounds: list[float], sign: int) -> Critical:
        """Divergence of as many eigenvalues as ``loads``, where their mean, which is smooth, is zero.

        Those that are zero at all loads are among them: there they are not told apart, and they add nothing.  The load
        is within ``bounds``.
        """
        at, number = self._side(a, loads[0]), len(loads)
        places = np.argsort(abs(at.spectrum.values), kind="stable")[: number + self._still].tolist()
        cluster = cluster_at(self.eigensolver.at(at.x), at.spectrum, places)
        mean = Mean(Measuring(self.solver, self.eigensolver, a.x), cluster, self._still)
        load, uncertainty = interpolated_zero(mean, loads[0], self.units.load)
        uncertainty = max(uncertainty, abs(loads[-1] - loads[0]), SHARP * unit(load, one=self.units.load))
        inside = min(max(load, bounds[0]), bounds[1])
        load, uncertainty = inside, uncertainty + abs(load - inside)
        return Critical(DIVERGENCE, load, sign * number, uncertainty, 0.0, cluster, still=self._still)

    def _real(self, a: Side, load: float) -> list[float]:
        """Real eigenvalues at a load near the origin, in ascending order, but for those that are zero at all loads."""
        values = self._side(a, load).spectrum.values
        real = values[values.imag == 0].real.tolist()
        return sorted(sorted(real, key=abs)[self._still :])


def _meetings(before: Side, row: Side, behind: Side) -> list[Meeting]:
    """What comes near zero between a row and its neighbours."""
    ratio = abs(before.load - row.load) / abs(behind.load - row.load)
    return meetings(row.spectrum, before.spectrum, behind.spectrum, ratio)


def _move(low: Side, row: Side, high: Side, mean: float) -> float:
    """Change of the load from a row to where eigenvalues about a ``mean`` meet within its neighbours; zero for none."""
    found = [m for m in _meetings(low, row, high) if abs(m.mean - mean) < SAME * abs(mean)]
    return min((m.t * (high.load - row.load) for m in found), key=abs, default=0.0)

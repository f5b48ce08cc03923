"""Search for events between two rows of a branch: for every zero of a number of the state, also for pairs of them.

The number is sampled at states that are interpolated between the rows (:mod:`rodfem.continuation.event_samples`), which
costs no solves.  Where the samples change their sign, and where they come near zero without one, equilibria are solved
for: of what lies between two changes of sign the sample farthest from zero, and of a sample near zero the lowest value
around it.  Equilibria alone decide what happens.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import groupby, pairwise
from math import copysign
from typing import NamedTuple

from petsc4py import PETSc

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_location import TOUCHES, Found, Solved, noise_of
from rodfem.continuation.event_samples import sampled
from rodfem.continuation.prediction import hermite
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE

NEAR = 0.1
"""A lowest value below this part of how much the samples vary may be zero: it is solved for."""
SMALL = 1e-6
"""A value at a row below this part of the largest sample may be zero."""
NOISY = 0.5
"""Part of a step that is not resolved above which the rows alone tell of one zero: those between may be of noise."""
Piece = tuple[float, float]


class Happens(NamedTuple):
    """What an event does in a step: where it is ``found``, and pieces on which it is ``unresolved``.

    It may be zero at the ``first`` and at the ``last`` row, to round-off, or on the whole step (``still``).
    """

    found: list[Found]
    unresolved: list[Piece]
    first: bool = False
    last: bool = False
    still: bool = False


class Peak(NamedTuple):
    """A sample farthest from zero of those between two changes of sign: parameter, sign."""

    s: float
    sign: float


def between(a: Point, b: Point, s: float) -> tuple[PETSc.Vec, PETSc.Vec]:
    """State and direction at arclength ``s`` between two rows: on a line where a row has no tangent."""
    if a.tangent is not None and b.tangent is not None:
        return hermite(a, b, s)
    way = b.x - a.x
    return a.x + way * ((s - a.arclength) / (b.arclength - a.arclength)), way


class Search:
    """The search of one event in one step, from ``a`` to ``b`` on the mesh of a ``solver``."""

    def __init__(self, solver: BranchSolver, event: Event, a: Point, b: Point) -> None:
        """Nothing of the ``event`` is sampled yet."""
        self.a, self.b, self.length = a, b, b.arclength - a.arclength
        self.margin = INSIDE * self.length
        self.solved = Solved(solver, event, lambda s: between(a, b, s), self.length)
        self.noise = cache(lambda: max(noise_of(solver, event, p.x) for p in (a, b)))

    def __call__(self, f: Callable[[float], float], ends: tuple[float, float], *, known: bool) -> Happens:
        """Find what happens between the rows, at which the event has the values ``ends``.

        ``f(s)`` is its value at the state interpolated at arclength ``s``; the first row is ``known`` to be a zero, or
        not to be one.  Raises :class:`ConvergenceError` where an equilibrium is not found.
        """
        low, high = self.a.arclength, self.b.arclength
        samples = sampled(f, low, high, ends, self.noise)
        values = samples.values.values()
        largest, first, last = max(map(abs, values)), known, False
        if min(map(abs, values)) <= SMALL * largest:
            if largest == 0.0 or largest <= self.noise():
                return Happens([], [], still=True)
            first = known or self._zero(f, low, self.margin, ends[0], largest)
            last = self._zero(f, high, -self.margin, ends[1], largest)
        rows = {s for s, zero in ((low, first), (high, last)) if zero}
        if sum(q - p for p, q in samples.unresolved) > NOISY * self.length:
            inside = [(s, y) for s, y in zip((low, high), ends, strict=True) if y and s not in rows]
        else:
            inside = [(s, y) for s, y in samples.in_order() if y and s not in rows]
        # a corner may be so close beside a row that no sample is between the two
        for row, s, y in ((low, low + self.margin, ends[0]), (high, high - self.margin, ends[1])):
            if row not in rows and abs(y) <= SMALL * largest and s not in samples.values and (z := f(s)):
                inside = sorted([*inside, (s, z)])
        near, touching = self._near_zero(inside, max(values) - min(values))
        peaks, more = self._peaks(sorted(inside + near))
        crossing = [self._crossing(p.s, q.s) for p, q in pairwise(peaks) if p.sign != q.sign]
        found = _distinct([*touching, *more, *crossing], TOUCHES * self.length)
        return Happens(found, samples.unresolved, first and not known, last)

    def _zero(self, f: Callable[[float], float], row: float, margin: float, here: float, largest: float) -> bool:
        """Whether the event is zero at a row, to round-off or within the margin beside it, where it may turn."""
        if here == 0.0 or abs(here) > SMALL * largest:
            return here == 0.0
        beside, beyond = f(row + margin), f(row + 2 * margin)
        return abs(here) <= max(self.noise(), abs(beside - here), abs(beyond - beside))

    def _near_zero(
        self, known: list[tuple[float, float]], spread: float
    ) -> tuple[list[tuple[float, float]], list[Found]]:
        """Lowest values around samples of one sign near zero: those of the other sign, and what touches zero."""
        beyond, touching, places = [], [], [s for s, _ in known]
        for i, ((_, y), (_, z), (_, w)) in enumerate(zip(known, known[1:], known[2:], strict=False), 1):
            if not (y * z > 0 < z * w and abs(z) <= min(abs(y), abs(w)) and abs(z) < NEAR * spread):
                continue
            sign = copysign(1.0, z)
            there, low = self.solved.lowest(*self._bracket(places, i, sign), sign, self.margin)
            if low < 0:
                beyond.append((there, sign * low))
            elif self.solved.touches(there, sign, TOUCHES * self.length):
                touching.append(self._touch(there))
        return beyond, touching

    def _bracket(self, places: list[float], i: int, sign: float) -> tuple[float, float, float]:
        """Samples about the one of number ``i`` between which ``sign`` times the event is lowest at equilibria.

        The samples beside a corner are nearer to each other than interpolated states are to equilibria: the lowest
        value of these may be beyond them.  The ``places`` are the parameters of all samples, and the way leads
        downhill, from one to another at least twice as far.
        """
        low, high = self.a.arclength + self.margin, self.b.arclength - self.margin

        def value(s: float) -> float:
            return sign * self.solved(min(max(s, low), high))

        p, s, q = places[i - 1 : i + 2]
        while value(s) >= 0.0:
            if value(p) < value(s):
                p, s, q = max((t for t in places if s - t >= 2 * (q - p)), default=places[0]), p, s
            elif value(q) < value(s):
                p, s, q = s, q, min((t for t in places if t - s >= 2 * (q - p)), default=places[-1])
            else:
                break
            if s in (p, q):
                break
        return p, s, q

    def _touch(self, s: float) -> Found:
        x, there = self.solved.at(s)
        return Found(there, x, TOUCHES * self.length, touches=True)

    def _crossing(self, low: float, high: float) -> Found:
        """Where the event changes its sign between two parameters; what happens at a row has been found."""
        first, last = self.a.arclength + self.margin, self.b.arclength - self.margin
        return self.solved.zero(max(low, first), min(high, last))

    def _peaks(self, known: list[tuple[float, float]]) -> tuple[list[Peak], list[Found]]:
        """One peak of each run of samples of one sign, which equilibria have, too; and what touches zero instead."""
        runs = [list(run) for _, run in groupby(known, key=lambda sample: copysign(1.0, sample[1]))]
        peaks = [Peak(max(run, key=lambda sample: abs(sample[1]))[0], copysign(1.0, run[0][1])) for run in runs]
        if not peaks:
            return [], []
        peaks[0] = Peak(known[0][0], peaks[0].sign)
        peaks[-1] = Peak(known[-1][0], peaks[-1].sign)
        sure, touching = peaks[:1], []
        for peak, after in pairwise(peaks[1:]):
            s = peak.s
            if self.solved(s) * peak.sign <= 0:  # it was the error of the interpolation, or is somewhere beside it
                s, low = self.solved.lowest(sure[-1].s, s, after.s, -peak.sign, self.margin)
                if low >= 0:
                    if self.solved.touches(s, -peak.sign, TOUCHES * self.length):
                        touching.append(self._touch(s))
                    continue
            sure.append(Peak(s, peak.sign))
        return [*sure, *peaks[1:][-1:]], touching


def _distinct(found: list[Found], apart: float) -> list[Found]:
    """Zeros in order; two that are nearer to each other than ``apart`` are one that touches zero."""
    out: list[Found] = []
    for zero in sorted(found, key=lambda zero: zero.s):
        if out and zero.s - out[-1].s < apart:
            out[-1] = out[-1]._replace(along=apart, touches=True)
        else:
            out.append(zero)
    return out

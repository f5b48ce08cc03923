"""Search for events between two rows of a branch: for every zero of a number of the state, also for pairs of them.

The number is a function of the place on a curve that is interpolated between the rows, which costs no solves; its zeros
are located there (:mod:`rodfem.continuation.event_zeros`).  Where it is zero, or comes near it, equilibria are solved
for, and the curve is led through them, until its zeros are those of equilibria.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.event_curve import EventCurve
from rodfem.continuation.event_location import Found, event_at, noise_of
from rodfem.continuation.event_samples import Piece, Samples, sampled
from rodfem.continuation.event_zeros import EXACT, SURE, Zero, Zeros
from rodfem.errors import ConvergenceError
from rodfem.problem.events import Event
from rodfem.tolerances import INSIDE

SMALL = 1e-6
"""Largest value below this part of a ..."""
NOISY = 0.5
"""Part of a step that is not resolved above which the rows alone tell of one zero: those between may be of noise."""
ABOVE = 1e-6
"""Distance, relative to the step, to which the place of a lowest value that is not zero is that of equilibria."""
WIDE = 1e-2
"""Length, relative to the step, of a piece on which an event is zero that is no place any more."""
ROUNDS = 12
"""Times that the curve is improved."""


class Happens(NamedTuple):
    """What an event does in a step: where it is ``found``, and pieces on which it is ``unresolved``.

    At the ``first`` and at the ``last`` row it may be zero, to these distances; on pieces it may be ``still`` zero.
    The zeros have ``places``, arclengths, those at rows and known ones, too.
    """

    found: list[Found]
    unresolved: list[Piece]
    first: float | None = None
    last: float | None = None
    still: Sequence[Piece] = ()
    places: Sequence[float] = ()


class Search:
    """The search of one event in one step, from ``a`` to ``b`` on the mesh of a ``solver``."""

    def __init__(self, solver: BranchSolver, event: Event, a: Point, b: Point) -> None:
        """Nothing of the ``event`` is sampled yet."""
        self.solver, self.event, self.a, self.b = solver, event, a, b
        self.length = b.arclength - a.arclength
        self.curve = EventCurve(solver, a, b)
        self.known: dict[float, float] = {}
        self.rough = cache(lambda: SURE * max(noise_of(solver, event, p.x) for p in (a, b)))

    def __call__(self, f: Callable[[float], float], ends: tuple[float, float], last: float) -> Happens:
        """Find what happens between the rows, at which the event has the values ``ends``.

        ``f(s)`` is its value at the state interpolated at arclength ``s``; the ``last`` zero before was at this one.
        Raises :class:`ConvergenceError` where an equilibrium is not found.
        """
        a, b = self.a.arclength, self.b.arclength
        self.ends = dict(zip((a, b), ends, strict=True))
        for _ in range(ROUNDS):
            self.known = self.ends.copy()
            samples = sampled(self._value if self.curve.solved else f, a, b, ends, lambda s: self.rough())
            sizes = [abs(y) for y in samples.values.values()]
            if min(sizes) == 0.0 and max(sizes) <= self.rough():
                return Happens([], [], still=[(a, b)])
            noisy = sum(q - p for p, q in samples.unresolved) > NOISY * self.length
            if noisy:
                samples = Samples(self.ends.copy(), samples.unresolved)
            self.known |= samples.values
            zeros = Zeros(self._value, samples, self._noise)
            if a - last <= INSIDE * self.length:
                zeros.add(a)
            zeros.locate()
            if not (places := self._open(zeros)) and not noisy:
                zeros.look_around()
                places = self._open(zeros)
            if not places:
                return self._happens(zeros, last)
            for s in places:
                self.curve.solve(s)
        raise ConvergenceError(f"The zeros of the event {self.event.name!r} change with the states that are solved for.")

    def _value(self, s: float) -> float:
        """Value of the event on the curve."""
        if s not in self.known:
            self.known[s] = event_at(self.solver, self.event, self.curve(s)[0])
        return self.known[s]

    def _noise(self, s: float) -> float:
        """How much it varies there with the round-off of a state."""
        return noise_of(self.solver, self.event, self.curve(s)[0])

    def _open(self, zeros: Zeros) -> list[float]:
        """Places at which equilibria are to decide."""
        places = [(zero.s, max(zero.along, EXACT)) for zero in zeros.found if self._inside(zero)]
        places += [(s, ABOVE * self.length) for s in zeros.above if s not in self.ends]
        return [s for s, near in places if not any(abs(s - node.s) <= near for node in self.curve.solved)]

    def _inside(self, zero: Zero) -> bool:
        """Whether a zero is none of a row."""
        margin = max(INSIDE * self.length, zero.along)
        return zero.high - zero.low < WIDE * self.length and all(abs(zero.s - s) > margin for s in self.ends)

    def _happens(self, zeros: Zeros, last: float) -> Happens:
        """What the zeros are."""
        a, b = self.a.arclength, self.b.arclength
        found, still, rows = [], [], {a: None, b: None}
        for zero in zeros.found:
            if zero.high - zero.low >= WIDE * self.length:
                still.append((max(zero.low, a), min(zero.high, b)))
            elif self._inside(zero):
                node = min(self.curve.solved, key=lambda node: abs(node.s - zero.s))
                along = zero.along + abs(node.s - zero.s) + 2 * abs(node.arclength - node.s)
                found.append(Found(node.arclength, node.x, along))
            else:
                row = min(rows, key=lambda s: abs(s - zero.s))
                rows[row] = max(INSIDE * self.length, zero.high - zero.low)
        if a - last <= max(INSIDE * self.length, rows[a] or 0.0):
            rows[a] = None
        return Happens(found, zeros.samples.unresolved, rows[a], rows[b], still, [zero.s for zero in zeros.found])

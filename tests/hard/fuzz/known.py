"""What is known of a scene by arithmetic: the loads at which events happen, and where its energy ceases to be convex.

Along a branch an event of the load alone happens once in each piece between two rows whose loads are on either side of
one of its zeros.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import asin, isfinite, pi, tanh

import numpy as np

from rodfem import Branch, Diagram, Event, SpecialPoint
from rodfem.continuation.kinds import EVENT
from rodfem.tolerances import round_off

NEAR_A_ROW = 1e-6
"""Distance of a zero from the load of a row at which a branch may turn or end, relative to the range: it may be on
either side."""
Number = Callable[[float], float]


@dataclass(frozen=True)
class Timed:
    """An event of the load: its name, its function of the ``part`` of the range that is run, and its zeros there."""

    name: str
    of: Number
    zeros: tuple[float, ...]


@dataclass(frozen=True)
class Known:
    """Events of the load, and the part of the range at which the energy ceases to be convex.

    ``whole`` is the load at which the part is one; ``convex`` is None where it is not known.
    """

    whole: float = 1.0
    timed: tuple[Timed, ...] = ()
    convex: float | None = None

    @property
    def events(self) -> tuple[Event, ...]:
        """Events for a plan."""
        return tuple(Event(x.name, of=lambda state, of=x.of: of(state.load / self.whole)) for x in self.timed)

    def faults(self, diagram: Diagram) -> Iterator[str]:
        """Sentences on all of a diagram that is otherwise."""
        width = abs(diagram.scene.span[1] - diagram.scene.span[0])
        for branch in diagram:
            beyond = [p.load for p in branch.points if self.convex and p.load / self.whole > self.convex]
            if beyond:
                yield f"{branch.name} has a row at {beyond[0]:.8g}, where the stored energy is not convex"
            for timed in self.timed if diagram.scene.conservative else ():
                open_there = any(repr(timed.name) in sentence for sentence in (*diagram.warnings, *diagram.notes))
                for sentence in self._of_event(timed, branch, width):
                    if not (open_there and "times" in sentence):
                        yield f"{branch.name}, event {timed.name!r}: {sentence}"

    def _of_event(self, timed: Timed, branch: Branch, width: float) -> Iterator[str]:
        """What is wrong with the points of one event on one branch."""
        found = [s for s in branch.special if s.kind == EVENT and s.note.startswith(timed.name)]
        mine = {id(s.point) for s in branch.special if s.kind == EVENT}
        rows = [p.load for p in branch.points if id(p) not in mine]
        exact = np.array([z * self.whole for z in timed.zeros])
        expected = [sum((a - z) * (b - z) < 0 for a, b in pairwise(rows)) for z in exact]
        # rows at which the branch begins, ends or turns: what is beside them may be on either side
        turns = {0, len(rows) - 1} | {
            i for i in range(1, len(rows) - 1) if (rows[i] - rows[i - 1]) * (rows[i + 1] - rows[i]) <= 0
        }
        open_at = [min(abs(rows[i] - z) for i in turns) <= NEAR_A_ROW * width for z in exact]
        counts = [0] * len(exact)
        for s in found:
            error, bar = abs(exact - s.point.load), bar_of(s)
            i = int(error.argmin()) if len(exact) else -1
            if i < 0 or (error[i] > NEAR_A_ROW * width and error[i] > bar):
                yield f"happens at {s.point.load:.12g} +- {bar:.2g}, where it does not"
                continue
            counts[i] += 1
            if s.resolved is not False and error[i] > bar:
                yield f"at {s.point.load:.14g} +- {bar:.2g}, but the zero is {exact[i]:.14g}"
        for z, count, wanted, unclear in zip(exact, counts, expected, open_at, strict=True):
            if count != wanted and not unclear:
                yield f"happens {count} times at {z:.12g}, not {wanted}"


def bar_of(s: SpecialPoint) -> float:
    """Error bar of the load of an event."""
    return max(s.error_estimate if isfinite(s.error_estimate) else s.located_to, round_off(s.point.load, 0.0))


def sine(n: int, height: float) -> Timed:
    """``sin(n pi t) = height``."""
    first = asin(height) / pi
    zeros = [(x + 2 * k) / n for k in range(-1, n) for x in (first, 1 - first)]
    return Timed(f"sine of {n}", lambda t: float(np.sin(n * pi * t)) - height, tuple(z for z in zeros if 0 <= z <= 1))


def touching(b: float) -> Timed:
    """A parabola that touches zero."""
    return Timed("touch", lambda t: (t - b) ** 2, (b,))


def pair(b: float, apart: float) -> Timed:
    """Two zeros beside each other."""
    return Timed("pair", lambda t: (t - b - apart) * (t - b + apart), (b - apart, b + apart))


def steep(b: float) -> Timed:
    """Two steps that differ in sign."""
    return Timed("step", lambda t: tanh(200 * (t - b)), (b,))


def above(b: float) -> Timed:
    """A parabola that does not reach zero."""
    return Timed("above", lambda t: (t - b) ** 2 + 1e-6, ())

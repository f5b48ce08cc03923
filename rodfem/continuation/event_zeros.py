"""Zeros of a function on an interval, by its samples: where it changes its sign, and where it only touches zero.

Each is known up to an interval on which the function is zero to round-off; what is found in it is one zero.  Where a
function is not smooth at a zero, as a corner or a root, others may be at any distance from there: it is sampled again
on pieces that are the longer the farther they are from a zero.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from rodfem.continuation.event_samples import Function, Samples, more
from rodfem.roots import lowest_between, zero_between

NEAR = 0.1
"""A lowest value below this part of how much the samples vary may be zero."""
NEARLY = 1e-2
"""A lowest value below this part of the largest sample may have zeros beside it that are no farther apart."""
EXACT = 1e-13
"""Distance to which a change of sign is located."""
FINE = 1e-11
"""That of a lowest value, relative to the interval."""
RISES = 4.0
"""Distance from a lowest value, over that to which it is located, at which the function must have risen by it."""
SURE = 4.0
"""Size of a value, over its round-off, from which its sign is known."""
BESIDE = 1e-10
"""Distance from a zero, relative to the interval, at which the round-off of values is looked at."""
WIDER, GRADE = 4.0, 8.0
"""Ratios of two distances from a zero: of those that are tried for its interval, and of the ends of a piece."""
POWER = 0.05
"""Relative difference of two ratios of values at such distances that are those of a power of the distance."""
MOST = 6000
"""Samples of an interval, with those around zeros."""


class Zero(NamedTuple):
    """A zero at ``s``: between ``low`` and ``high`` the function is zero to round-off, at these two it is not."""

    s: float
    low: float
    high: float

    @property
    def along(self) -> float:
        """Uncertainty of the zero."""
        return max(self.s - self.low, self.high - self.s)


class Zeros:
    """The zeros of a function between the ends of its ``samples``, ``found`` in order, and lowest values ``above``."""

    def __init__(self, f: Function, samples: Samples, noise: Function) -> None:
        """Locate what the ``samples`` of ``f`` show; ``noise(s)`` is the round-off of its value at ``s``."""
        self.f, self.samples, self.noise = f, samples, noise
        self.low, self.high = min(samples.values), max(samples.values)
        self.length = self.high - self.low
        self.fine = max(FINE * self.length, EXACT)
        self.found: list[Zero] = []
        self.above: list[float] = []

    def locate(self) -> None:
        """Locate all zeros and lowest values between samples."""
        before = -1
        while before != (before := len(self.samples.values) + len(self.found) + len(self.above)):
            if len(self.samples.values) + len(self.above) > MOST:
                self.samples.unresolved = [(self.low, self.high)]
                return
            values = self.samples.values.values()
            near = NEAR * (max(values) - min(values))
            for s, width in [place for segment in self._segments() for place in self._places(segment, near)]:
                self.add(s, width)

    def look_around(self) -> None:
        """Sample the function at all distances from its zeros, and from those that come out, and locate these."""
        done: set[Zero] = set()
        while new := set(middles := self._middles()) - done:
            done |= new
            ends = [self.low, *(0.5 * (p.high + q.low) for p, q in pairwise(middles)), self.high]
            for middle, low, high in zip(middles, ends, ends[1:], strict=False):
                if middle in new and len(self.samples.values) <= MOST:
                    if low < middle.low:
                        self._graded(middle.low, low)
                    if middle.high < high:
                        self._graded(middle.high, high)
            self.locate()

    def _middles(self) -> list[Zero]:
        """Zeros, and lowest values that are nearly zero, around which others may be."""
        low = NEARLY * max(map(abs, self.samples.values.values()))
        return sorted([*self.found, *(Zero(s, s, s) for s in self.above if abs(self.f(s)) < low)])

    def add(self, s: float, width: float = EXACT) -> None:
        """Take ``s`` for a zero, known to ``width``: what is zero to round-off around it is the same one."""
        level, rooms = self._level(s), (s - self.low, self.high - s)
        distances = []
        for way, room in zip((-1.0, 1.0), rooms, strict=True):
            distance = width
            while distance < room and abs(self.f(s + way * distance)) <= level:
                distance *= WIDER
            distances.append(distance)
        # beyond an end, where a function may have no value, it is taken for what it is on the other side
        known = [d for d, room in zip(distances, rooms, strict=True) if d < room]
        left, right = (d if d < room else max([room, *known]) for d, room in zip(distances, rooms, strict=True))
        zero = Zero(s, s - left, s + right)
        for other in [other for other in self.found if other.low < zero.high and zero.low < other.high]:
            self.found.remove(other)
            zero = Zero(s, min(zero.low, other.low), max(zero.high, other.high))
        for end in (zero.low, zero.high):
            if self.low < end < self.high:
                self.samples.values[end] = self.f(end)
        self.found = sorted([*self.found, zero])

    def _level(self, s: float) -> float:
        """Size of a value near ``s`` up to which it may be zero."""
        beside = max(BESIDE * self.length, RISES * self.fine)  # at a root or a jump it varies with the place, too
        return SURE * min(self.noise(max(s - beside, self.low)), self.noise(min(s + beside, self.high)))

    def _segments(self) -> list[list[tuple[float, float]]]:
        """Samples in order, in pieces between zeros."""
        out, rest = [], self.samples.in_order()
        for zero in self.found:
            out.append([sample for sample in rest if sample[0] <= zero.low])
            rest = [sample for sample in rest if sample[0] >= zero.high]
        return [*out, rest]

    def _places(self, known: list[tuple[float, float]], near: float) -> list[tuple[float, float]]:
        """Zeros among ``known`` samples, and the width to which each is known; a lowest value is sought if ``near``."""
        out = [(s, EXACT) for s, y in known if y == 0.0]
        out += [(zero_between(self.f, p, q, EXACT), EXACT) for (p, y), (q, z) in pairwise(known) if y * z < 0]
        for i, (s, z) in enumerate(known):
            around = known[max(i - 1, 0) : i + 2]
            inside = len(around) == 3 or (len(around) == 2 and s in (self.low, self.high))
            values = [y for _, y in around]
            if inside and abs(z) < near and self._is_lowest(z, values) and not self._is_round_off(s, z, values):
                out += self._lowest([place for place, _ in around], s, 1.0 if z > 0 else -1.0)
        return out

    @staticmethod
    def _is_lowest(z: float, around: list[float]) -> bool:
        """Whether a value is of the sign of those ``around`` it, itself among them, and below one of them."""
        return all(y * z > 0 and abs(y) >= abs(z) for y in around) and any(abs(y) > abs(z) for y in around)

    def _is_round_off(self, s: float, z: float, around: list[float]) -> bool:
        """Whether a value ``z`` at ``s`` that is surely not zero differs from those ``around`` it by round-off only."""
        rise = max(map(abs, around)) - abs(z)
        return rise < abs(z) and rise <= SURE * self.noise(s) < abs(z)

    def _lowest(self, around: list[float], s: float, sign: float) -> list[tuple[float, float]]:
        """Look for the lowest value between the places ``around`` one, or at an end; return it if it is a zero."""
        width = RISES * self.fine
        if any(abs(s - place) < width for place in self.above):
            return []
        if len(around) == 3:
            s, low = lowest_between(lambda t: sign * self.f(t), around[0], s, around[2], width / RISES)
            self.samples.values[s] = sign * low
            if low < 0.0:  # changes of sign are beside it
                return []
            beside = [max(s - width, self.low), min(s + width, self.high)]
        else:
            low, beside = abs(self.f(s)), [s + width if s == self.low else s - width]
            if 0.0 <= sign * self.f(beside[0]) < low:  # it is lowest inside
                self.samples.values[beside[0]] = self.f(beside[0])
                return []
        if low <= max(self._level(s), SURE * (min(abs(self.f(t)) for t in beside) - low)):
            return [(s, width)]
        self.above.append(s)
        return []

    def _graded(self, near: float, far: float) -> None:
        """Sample the function from beside a zero to a place that is ``far`` from it.

        Where it does not grow there as a power of the distance there is more to be seen.
        """
        way, whole, distance = (1.0 if far > near else -1.0), abs(far - near), RISES * self.fine
        self.samples.unresolved = [(p, q) for p, q in self.samples.unresolved if not p <= near <= q]
        places, values = [near], [self.f(near)]
        while distance < whole:
            places.append(near + way * distance)
            values.append(self.f(places[-1]))
            distance *= GRADE
        places, values = [*places, far], [*values, self.f(far)]
        for i in range(1, len(places) - 1):
            x, y, z = values[i - 1 : i + 2]
            if i > 2 and i < len(places) - 2 and min(x * y, y * z) > 0 and abs(y * y / (x * z) - 1.0) < POWER:
                continue
            for p, q in pairwise(places[i - 1 : i + 2]):
                more(self.f, self.samples, (min(p, q), max(p, q)), lambda s: SURE * self.noise(s))

"""Search for a state between neighbouring rows whose index is not theirs, towards the lowest value of a determinant.

Successive parabolic interpolation (Brent 1973, chapter 5) of the test functions of
:mod:`rodfem.continuation.determinants`, of which three rows determine the parabola.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isfinite

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.determinants import Crossing, Logarithm, changes, relative
from rodfem.continuation.states_between import midpoint, point_between
from rodfem.stability.round_off import resolve

LOWER = 0.5
"""A vertex above this share of the lowest value known is no pair's, once the vertex is believed."""
MULTIPLICITIES = (1, 2)
FALLING = 0.9
"""A value below this share of the lowest one known is on the way to a zero of a function that is no line."""
VANISHING, LAST = 1e-4, 1e-2
"""Values, over that of the row before, below which a zero is believed: at once, and where they fall no more."""
APART = 1e-7
"""Distance from a known crossing within which indices are its own."""
TRIES, MISSES = 10, 2
"""Interpolations until a lowest value is given up, and how many in a row may lead to no lower one towards a zero."""
CLOSER = 4
"""Interpolations after which the vertex is believed."""
MARGIN = 1e-3
"""Part of a step, at its ends, in which no state is solved."""
DEEP = 0.1
"""A determinant below this share of those of both neighbours is looked at from nearer by."""
NEARER = 4.0
"""Ratio of successive distances from such a row."""
LEAST = 1e-4
"""Least of them, relative to the step."""
Sample = tuple[float, float]
"""Arclength, and a value whose lowest is sought."""


class PairSearch:
    """Search by one test function; ``solver`` has the mesh of the rows, which are neighbours on a branch.

    "Another index" is one that the crossings that are ``known`` do not explain.

    Attributes
    ----------
    falling
        Whether a search has ended at a row, beyond which the function may fall further: what it found is not all.
    """

    def __init__(self, solver: BranchSolver, logarithm: Logarithm, known: Sequence[Crossing] = ()) -> None:
        """With the ``logarithm`` of the size of the test function, and crossings that are ``known``."""
        self.solver, self.logarithm, self.known = solver, logarithm, known
        self.falling = False

    def inside(self, rows: Sequence[Point], p: Point, q: Point) -> list[Point]:
        """A state between the neighbours ``p`` and ``q`` among three ``rows`` whose index is not theirs, if found."""
        # det^(1/m) is a parabola near m coinciding crossings; its vertex is tried for each m
        for multiplicity in MULTIPLICITIES:
            samples = [(row.arclength, self._relative(row, p, multiplicity)) for row in rows]
            if all(isfinite(value) for _, value in samples):
                found = self.lowest(samples, p, q, multiplicity)
                if found is not None:
                    return [found]
        return []

    def dips(self, rows: Sequence[Point], p: Point, q: Point) -> bool:
        """Whether a parabola through three rows has its vertex between the neighbours ``p`` and ``q`` among them."""
        samples = [[(row.arclength, self._relative(row, p, m)) for row in rows] for m in MULTIPLICITIES]
        return any(p.arclength < vertex(x)[0] < q.arclength for x in samples)

    def around(self, rows: Sequence[Point]) -> list[Point]:
        """A state near the middle one of three rows whose index is not theirs, where that row's determinant is low."""
        p, a, b = rows
        if not self.follows(a, p) or not self._deep(a, p, b):
            return []
        # states nearer and nearer to the low row, until a parabola through them sees the pair
        step = min(a.arclength - p.arclength, b.arclength - a.arclength)
        size = step / NEARER
        while size > LEAST * step:
            before = point_between(self.solver, p, a, a.arclength - size)
            after = point_between(self.solver, a, b, a.arclength + size)
            if before is None or after is None:
                return []
            for state in (before, after):
                if self._differs(state, p):
                    return [state]
            closer = [before, a, after]
            found = self.inside(closer, before, a) or self.inside(closer, a, after)
            if found or not self._deep(a, before, after):
                return found
            size /= NEARER
        return []

    def beside(self, end: Point, inner: Point) -> list[Point]:
        """A state near the row ``end`` of a branch, towards its neighbour ``inner``, whose index is not theirs.

        It is looked for where the determinant at the end is far below the neighbour's.
        """
        if not self.follows(end, inner):
            return []
        step = inner.arclength - end.arclength
        size, far = step / NEARER, inner
        while abs(size) > LEAST * abs(step) and self._deep(end, far):
            first, last = sorted((end, far), key=arclength)
            near = point_between(self.solver, first, last, end.arclength + size)
            if near is None:
                return []
            if self._differs(near, inner):
                return [near]
            rows = sorted((end, near, far), key=arclength)
            found = self.inside(rows, *rows[:2]) or self.inside(rows, *rows[1:])
            if found:
                return found
            far, size = near, size / NEARER
        return []

    def halved(self, a: Point, b: Point) -> list[Point]:
        """A state between two neighbours whose index is not theirs, found from these two and the state half-way."""
        middle = midpoint(self.solver, a, b)
        if middle is None or not self.follows(b, a):
            return []
        if self._differs(middle, a):
            return [middle]
        rows = [a, middle, b]
        return self.inside(rows, a, middle) or self.inside(rows, middle, b)

    def lowest(self, samples: list[Sample], p: Point, q: Point, multiplicity: int) -> Point | None:
        """State between two rows, towards the lowest value that the samples lead to, if its index differs from theirs.

        The rows are ``p`` and ``q``.  ``samples`` are arclengths and values of the test function, relative to that at
        ``p``, for as many coinciding eigenvalues as ``multiplicity`` says.
        """
        every, margin = sorted(samples), MARGIN * (q.arclength - p.arclength)
        known = [sample for sample in every if p.arclength <= sample[0] <= q.arclength]
        least = least_of_ends = min(value for _, value in known)
        for tried in range(TRIES):
            s, value = vertex(samples)
            # the first parabolas reach too far to tell how low it is
            if not p.arclength < s < q.arclength or (value > LOWER * least and tried >= CLOSER):
                break
            s = min(max(s, p.arclength + margin), q.arclength - margin)
            if any(s == other for other, _ in samples):
                break
            state = point_between(self.solver, p, q, s)
            if state is None or self._differs(state, min(p, q, key=zeros)):
                return state
            size = abs(self._relative(state, p, multiplicity))  # of the same index, whatever a count calls zero
            every, known = sorted([*every, (s, size)]), sorted([*known, (s, size)])
            # the next parabola goes through the lowest value of the step and its neighbours, one perhaps beyond it
            least, lowest = min((value, s) for s, value in known)
            middle = every.index((lowest, least))
            if not 0 < middle < len(every) - 1:
                self.falling = True
                break
            samples = every[middle - 1 : middle + 2]
        # what falls so low as a parabola may be the product of two
        if multiplicity == 1 and not min(abs(value) for _, value in known) < DEEP * least_of_ends:
            return None
        return self._together([(s, abs(value) ** (multiplicity / 2)) for s, value in known], p, q)

    def _together(self, known: list[Sample], p: Point, q: Point) -> Point | None:
        """State between two rows at which two eigenvalues pass zero, if the ``known`` samples lead to one.

        They are those of the square root, in order: a line but for its sign, which changes at that state.  Where it
        falls no further, the lowest state is the one if an eigenvalue there is within the tolerance of zero.
        """
        missed = tried = 0
        lowest, nearest = LAST, None
        while missed < MISSES and tried < TRIES:
            tried += 1
            least, i = min((value, i) for i, (_, value) in enumerate(known))
            if not 0 < i < len(known) - 1:
                break
            s = root_of_line(known[i - 1 : i + 2])
            if any(s == other for other, _ in known):
                break
            state, row = point_between(self.solver, p, q, s), min(p, q, key=zeros)
            if state is None or self._differs(state, row):
                return state
            size = abs(self._relative(state, p, 2))
            # one that changes slowly is within the tolerance before the other one is, and its shift moves the zero
            if state.zero > row.zero and size < VANISHING:
                return state
            if state.zero > row.zero and size < lowest:
                lowest, nearest = size, state
            missed = 0 if size < FALLING * least else missed + 1
            known = sorted([*known, (s, size)])
        return nearest

    def _differs(self, state: Point, row: Point) -> bool:
        """Whether a state may have another index than follows from a row; small eigenvalues by their quotients."""
        if any(abs(state.arclength - crossing.arclength) < APART for crossing in self.known):
            return False
        index = row.negative + changes(self.known, row, state)
        if state.zero <= row.zero:
            return state.negative != index
        return resolve(self.solver.inertia.at(state.x)) != (index, index)

    def follows(self, row: Point, other: Point) -> bool:
        """Whether a row, some eigenvalues of which may be near zero, may have the index that follows from an other."""
        index = other.negative + changes(self.known, other, row)
        return row.negative <= index <= row.negative + max(row.zero - other.zero, 0)

    def _deep(self, row: Point, *others: Point) -> bool:
        """Whether the test function at a row is far below that at all ``others``."""
        return all(abs(self._relative(row, other, 1)) < DEEP for other in others)

    def _relative(self, row: Point, other: Point, multiplicity: int) -> float:
        """Root of the test function at a row over that at another."""
        return relative(self.logarithm, row, other, multiplicity, self.known)


def arclength(row: Point) -> float:
    """Arclength of a row along its branch."""
    return row.arclength


def zeros(row: Point) -> int:
    """Number of eigenvalues at a row that are zero within the tolerance of the count."""
    return row.zero


def vertex(samples: Sequence[Sample]) -> Sample:
    """Vertex of the parabola through three samples; at infinity where it has no lowest value."""
    (a, f), (b, g), (c, h) = samples
    first, second = (g - f) / (b - a), (h - g) / (c - b)
    curvature = (second - first) / (c - a)
    if not curvature > 0:
        return inf, 0.0
    s = (a + b) / 2 - first / (2 * curvature)
    return s, g + (s - b) * (first + curvature * (s - a))


def root_of_line(samples: Sequence[Sample]) -> float:
    """Zero of a function of which three samples are the sizes: between the two that make it most nearly a line."""
    (a, f), (b, g), (c, h) = samples
    bends = abs((-h - g) / (c - b) - (g - f) / (b - a)), abs((-h + g) / (c - b) - (-g - f) / (b - a))
    return (b * h + c * g) / (g + h) if bends[0] < bends[1] else (a * g + b * f) / (f + g)

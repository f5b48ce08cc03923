r"""Pairs of crossings inside one step: an eigenvalue that passes zero and comes back leaves the index as it was.

The index of two neighbouring rows does not show them.  The determinant of the saddle matrix does, the product of all
eigenvalues up to factors that change little (what stiffnesses make of it that change with the load or the strains is
divided out): on the way to its lowest value it falls before the step and rises after it.  A simple eigenvalue gives it
a parabola near such a pair, a double one the square of one,

    det^(1/m)(s) ~ c ((s - s_m)^2 - r^2),    crossings at s_m -+ r,    m = 1, 2,

which three rows determine.  Where its vertex lies inside a step, well below the values at both ends, the branch is
solved there.  Successive parabolic interpolation (Brent 1973, chapter 5) ends at a state with another index, or at a
lowest value that is not zero.  Determinants come with the factors that count the index: they cost nothing.

A row may happen to lie beside such a pair.  Its determinant is then lower than those of its neighbours by orders of
magnitude, and three rows do not show the pair: states nearer and nearer to that row replace its neighbours, on both
sides of it, or on the one side on which the first and the last row of a branch have any.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, inf, isfinite

from rodfem.continuation.branch import Point
from rodfem.continuation.branch_solver import BranchSolver
from rodfem.continuation.states_between import midpoint, point_between

LOWER = 0.5
"""A vertex above this share of the lowest value known is no pair's, once the vertex is believed."""
MULTIPLICITIES = (1, 2)
TRIES = 10
"""Interpolations until a lowest value is given up."""
CLOSER = 4
"""Interpolations after which the vertex is believed."""
MARGIN = 1e-3
"""Part of a step, at its ends, in which no state is solved."""
DEEP = 0.05
"""A determinant below this share of those of both neighbours is looked at from nearer by."""
NEARER = 4.0
"""Ratio of successive distances from such a row."""
LEAST = 1e-4
"""Least of them, relative to the step."""
Sample = tuple[float, float]
"""Arclength, and a value whose lowest is sought."""


class Touching:
    """The last rows of a branch, and the test for pairs of crossings in the steps between them, by determinants."""

    def __init__(self) -> None:
        """No row yet."""
        self._rows: list[Point] = []
        self._begun, self._told, self._seen = True, False, False

    def restart(self, rows: Sequence[Point]) -> None:
        """Begin at the last of some rows of one branch; the step before it counts as looked at."""
        same = [row for row in rows[-2:] if row.mesh == rows[-1].mesh]  # determinants of two meshes do not compare
        self._rows, self._begun, self._told, self._seen = same, len(rows) < 2, False, len(rows) > 1

    def add(self, row: Point, *, told: bool) -> None:
        """Go on to the next row; ``told`` is whether special points are known in the step to it."""
        self._begun = self._begun and len(self._rows) < 2
        self._rows, self._told = [*self._rows[-1:], row], told

    def between(self, solver: BranchSolver, a: Point, b: Point) -> list[Point]:
        """Rows to insert, in order of arclength, where an eigenvalue passes zero twice in the step from ``a`` to ``b``.

        Of two steps the parabola may have its vertex in the wrong one: where that of the last three rows was not in the
        step to ``a``, that step is looked at, too, and its row before that step then comes first.
        """
        if len(self._rows) < 2 or self._rows[-1] is not a:
            return []
        rows = [self._rows[-2], a, b]
        found, seen, self._seen = [], self._seen, dips(rows, a, b)
        if not (self._told or seen) and rows[0].negative == a.negative:
            early = inside(solver, rows, rows[0], a) or (beside(solver, rows[0], a) if self._begun else [])
            found += [rows[0], *early, a] if early else []
        if found or self._told:  # what lies on the other side of the row between the steps is known
            near = beside(solver, a, b)
        else:
            near = around(solver, rows)
        if near and near[0].arclength < a.arclength:
            found = [rows[0], *near, a]
            near = []
        return found + (near or inside(solver, rows, a, b))

    def ending(self, solver: BranchSolver) -> list[Point]:
        """Last step of a branch that has ended, with a row inserted where an eigenvalue passes zero twice; else none.

        A branch of one step has no third row, and its first one has been compared with none.
        """
        if len(self._rows) < 2 or self._told:
            return []
        a, b = self._rows
        found = beside(solver, b, a)
        if not found and self._begun:
            found = beside(solver, a, b) or halved(solver, a, b)
        return [a, *found, b] if found else []


def inside(solver: BranchSolver, rows: Sequence[Point], p: Point, q: Point) -> list[Point]:
    """A state between the neighbours ``p`` and ``q`` among three rows whose index is not theirs, if there is one.

    ``solver`` has the mesh, and ``rows`` are consecutive.
    """
    # det^(1/m) is a parabola near m coinciding crossings; its vertex is tried for each m
    for multiplicity in MULTIPLICITIES:
        samples = [(row.arclength, relative(row, p, multiplicity)) for row in rows]
        if all(isfinite(value) for _, value in samples):
            found = lowest(solver, samples, p, q, multiplicity)
            if found is not None:
                return [found]
    return []


def dips(rows: Sequence[Point], p: Point, q: Point) -> bool:
    """Whether a parabola through three rows has its vertex between the neighbours ``p`` and ``q`` among them."""
    samples = [[(row.arclength, relative(row, p, m)) for row in rows] for m in MULTIPLICITIES]
    return any(p.arclength < vertex(x)[0] < q.arclength for x in samples)


def around(solver: BranchSolver, rows: Sequence[Point]) -> list[Point]:
    """A state near the middle one of three rows whose index is not theirs, where that row's determinant is low."""
    p, a, b = rows
    if p.negative != a.negative or not relative(a, min(p, b, key=lambda row: row.determinant), 1) < DEEP:
        return []
    # states nearer and nearer to the low row, until a parabola through them sees the pair
    step = min(a.arclength - p.arclength, b.arclength - a.arclength)
    size = step / NEARER
    while size > LEAST * step:
        near = [point_between(solver, p, a, a.arclength - size), point_between(solver, a, b, a.arclength + size)]
        before, after = near
        if before is None or after is None:
            return []
        for state in (before, after):
            if differs(state, a):
                return [state]
        closer = [before, a, after]
        found = inside(solver, closer, before, a) or inside(solver, closer, a, after)
        if found or not relative(a, min(before, after, key=lambda row: row.determinant), 1) < DEEP:
            return found
        size /= NEARER
    return []


def beside(solver: BranchSolver, end: Point, inner: Point) -> list[Point]:
    """A state near the row ``end`` of a branch, towards its neighbour ``inner``, whose index is not theirs.

    It is looked for where the determinant at the end is far below the neighbour's.
    """
    if end.negative != inner.negative:
        return []
    step = inner.arclength - end.arclength
    size, far = step / NEARER, inner
    while abs(size) > LEAST * abs(step) and relative(end, far, 1) < DEEP:
        near = point_between(solver, min(end, far, key=arclength), max(end, far, key=arclength), end.arclength + size)
        if near is None:
            return []
        if differs(near, end):
            return [near]
        rows = sorted((end, near, far), key=arclength)
        found = inside(solver, rows, *rows[:2]) or inside(solver, rows, *rows[1:])
        if found:
            return found
        far, size = near, size / NEARER
    return []


def halved(solver: BranchSolver, a: Point, b: Point) -> list[Point]:
    """A state between two neighbours whose index is not theirs, found from these two and the state half-way."""
    middle = midpoint(solver, a, b)
    if middle is None or a.negative != b.negative:
        return []
    if differs(middle, a):
        return [middle]
    rows = [a, middle, b]
    return inside(solver, rows, a, middle) or inside(solver, rows, middle, b)


def arclength(row: Point) -> float:
    """Arclength of a row along its branch."""
    return row.arclength


def relative(row: Point, other: Point, multiplicity: int) -> float:
    """Root of the determinant at a row over that at another, with the sign that the indices say; nan if not known."""
    # determinants are logarithms; the sign of det changes with each negative eigenvalue
    exponent = (row.determinant - other.determinant) / multiplicity
    return float((-1) ** (row.negative - other.negative) * exp(min(exponent, 600.0)))


def lowest(solver: BranchSolver, samples: list[Sample], p: Point, q: Point, multiplicity: int) -> Point | None:
    """State between two rows, towards the lowest value that the samples lead to, if its index differs from theirs.

    The rows are ``p`` and ``q``, on the mesh of ``solver``.  ``samples`` are arclengths and values of :func:`relative`,
    for as many coinciding eigenvalues as ``multiplicity`` says.
    """
    known = [sample for sample in samples if sample[0] in (p.arclength, q.arclength)]
    least = min(value for _, value in known)
    margin = MARGIN * (q.arclength - p.arclength)
    for tried in range(TRIES):
        s, value = vertex(samples)
        # the first parabolas reach too far to tell how low it is
        if not p.arclength < s < q.arclength or (value > LOWER * least and tried >= CLOSER):
            break
        s = min(max(s, p.arclength + margin), q.arclength - margin)
        if any(s == other for other, _ in samples):
            break
        state = point_between(solver, p, q, s)
        if state is None or differs(state, p):
            return state
        size = relative(state, p, multiplicity)
        known = sorted([*known, (s, size)])
        # the next parabola goes through the lowest value and its two neighbours
        least, middle = min((value, i) for i, (_, value) in enumerate(known))
        if not 0 < middle < len(known) - 1:
            break
        samples = known[middle - 1 : middle + 2]
    return None


def differs(state: Point, row: Point) -> bool:
    """Whether the index of a state is not known to be that of a row."""
    return state.negative != row.negative or state.zero > row.zero


def vertex(samples: Sequence[Sample]) -> Sample:
    """Vertex of the parabola through three samples; at infinity where it has no lowest value."""
    (a, f), (b, g), (c, h) = samples
    first, second = (g - f) / (b - a), (h - g) / (c - b)
    curvature = (second - first) / (c - a)
    if not curvature > 0:
        return inf, 0.0
    s = (a + b) / 2 - first / (2 * curvature)
    return s, g + (s - b) * (first + curvature * (s - a))

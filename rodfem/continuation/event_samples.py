"""Samples of a function on an interval, as many as show where it changes its sign and where it comes near zero.

A piece has five nodes.  The parabola through its ends and its middle must tell the values at the other two, or the
piece is divided: so many divisions leave nothing that these five values do not show.  The middle is a little to the
left, and of the halves so are theirs: nodes at equal distances would take a function of that period for a constant.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from rodfem.roots import ROUND_OFF, lowest_between

MIDDLE = 0.46
"""Place of the middle of a piece, relative to it."""
NODES = np.array([0.0, MIDDLE**2, MIDDLE, MIDDLE + (1 - MIDDLE) * MIDDLE, 1.0])
"""Nodes of a piece: its ends, its middle, and those of its halves."""
INNER = [float(t) for t in NODES[1:-1]]
"""Those between its ends."""
WIDEST = float(np.diff(NODES).max())
"""Greatest distance of two nodes: what comes and goes between them is not seen."""
POWERS = np.linalg.inv(np.vander(NODES, increasing=True))
"""Coefficients of the quartic through five values, by rising powers."""
CLOSE = 0.03
"""Error of the parabola, relative to how much the samples of a piece vary, up to which they explain it."""
SAFE = 4.0
"""Least value of samples of one sign, relative to the error of the parabola, below which there may be a zero."""
CORNER = 1e-6
"""Distance, relative to a piece, to which a corner is found.  The lowest value there is one of the samples."""
FAR = 10.0
"""A function this many times farther from zero than its samples vary has no zero between them."""
LOW = 0.2
"""Least value on a piece, relative to how much the samples vary, above which no extreme between them is looked for."""
NEARER, NARROW = 0.7, 1e-6
"""A sample between two that are farther from zero is looked at below this part of the largest one, if these two are not
nearer to each other than this part of the interval."""
BESIDE = 1e-9
"""Distance from an end, relative to the interval, at which a sample shows whether the function comes nearer to zero."""
DEEPEST = 7
"""How many times a piece is divided."""
MOST = 400
"""Samples of an interval, but for those around lowest values: as many."""
Function = Callable[[float], float]
Piece = tuple[float, float]


@dataclass
class Samples:
    """Values of a function by its arguments, and the ``unresolved`` pieces on which they do not explain it."""

    values: dict[float, float]
    unresolved: list[Piece] = field(default_factory=list)

    def in_order(self) -> list[tuple[float, float]]:
        """Arguments and values, by rising arguments: of two that are one to round-off the first."""
        out: list[tuple[float, float]] = []
        for s, y in sorted(self.values.items()):
            if not out or s - out[-1][0] > ROUND_OFF * max(abs(s), abs(out[-1][0])):
                out.append((s, y))
        return out

    def lowest(self) -> list[tuple[float, Piece]]:
        """Samples of one sign between two that are farther from zero, each with these two."""
        known, low = self.in_order(), NEARER * max(map(abs, self.values.values()))
        return [
            (s, (p, q))
            for (p, x), (s, y), (q, z) in zip(known, known[1:], known[2:], strict=False)
            if abs(y) < low and x * y > 0 < y * z and abs(y) <= min(abs(x), abs(z)) and (x != y or y != z)
        ]


def sampled(f: Function, low: float, high: float, ends: tuple[float, float], noise: Function) -> Samples:
    """Sample ``f`` between ``low`` and ``high``, at which it has the values ``ends``.

    Extremes that may come near zero are among the samples.  ``noise(s)`` is the part of a value that is round-off:
    what varies by less is not looked into.
    """
    out, seen = Samples({low: ends[0], high: ends[1]}), set[float]()
    more(f, out, (low, high), noise)
    for s, y, way in ((low, ends[0], BESIDE), (high, ends[1], -BESIDE)):
        if abs(y) < NEARER * max(map(abs, out.values.values())):
            out.values[s + way * (high - low)] = f(s + way * (high - low))
    while new := [(s, piece) for s, piece in out.lowest() if s not in seen]:
        for s, (p, q) in new:  # where two pieces meet there may be a root, of which each has one side
            seen.add(s)
            if len(out.values) >= 2 * MOST:
                out.unresolved.append((p, q))
            elif q - p > NARROW * (high - low):
                more(f, out, (p, q), noise)
    return out


def more(f: Function, out: Samples, piece: Piece, noise: Function) -> None:
    """Add samples of ``f`` on a ``piece`` to ``out``, as :func:`sampled` takes them; ``noise(s)`` is round-off."""
    before = len(out.values)

    def at(s: float) -> float:
        if s not in out.values:
            out.values[s] = f(s)
        return out.values[s]

    pieces = deque([(*piece, 0)])
    while pieces:
        p, q, depth = pieces.popleft()
        s = [p, *(p + (q - p) * t for t in INNER), q]
        y = [at(node) for node in s]
        spread, least = max(y) - min(y), min(map(abs, y))
        error = _misfit(y)
        if least > FAR * spread:
            continue
        one_sign = all(y[0] * value > 0 for value in y)
        if (error <= CLOSE * spread and not (one_sign and least < SAFE * error)) or error <= noise(s[2]):
            if least < LOW * spread:
                for node in _extremes(y):
                    at(p + (q - p) * node)
        elif depth == DEEPEST or len(out.values) - before >= MOST:
            if depth < DEEPEST or _turns(y) > 1:
                out.unresolved.append((p, q))
            elif one_sign:  # a corner, of a least distance say
                lowest_between(lambda t: abs(at(t)), p, s[2], q, CORNER * (q - p))
        else:
            pieces += [(p, s[2], depth + 1), (s[2], q, depth + 1)]


def _misfit(y: list[float]) -> float:
    """Error of the parabola through the first, the third and the last value at the other two."""
    first = (y[2] - y[0]) / MIDDLE
    second = (y[4] - y[0] - first) / (1 - MIDDLE)
    told = (y[0] + t * (first + second * (t - MIDDLE)) for t in (INNER[0], INNER[2]))
    return max(abs(value - y[i]) for value, i in zip(told, (1, 3), strict=True))


def _extremes(y: list[float]) -> list[float]:
    """Where on [0, 1] the quartic through five values has a slope of zero."""
    powers = POWERS @ y
    roots = np.roots((powers[1:] * np.arange(1, 5))[::-1])
    real = roots.real[abs(roots.imag) <= abs(roots.real)]  # nearly equal extremes may come out as a complex pair
    return [float(t) for t in real if 0.0 < t < 1.0]


def _turns(y: list[float]) -> int:
    """How many times values turn."""
    steps = np.sign(np.diff(y))
    return int(np.count_nonzero(steps[1:] * steps[:-1] < 0))

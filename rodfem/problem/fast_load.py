"""How fast the functions of a scene change with a parameter: ranges of it in which a cubic tells each of them.

Along a branch that does not move the steps are as long as the states allow, and pass whole periods of a force that is a
sine of the load.  A range in which one of the functions is not the cubic through four of its values is halved; a step
is to be no longer than the ranges that it leads into.  Between the loads at which they are looked at expressions of UFL
are bounded by interval arithmetic (:mod:`rodfem.problem.enclosure`): no peak is too narrow to be seen, though it may be
too low: it is to be :data:`FINE` of what the function varies by about it.  Of a function without such bounds, one that
compares the load in Python, a peak between :data:`SEEN` loads is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np

from rodfem.problem.enclosure import AT_ONCE
from rodfem.problem.parameter_functions import ParameterFunction, parameter_functions
from rodfem.tolerances import ROUND_OFF

if TYPE_CHECKING:
    from rodfem.continuation.branch import Point
    from rodfem.problem.scene import Scene

STEPS = 2
"""Steps in each range: what comes and goes is found by three rows."""
KNOWN = np.array([0.0, 0.27, 0.71, 1.0])
"""Where in a range the cubic is that of the function."""
ASKED = np.array([0.113, 0.382, 0.487, 0.618, 0.873])
"""Where in a range the two are compared."""
POLYNOMIAL = 1e-9
"""Difference, relative to the variation over the whole range, up to which a function is a cubic."""
CLOSE, FINE = 0.005, 1e-4
"""Difference, relative to the variation over a piece, up to which a cubic tells a function there.

Where the smaller one makes ranges that are narrow something small happens: a bump on a function that grows.
"""
NARROW = 16
"""Ratio of the length of a range to that of a narrow one in it.  Of smooth functions the smaller difference halves
ranges three times, everywhere.
"""
NOISE = 1e-12
"""Difference in a component, over the largest one of its function, that is round-off."""
SEEN = 501
"""Loads at which a function is looked at, at least."""
PIECES = 4
"""Ranges to begin with where a function is no cubic."""
DEEPEST = 12
"""How many times each of them is halved: beyond that it is said that a function is not followed."""
STEEP = 40.0
"""Difference on the smallest ranges, over their part of the variation over the whole one, up to which it is a kink."""
DISTINCT = 1e-6
"""Distance of two loads, over the range, from which on they are two."""
WINDOW, SHARP = 0.01, 0.01
"""Distance from an extremum, over the range, and how much values change there, over that at the extremum."""
ASIDE = 1e-7
"""Distance of a load from an extremum, over the range."""
TURNS = 100
"""Extrema of a component that are listed, at most."""
Function = Callable[[np.ndarray], np.ndarray]
"""Components (n, m) for arguments (n,)."""
Seen = tuple[np.ndarray, np.ndarray]
"""Arguments in ascending order, (n,), and the components of a function there, (n, m)."""


class FastLoad:
    """Ranges of the load, and by how much it may change in a step.

    ``low`` and ``high`` are the ends of the ranges, none where every function is a cubic; ``doubt`` says where one is
    not even on the smallest, and is empty where all are.  At ``turns`` one has an extremum, and at ``smooth`` ones,
    beside which it hardly changes: what comes and goes does so there.
    """

    def __init__(self, scene: Scene, span: tuple[float, float], name: str = "", **values: float) -> None:
        """Sample the functions of a ``scene`` that depend on its load, over a ``span``.

        With a ``name`` that parameter takes its place.  Others have the ``values`` that are given.
        """
        first, last = sorted(span)
        self.doubt, ends, name = "", {first, last}, name or scene.load
        turns, smooth = set[float](), set[float]()
        for what, numbers in parameter_functions(scene, (name,), **values):
            for each, places in _looked_at(numbers, np.linspace(first, last, SEEN)):
                seen = places, each(places[:, None])
                least = np.maximum(each.least, NOISE * each.sizes(seen[1]))
                for turn, sharp in _turns(*seen, least):
                    (turns if sharp else smooth).add(turn)
                worst = _halved(lambda t, f=each: f(t[:, None]), seen, ends, least)  # type: ignore[misc]
                if worst and not self.doubt:
                    self.doubt = (
                        f"The {what} changes too fast with {name} about {name} = {worst[0]:.6g} to be followed "
                        "in steps, or jumps there: special points may be missing; let the range end before it."
                    )
        loads = np.array(sorted(ends) if len(ends) > 2 else [])
        self.low, self.high = loads[:-1], loads[1:]
        self.turns, self.smooth, self.width = sorted(turns), sorted(smooth), last - first

    def beside(self, loads: np.ndarray) -> list[float]:
        """Loads at extrema that are not at one of the ``loads`` (n,), nor at another one.

        They are a little aside: an extremum may be a kink, where there are no derivatives.
        """
        found, apart = loads.tolist(), DISTINCT * self.width
        for turn in (turn + ASIDE * self.width for turn in self.turns):
            if min((abs(turn - load) for load in found), default=apart) >= apart:
                found.append(turn)
        return found[len(loads) :]

    def ranges_below(self, length: float) -> list[tuple[float, float]]:
        """Ranges shorter than a ``length``; those that touch are one."""
        out: list[tuple[float, float]] = []
        for low, high in zip(self.low.tolist(), self.high.tolist(), strict=True):
            if high - low >= length:
                continue
            if out and out[-1][1] == low:
                out[-1] = out[-1][0], high
            else:
                out.append((low, high))
        return out

    def reach(self, point: Point) -> float:
        """Largest step from a ``point`` of a branch, by the slope of the load there."""
        return self.room(point.load, point.slope)

    def room(self, load: float, slope: float) -> float:
        """Largest step from a ``load`` that changes in steps by this ``slope``."""
        rate = abs(slope)
        if not len(self.low) or not isfinite(rate) or rate == 0.0:
            return float("inf")
        # the same whichever way the branch goes: ranges are told by their distance and their length
        away = np.maximum(0.0, np.maximum(self.low - load, load - self.high))
        return float((away + (self.high - self.low) / STEPS).min() / rate)


def _halved(function: Function, seen: Seen, ends: set[float], least: np.ndarray) -> list[float]:
    """Add the ends of ranges in which cubics tell a ``function`` to the ``least`` differences that count, (m,).

    Return loads about which they do not.
    """
    first, last = seen[0][[0, -1]]
    off, size, _ = told(function, np.array([first]), np.array([last]), seen)
    if not np.any(off > np.maximum(POLYNOMIAL * size, least)):  # nor where it is not defined, nan
        return []
    edges = np.linspace(first, last, PIECES + 1)
    size = np.maximum(size[0], np.ptp(function(edges), axis=0))
    kink = STEEP * size / (PIECES * 2**DEEPEST)
    least = np.maximum(POLYNOMIAL * size, least)
    coarse, fine, doubtful = _parted(function, seen, edges, least, kink)
    length = np.diff(coarse)[np.clip(np.searchsorted(coarse, fine[:-1], side="right") - 1, 0, len(coarse) - 2)]
    narrow = np.flatnonzero(NARROW * np.diff(fine) <= length)
    ends |= {*coarse.tolist(), *fine[narrow].tolist(), *fine[narrow + 1].tolist()}
    return doubtful


def _parted(
    function: Function, seen: Seen, edges: np.ndarray, least: np.ndarray, kink: np.ndarray
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """Ends of ranges in which cubics tell a ``function``, coarse and fine ones, and loads about which none does.

    They ascend; the first ranges are those between the ``edges``, and those of the coarse ranges are among the fine
    ones.  ``least`` is the least difference that counts, and ``kink`` that of a kink, (m,).
    """
    low, high, coarse, fine = edges[:-1], edges[1:], [edges], [edges]
    wide = np.ones(len(low), dtype=bool)  # whether they are coarse ranges, too
    for depth in range(DEEPEST + 1):
        untold, far, broken = (np.zeros(len(low), dtype=bool) for _ in range(3))
        block = max(1, AT_ONCE // (len(least) * (len(KNOWN) + len(ASKED))))
        for some in (slice(i, i + block) for i in range(0, len(low), block)):
            off, _, size = told(function, low[some], high[some], seen)
            untold[some] = np.any(off > np.maximum(FINE * size, least), axis=1)
            far[some] = np.any(off > np.maximum(CLOSE * size, least), axis=1)
            broken[some] = np.any(off > kink, axis=1)
        far &= wide
        broken &= far
        middle = (low + high) / 2
        if depth < DEEPEST:
            fine.append(middle[untold])
            coarse.append(middle[far])
            low, middle, high, wide = low[untold], middle[untold], high[untold], np.repeat(far[untold], 2)
            low, high = (np.stack(both, axis=1).ravel() for both in ((low, middle), (middle, high)))
    return np.unique(np.concatenate(coarse)), np.unique(np.concatenate(fine)), middle[broken].tolist()


def told(
    function: Function, low: np.ndarray, high: np.ndarray, seen: Seen
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """How far a function is from a cubic, beyond round-off, by range and component: (p, m).

    With that is returned how much it varies, and the lesser of that and of its mean size: where it grows by orders of
    magnitude small differences count, too.


    Parameters
    ----------
    function
        Returns the components (n, m) for arguments (n,).
    low, high
        The ends (p,) of the ranges in which it is looked at, in ascending order.
    seen
        Arguments at which it is compared with the cubic besides, and its components there.
    """
    length = high - low
    places = low[:, None] + np.append(KNOWN, ASKED) * length[:, None]
    values = function(places.ravel()).reshape(*places.shape, -1)
    known, inverse = values[:, : len(KNOWN)], np.linalg.inv(np.vander(KNOWN))
    weights = np.vander(ASKED, len(KNOWN)) @ inverse
    off = abs(np.einsum("ak,pkm->pam", weights, known) - values[:, len(KNOWN) :]).max(axis=1)
    least, most = values.min(axis=1), values.max(axis=1)
    range_of = np.searchsorted(low, seen[0]) - 1
    inside = (range_of >= 0) & (seen[0] <= high[range_of])
    if inside.any():
        range_of, x, y = range_of[inside], seen[0][inside], seen[1][inside]
        weights = np.vander((x - low[range_of]) / length[range_of], len(KNOWN)) @ inverse
        away = abs(sum(w[:, None] * known[range_of, k] for k, w in enumerate(weights.T)) - y)
        which, begin = np.unique(range_of, return_index=True)
        off[which] = np.maximum(off[which], np.maximum.reduceat(away, begin))
        least[which] = np.minimum(least[which], np.minimum.reduceat(y, begin))
        most[which] = np.maximum(most[which], np.maximum.reduceat(y, begin))
    off = np.maximum(off - ROUND_OFF * np.maximum(abs(least), abs(most)), 0.0)
    return off, most - least, np.minimum(most - least, abs(values).mean(axis=1))


def _looked_at(numbers: ParameterFunction, seen: np.ndarray) -> Iterator[tuple[ParameterFunction, np.ndarray]]:
    """Numbers of one parameter, and values of it at which they have to be looked at, with those in ``seen``.

    Those of all states at once, but where these would be too many.
    """
    places = numbers.places(seen, np.zeros(1), np.ones(1))
    if numbers.states > 1 and len(places) * numbers.states > AT_ONCE // 2:
        for half in numbers.halves():
            yield from _looked_at(half, seen)
    else:
        yield numbers, places


def _turns(places: np.ndarray, values: np.ndarray, least: np.ndarray) -> Iterator[tuple[float, bool]]:
    """Where components (n, m) have extrema between the first and the last of the ``places`` (n,).

    Differences below the ``least`` of a component (m,) are none.  With each, whether values change beside it, so that
    the rows of a sweep do not tell of it.
    """
    width = float(places[-1] - places[0])
    defined = np.isfinite(values).all(axis=0)
    for y, lost in zip(values.T[defined], least[defined], strict=True):
        steps = np.diff(y)
        steps[abs(steps) <= POLYNOMIAL * np.ptp(y) + ROUND_OFF * abs(y).max() + lost] = 0.0
        moving = np.flatnonzero(steps)
        turned = np.flatnonzero(np.sign(steps[moving[1:]]) != np.sign(steps[moving[:-1]]))
        for i in turned[:TURNS]:
            some = slice(max(int(moving[i]) - 1, 0), int(moving[i + 1]) + 3)
            turn = _vertex(places[some], y[some])
            away = np.interp([turn - WINDOW * width, turn, turn + WINDOW * width], places, y)
            yield turn, bool(abs(away - away[1]).max() > SHARP * abs(away[1]))


def _vertex(x: np.ndarray, y: np.ndarray) -> float:
    """Extremum of the parabola through the value that is farthest from those at both ends, and its neighbours."""
    i = int(np.argmax(abs(y - (y[0] + y[-1]) / 2)))
    i = min(max(i, 1), len(x) - 2)
    (a, b, c), (p, q, r) = x[i - 1 : i + 2], y[i - 1 : i + 2]
    left, right = (q - p) / (b - a), (r - q) / (c - b)
    if left == right:
        return float(b)
    at = (a + b) / 2 - left * (c - a) / 2 / (right - left)
    return float(min(max(at, a), c))

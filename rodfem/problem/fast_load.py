"""How fast the functions of a scene change with a parameter: ranges of it in which a cubic tells each of them.

Along a branch that does not move the steps are as long as the states allow, and pass whole periods of a force that is a
sine of the load.  A range in which one of the functions is not the cubic through four of its values is halved; a step
is to be no longer than the ranges that it leads into.  Between the loads at which they are looked at expressions of UFL
are bounded by interval arithmetic (:mod:`rodfem.problem.enclosure`): no peak is too narrow to be seen.  Of a function
without such bounds, one that compares the load in Python, a peak between :data:`SEEN` loads is not.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl

from rodfem.errors import SceneError
from rodfem.problem.enclosure import refined
from rodfem.problem.kinds import plain
from rodfem.problem.local_state import Constants, OfConstants, some_places, watched
from rodfem.problem.roles import functions_of
from rodfem.problem.values import Symbol, Values
from rodfem.tolerances import ROUND_OFF, TINY

if TYPE_CHECKING:
    from rodfem.continuation.branch import Point
    from rodfem.problem.scene import Scene

KNOWN = np.array([0.0, 0.27, 0.71, 1.0])
"""Where in a range the cubic is that of the function."""
ASKED = np.array([0.113, 0.382, 0.487, 0.618, 0.873])
"""Where in a range the two are compared."""
POLYNOMIAL = 1e-9
"""Difference, relative to the variation over the whole range, up to which a function is a cubic."""
CLOSE = 0.02
"""The same, up to which a cubic tells it."""
SEEN = 501
"""Loads at which a function is looked at, at least."""
PIECES = 4
"""Ranges to begin with where a function is no cubic."""
DEEPEST = 10
"""How many times each of them is halved: beyond that it is said that a function is not followed."""
Numbers = Callable[[float], list[float]]
Seen = tuple[np.ndarray, np.ndarray]
"""Loads in ascending order, (n,), and the values of a function there, (n, m)."""


class FastLoad:
    """Ranges of the load, and by how much it may change in a step.

    ``low`` and ``high`` are the ends of the ranges, none where every function is a cubic; ``doubt`` says where one is
    not even on the smallest, and is empty where all are.
    """

    def __init__(self, scene: Scene, span: tuple[float, float], name: str = "", **values: float) -> None:
        """Sample the functions of a ``scene`` that depend on its load, over a ``span``.

        With a ``name`` that parameter takes its place.  Others have the ``values`` that are given.
        """
        first, last = sorted(span)
        self.doubt, ends, name = "", {first, last}, name or scene.load
        for what, function, expressions in _numbers(scene, name, values):
            seen = _seen(function, expressions, np.linspace(first, last, SEEN))
            worst = _halved(function, seen, ends)
            if worst and not self.doubt:
                self.doubt = (
                    f"The {what} changes too fast with {name} about {name} = {worst[0]:.6g} to be followed "
                    "in steps, or jumps there: special points may be missing; let the range end before it."
                )
        loads = np.array(sorted(ends) if len(ends) > 2 else [])
        self.low, self.high = loads[:-1], loads[1:]

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
        return float((away + self.high - self.low).min() / rate)


def _halved(function: Numbers, seen: Seen, ends: set[float]) -> list[float]:
    """Add the ends of ranges in which cubics tell a ``function``; return loads about which they do not."""
    first, last = float(seen[0][0]), float(seen[0][-1])
    size, off = _told(function, first, last, seen)
    if not np.any(off > POLYNOMIAL * size):  # nor where it is not defined, nan
        return []
    edges = np.linspace(first, last, PIECES + 1).tolist()
    size = np.maximum(size, np.ptp([function(load) for load in edges], axis=0))
    todo = [(low, high, 0) for low, high in pairwise(edges)]
    left = []
    ends |= set(edges)
    while todo:
        low, high, depth = todo.pop()
        _, off = _told(function, low, high, seen)
        if not np.any(off > CLOSE * size):
            continue
        if depth == DEEPEST:
            left.append((low + high) / 2)
        else:
            middle = (low + high) / 2
            ends.add(middle)
            todo += [(low, middle, depth + 1), (middle, high, depth + 1)]
    return sorted(left)


def _told(function: Numbers, low: float, high: float, seen: Seen) -> tuple[np.ndarray, np.ndarray]:
    """How much a ``function`` varies between two loads, and how far from a cubic, beyond round-off, by component."""
    known, asked = (np.array([function(low + t * (high - low)) for t in places]) for places in (KNOWN, ASKED))
    inside = slice(*np.searchsorted(seen[0], [low, high], side="right"))
    there, asked = np.append(ASKED, (seen[0][inside] - low) / (high - low)), np.vstack([asked, seen[1][inside]])
    cubic = np.vander(there, len(KNOWN)) @ np.linalg.solve(np.vander(KNOWN), known)
    values, off = np.vstack([known, asked]), abs(cubic - asked).max(axis=0)
    return np.ptp(values, axis=0), np.maximum(off - ROUND_OFF * abs(values).max(axis=0), 0.0)


def _seen(function: Numbers, expressions: list[tuple[Values, Symbol]], loads: np.ndarray) -> Seen:
    """A ``function`` at the ``loads``, and where its ``expressions``, if any, have to be looked at besides."""
    for values, load in expressions:
        known = values({load: loads})
        size = float(abs(known[np.isfinite(known)]).max(initial=0.0))
        loads = refined(values.expression, load, loads, max(size, TINY))
    if expressions:
        return loads, np.stack([values({load: loads}) for values, load in expressions], axis=1)
    return loads, np.array([function(load) for load in loads.tolist()])


def _numbers(
    scene: Scene, name: str, values: dict[str, float]
) -> Iterator[tuple[str, Numbers, list[tuple[Values, Symbol]]]]:
    """Functions that depend on a parameter: in words, as the numbers that each returns, and as expressions of it."""
    for s in (None, *scene.samples()):  # along the rod its functions may be others
        point, rod = some_places(scene, s=s)
        known = {**vars(scene.constants(s=point.s)), **values}
        found: list[tuple[str, OfConstants, bool]] = [("stored energy", partial(scene.energy, rod.v, rod.k), False)]
        for what, function, role in functions_of(scene):
            if s is None or role.along:
                if role.call == "f(c)":
                    found.append((what, function, False))
                elif role.call == "f(x, c)":
                    found.append((what, partial(function, rod if role.along else point), True))
        for what, function, placed in found:  # one of a place may know the arclength by that
            c, names = watched(Constants(**known))
            try:
                function(c)
            except SceneError:
                continue
            if name in names and (s is None or placed or "s" in names):
                yield what, partial(_values, function, known, name), _expressions(function, known, name)


def _expressions(function: OfConstants, known: dict[str, Any], name: str) -> list[tuple[Values, Symbol]]:
    """What a ``function`` returns as expressions of a parameter; none where it needs a number for that."""
    symbol = Symbol()
    try:
        values = function(Constants(**{**known, name: symbol}))
        parts = values if isinstance(values, (tuple, list)) else [values]
        return [(Values(ufl.as_ufl(0.0 if x is None else x)), symbol) for x in parts]
    except Exception:  # of UFL's own, and of what compares the parameter in Python
        return []


def _values(function: OfConstants, known: dict[str, Any], name: str, value: float) -> list[float]:
    """Numbers that a ``function`` of constants returns for a ``value`` of one of them; nan for what it does not."""
    try:
        values = function(Constants(**{**known, name: value}))
    except SceneError:
        return [float("nan")]
    return [_number(x) for x in (values if isinstance(values, (tuple, list)) else [values])]


def _number(value: object) -> float:
    try:
        return plain(value(()) if callable(value) else value)
    except Exception:  # of UFL's own, too
        return float("nan")

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
Function = Callable[[np.ndarray], np.ndarray]
"""Components (n, m) for arguments (n,)."""


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
        for what, numbers in numbers_of(scene, (name,), **values):
            worst = _halved(lambda t, f=numbers: f(t[:, None]), _places(numbers, first, last), ends)  # type: ignore[misc]
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


class Numbers:
    """Numbers that a ``function`` of a scene's constants returns for values of some parameters."""

    def __init__(self, function: OfConstants, known: dict[str, Any], names: tuple[str, ...]) -> None:
        """Call it with symbols for the parameters with these ``names``, and else with the ``known`` values.

        There are no ``expressions`` where it needs numbers, as one that compares a parameter in Python does.
        """
        self.function, self.known, self.names = function, known, names
        self.symbols = [Symbol() for _ in names]
        try:
            values = function(Constants(**{**known, **dict(zip(names, self.symbols, strict=True))}))
            parts = values if isinstance(values, (tuple, list)) else [values]
            self.expressions = [Values(ufl.as_ufl(0.0 if x is None else x)) for x in parts]
        except Exception:  # of UFL's own, too
            self.expressions = []

    def __call__(self, places: np.ndarray) -> np.ndarray:
        """Numbers (n, m) for ``places`` (n, number of parameters); nan for what is not defined."""
        if self.expressions:
            at = dict(zip(self.symbols, places.T, strict=True))
            return np.stack([values(at) for values in self.expressions], axis=1)
        rows = [self._at(place) for place in places.tolist()]
        wide = max(map(len, rows), default=1)
        return np.array([row if len(row) == wide else [float("nan")] * wide for row in rows])

    def _at(self, place: list[float]) -> list[float]:
        try:
            values = self.function(Constants(**{**self.known, **dict(zip(self.names, place, strict=True))}))
        except SceneError:
            return [float("nan")]
        return [_number(x) for x in (values if isinstance(values, (tuple, list)) else [values])]


def numbers_of(scene: Scene, names: tuple[str, ...], **values: float) -> Iterator[tuple[str, Numbers]]:
    """Functions that depend on all parameters with these ``names``, in words, and their numbers.

    Other parameters have the ``values`` that are given.
    """
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
            c, asked = watched(Constants(**known))
            try:
                function(c)
            except SceneError:
                continue
            if asked.issuperset(names) and (s is None or placed or "s" in asked):
                yield what, Numbers(function, known, names)


def _halved(function: Function, seen: np.ndarray, ends: set[float]) -> list[float]:
    """Add the ends of ranges in which cubics tell a ``function``; return loads about which they do not.

    It is looked at where it has been ``seen``, in ascending order, from one end to the other.
    """
    first, last = float(seen[0]), float(seen[-1])
    off, size = told(function, first, last, seen)
    if not np.any(off > POLYNOMIAL * size):  # nor where it is not defined, nan
        return []
    edges = np.linspace(first, last, PIECES + 1)
    size = np.maximum(size, np.ptp(function(edges), axis=0))
    todo = [(low, high, 0) for low, high in pairwise(edges.tolist())]
    left = []
    ends |= set(edges.tolist())
    while todo:
        low, high, depth = todo.pop()
        off, _ = told(function, low, high, seen)
        if not np.any(off > CLOSE * size):
            continue
        if depth == DEEPEST:
            left.append((low + high) / 2)
        else:
            middle = (low + high) / 2
            ends.add(middle)
            todo += [(low, middle, depth + 1), (middle, high, depth + 1)]
    return sorted(left)


def told(function: Function, low: float, high: float, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far a function is from a cubic, beyond round-off, and how much it varies, by component.

    Parameters
    ----------
    function
        Returns the components (n, m) for arguments (n,).
    low, high
        The ends of the range in which it is looked at.
    seen
        Arguments, in ascending order, at which it is compared with the cubic besides.
    """
    inside = seen[slice(*np.searchsorted(seen, [low, high], side="right"))]
    known = function(low + KNOWN * (high - low))
    asked = function(np.concatenate([low + ASKED * (high - low), inside]))
    there = np.append(ASKED, (inside - low) / (high - low))
    cubic = np.vander(there, len(KNOWN)) @ np.linalg.solve(np.vander(KNOWN), known)
    values, off = np.vstack([known, asked]), abs(cubic - asked).max(axis=0)
    return np.maximum(off - ROUND_OFF * abs(values).max(axis=0), 0.0), np.ptp(values, axis=0)


def _places(numbers: Numbers, first: float, last: float) -> np.ndarray:
    """Values of one parameter at which numbers have to be looked at."""
    places = np.linspace(first, last, SEEN)
    for expression in numbers.expressions:
        (symbol,), values = numbers.symbols, expression({numbers.symbols[0]: places})
        size = float(abs(values[np.isfinite(values)]).max(initial=0.0))
        places = refined(expression.expression, symbol, places, max(size, TINY))
    return places


def _number(value: object) -> float:
    try:
        return plain(value(()) if callable(value) else value)
    except Exception:  # of UFL's own, too
        return float("nan")

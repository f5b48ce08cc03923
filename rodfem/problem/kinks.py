"""Kinks of the energies of a scene in the state: where what they compare with the state changes.

A foundation that only pushes, ``conditional(gt(x.r[0], 0), ...)``, or a material with ``abs(k[0])`` has a first
derivative, and a second one on either side of a surface in the space of states at a place.  The surface is where the
difference of what is compared is zero.  Whether the function has a kink there is told by its one-sided derivatives
across it: ``abs(k[0])**2`` has none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from ufl.classes import (
    GE,
    GT,
    LE,
    LT,
    Abs,
    Acos,
    Asin,
    Atan2,
    Ln,
    MaxValue,
    MinValue,
    Power,
    ScalarValue,
    Sqrt,
)
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.problem.jumps import difference
from rodfem.problem.pointwise import LocalState, Places, pointwise
from rodfem.problem.values import Symbol, Values, scalar

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene

STEPS = {1: 1e-5, 2: 1e-4, 3: 1e-3}
"""Steps of the differences of first to third order by which one-sided derivatives are told, in units of the state."""
STENCILS = {1: np.array([-1.0, 1.0, 0.0, 0.0]), 2: np.array([1.0, -2.0, 1.0, 0.0]), 3: np.array([-1.0, 3.0, -3.0, 1.0])}
"""Weights of those differences, at one to four steps."""
SHORTER, STAYS = 0.25, 0.5
"""With steps so many times shorter the jump of a derivative that is continuous falls to that part: a kink's stays."""
NOISE = 1e3 * float(np.finfo(float).eps)
"""Round-off of a difference, relative to the values."""
NEWTON = 3
"""Steps of Newton's method from a place near a surface to it."""
SMALL = 1e-6
"""Step of the derivatives of a difference, in units of the state."""


@dataclass(frozen=True)
class Kink:
    """What a function ``what`` of a place may have a kink at: the zeros of a ``value``.

    The ``function`` holds all along the rod, or at the arclength ``s``; ``units`` are those of a :class:`LocalState`.
    """

    what: str
    s: float | None
    function: Values
    value: Values
    units: dict[Symbol, float]

    def slopes(self, places: Places) -> np.ndarray:
        """Derivatives of the value with respect to the state, in its units: (symbols, places)."""
        return np.array([self._slope(symbol, places) for symbol in self.units])

    def order(self, at: Places) -> int:
        """Lowest order, 2 or 3, of a derivative that is not continuous ``at`` a place near the surface; 0: all are.

        Where the first one jumps the second one does not exist.
        """
        at, ways = self._on_surface(at)
        size = float(np.linalg.norm(ways))
        # the value of a square, say, has no slope on the surface, and tells no direction across it
        directions = list(np.eye(len(ways))) if size < SMALL else [ways / size]
        for order in STEPS:
            if any(self._jumps(at, way, order) for way in directions):
                return max(order, 2)
        return 0

    def _on_surface(self, at: Places) -> tuple[Places, np.ndarray]:
        """The place moved to where the value is zero, and the slopes there.

        By Newton's method along the slope, with twice the step where this leads nearer: to a double zero.
        """
        ways = self.slopes(at)[:, 0]
        for _ in range(NEWTON):
            size, value = float(np.linalg.norm(ways)), float(self.value(at)[0])
            if size < SMALL or value == 0.0:
                break
            steps = -np.array([1.0, 2.0]) * value / size
            left = abs(self.value(self._moved(at, ways / size, steps)))
            at = self._moved(at, ways / size, steps[[int(np.argmin(left))]])
            ways = self.slopes(at)[:, 0]
        return at, ways

    def _slope(self, symbol: Symbol, places: Places) -> np.ndarray:
        if symbol not in self.value.symbols:
            return np.zeros(len(places[symbol]))
        low, high = (
            self.value(places | {symbol: places[symbol] + h}) for h in np.array([-1, 1]) * SMALL * self._unit(symbol)
        )
        return np.asarray((high - low) / (2 * SMALL))

    def _unit(self, symbol: Symbol) -> float:
        return self.units[symbol]

    def _moved(self, at: Places, way: np.ndarray, steps: np.ndarray) -> Places:
        moved = {symbol: np.repeat(x, len(steps)) for symbol, x in at.items()}
        for (symbol, unit), part in zip(self.units.items(), way, strict=True):
            moved[symbol] = moved[symbol] + unit * part * steps
        return moved

    def _jumps(self, at: Places, way: np.ndarray, order: int) -> bool:
        jumps = []
        for h in (STEPS[order], SHORTER * STEPS[order]):
            sides = [self.function(self._moved(at, way, side * h * np.arange(1, 5))) for side in (-1, 1)]
            left, right = (float(STENCILS[order] @ y) for y in sides)
            noise = NOISE * max(float(abs(y).max()) for y in sides)
            jump = abs(right - (-1) ** order * left)
            if jump <= noise:
                return False
            jumps.append(jump / h**order)
        return jumps[1] > STAYS * jumps[0]


def kinks(scene: Scene) -> tuple[LocalState, list[Kink]]:
    """Kinks that the energies, potentials and constraints of a ``scene`` may have, as functions of a local state."""
    at, found = LocalState(scene), []
    for place in pointwise(scene, at):
        whole = scalar(place.function)
        for value in {value for part in unique_pre_traversal(whole) for value in _may_be_singular(part)}:
            if any(symbol in unique_pre_traversal(value) for symbol in at.units):
                found.append(Kink(place.what, place.s, Values(whole), Values(value), at.units))
    return at, found


def _may_be_singular(part: Any) -> Iterator[Any]:
    """Expressions at whose zeros a node of UFL has no derivative of every order."""
    if isinstance(part, LT | GT | LE | GE | Abs | MaxValue | MinValue):
        yield difference(part)
    elif isinstance(part, Sqrt | Ln | Atan2):
        yield part.ufl_operands[0]  # of atan2(y, x) the cut y = 0, x < 0
    elif isinstance(part, Acos | Asin):
        yield 1.0 - part.ufl_operands[0] ** 2
    elif isinstance(part, Power) and not _whole(part.ufl_operands[1]):
        yield part.ufl_operands[0]


def _whole(exponent: Any) -> bool:
    return isinstance(exponent, ScalarValue) and float(exponent).is_integer()

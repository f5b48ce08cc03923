"""Interval arithmetic for arrays: bounds of a function on many pieces of its argument at once.

R. E. Moore, Interval Analysis (1966).  Ends are rounded as usual, not outwards: bounds hold to round-off.  What is
undefined somewhere on a piece, as a quotient by zero, has no bounds there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from math import inf, pi
from typing import Any

import numpy as np

Ends = Callable[[Any], Any]


@dataclass(frozen=True)
class Interval:
    """Intervals from ``low`` to ``high``, arrays of one shape."""

    low: np.ndarray
    high: np.ndarray

    @property
    def is_zero(self) -> bool:
        """Whether these are zero, everywhere, as slopes of constants are."""
        return self.low is self.high and self.low.ndim == 0 and not self.low

    def __add__(self, other: Interval) -> Interval:
        """Sums of numbers in either."""
        if self.is_zero or other.is_zero:
            return other if self.is_zero else self
        return bounds(self.low + other.low, self.high + other.high)

    def __neg__(self) -> Interval:
        """Negative numbers of those in these."""
        return Interval(-self.high, -self.low)

    def __mul__(self, other: Interval) -> Interval:
        """Products of numbers in either; zero times what has no bounds is zero."""
        if self.is_zero or other.is_zero:
            return number(0.0)
        ends = [
            {id(x): x for x in (each.low, each.high)}.values() for each in (self, other)
        ]  # of a number there is one
        products = [a * b for a in ends[0] for b in ends[1]]
        products = [np.where(np.isnan(p), 0.0, p) for p in products]
        return bounds(reduce(np.minimum, products), reduce(np.maximum, products))

    def __truediv__(self, other: Interval) -> Interval:
        """Quotients of numbers in either."""
        through_zero = (other.low <= 0) & (other.high >= 0)
        inverse = Interval(np.where(through_zero, -inf, 1 / other.high), np.where(through_zero, inf, 1 / other.low))
        return self * inverse

    def monotone(self, function: Ends) -> Interval:
        """Values of a ``function`` that grows."""
        return bounds(function(self.low), function(self.high))

    def even(self, function: Ends) -> Interval:
        """Values of an even ``function`` that grows with the absolute value of its argument."""
        size = self.size()
        return bounds(function(size.low), function(size.high))

    def size(self) -> Interval:
        """Absolute values."""
        ends = abs(self.low), abs(self.high)
        return Interval(np.where((self.low <= 0) & (self.high >= 0), 0.0, np.minimum(*ends)), np.maximum(*ends))

    def sign(self) -> Interval:
        """Signs, all between -1 and 1 where there are both: slopes of the absolute value."""
        return Interval(np.where(self.low > 0, 1.0, -1.0), np.where(self.high < 0, -1.0, 1.0))

    def power(self, exponent: float) -> Interval:
        """Powers with one ``exponent``."""
        if not exponent.is_integer():
            powers = lambda x: np.power(x, exponent)  # noqa: E731 (of negative numbers there are none)
            return self.monotone(powers) if exponent > 0 else number(1.0) / self.power(-exponent)
        if exponent < 0:
            return number(1.0) / self.power(-exponent)
        return (self.even if exponent % 2 == 0 else self.monotone)(lambda x: np.power(x, exponent))

    def sine(self) -> Interval:
        """Sines."""
        ends = np.sin(self.low), np.sin(self.high)
        highest, lowest = (self._passes(place) for place in (pi / 2, -pi / 2))
        return bounds(
            np.where(lowest, -1.0, np.minimum(*ends)), np.where(highest, 1.0, np.maximum(*ends)), least=-1.0, most=1.0
        )

    def tangent(self) -> Interval:
        """Tangents."""
        pole = self._passes(pi / 2) | self._passes(-pi / 2)
        return bounds(np.where(pole, -inf, np.tan(self.low)), np.where(pole, inf, np.tan(self.high)))

    def _passes(self, place: float) -> np.ndarray:
        """Whether there is the ``place``, or one that is whole turns away from it."""
        turns = np.floor((self.high - place) / (2 * pi)) - np.ceil((self.low - place) / (2 * pi))
        return np.asarray(~(turns < 0))


def number(value: float | np.ndarray) -> Interval:
    """One ``value``, or one of each in an array."""
    exact = np.asarray(value, dtype=float)
    return Interval(exact, exact)


def bounds(low: np.ndarray, high: np.ndarray, least: float = -inf, most: float = inf) -> Interval:
    """Interval from ``low`` to ``high``; of the undefined ends the ``least`` and the ``most`` that there can be."""
    undefined = np.isnan(low) | np.isnan(high)
    return Interval(np.where(undefined, least, low), np.where(undefined, most, high))


def hull(one: Interval, other: Interval) -> Interval:
    """Smallest interval with all numbers of either."""
    return Interval(np.minimum(one.low, other.low), np.maximum(one.high, other.high))


def chosen(condition: np.ndarray, one: Interval, other: Interval) -> Interval:
    """The one interval where a ``condition`` holds, the other elsewhere."""
    return Interval(np.where(condition, one.low, other.low), np.where(condition, one.high, other.high))

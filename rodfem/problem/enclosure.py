"""Places along the rod between which a function of the arclength has no peak and no notch, however narrow.

A function is known where it is evaluated.  Between two places it is bounded by interval arithmetic: on a piece of
length h on which its slope is within ``[d, D]`` it is within ``(D - d) h / 2`` of the straight line through its ends,
so that its integral is known to ``(D - d) h^2 / 2``.  Pieces on which this is more than round-off of the rod's are
halved.  Slopes are bounded by differentiation in forward mode, each step in intervals (L. B. Rall, Automatic
Differentiation, LNCS 120 (1981), with Moore's arithmetic).

Where a comparison has both answers on a piece the function may jump, and the piece is halved to round-off.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from ufl import classes
from ufl.corealg.traversal import unique_post_traversal

from rodfem.problem.intervals import Interval, chosen, hull, number
from rodfem.problem.values import OTHER_NAMES, Symbol, Values, scalar

PIECES = 256
"""Pieces of the rod to begin with, about."""
KNOWN = 1e-12
"""Integral of a function that is not looked for on a piece, over its largest value times the length of the rod."""
MOST = 200_000
"""Places that are added: of what varies everywhere on so small a scale the elements say more."""
AT_ONCE = 1_000_000
"""The same of several functions, over their number: a part of them needs fewer."""
ROUND_OFF = 4 * float(np.finfo(float).eps)
"""Length of a piece that is not halved, over the largest arclength."""
NARROWEST = 2.0**-13
"""Length of a piece of a line between two places that is not halved, over that of the line."""
SPLIT = 0.4993
"""Part of a piece to one side of the place that divides it: no simple fraction of the rod is such a place."""
Number = float | np.ndarray
ONE, ANY = number(1.0), Interval(np.asarray(-inf), np.asarray(inf))


Places = dict[Symbol, np.ndarray]


class Jet(NamedTuple):
    """Bounds of a function and of its slope."""

    value: Interval
    slope: Interval


class Answer(NamedTuple):
    """Where a comparison is surely true, and where it is possibly so."""

    surely: np.ndarray
    possibly: np.ndarray


def refined(
    expression: Any,
    s: Symbol,
    places: np.ndarray,
    size: float | np.ndarray,
    others: dict[Symbol, tuple[Number, Number]] | None = None,
) -> np.ndarray:
    """Places, with those that a scalar ``expression`` needs besides to be known between them, in ascending order.

    Parameters
    ----------
    expression, s
        Expression of UFL of the arclength ``s``.
    places
        Arclengths from one end of the rod to the other, of shape (n,).
    size
        Largest value of the expression at them; of several functions, of which each needs its places, of shape (k, 1).
    others
        Symbols besides that are linear in ``s``, each with its value at zero and its slope: numbers, or of that shape.
    """
    nodes = list(unique_post_traversal(scalar(expression)))
    a, b = float(places[0]), float(places[-1])
    ends = np.unique([*places[:: max(1, len(places) // PIECES)], b])
    low, high, found, number_of, functions = ends[:-1], ends[1:], [places], 0, np.size(size)
    while len(low) and number_of < MOST and number_of * functions < AT_ONCE:
        try:
            pieces = Interval(low, high)
            lines = {x: Jet(number(p) + number(d) * pieces, number(d)) for x, (p, d) in (others or {}).items()}
            shape = np.broadcast_shapes(low.shape, np.shape(size))
            slope = _jet(nodes, {s: Jet(pieces, ONE), **lines}, shape).slope
        except NotImplementedError:  # a function without bounds, as those of Bessel
            return places
        length = high - low
        told = slope.high - slope.low <= 2 * KNOWN * size * (b - a) / length**2
        told = told.reshape(-1, len(low)).all(axis=0)
        wide = ~told & (length > ROUND_OFF * max(abs(a), abs(b)))
        low, high, length = low[wide], high[wide], length[wide]
        middle = low + SPLIT * length
        found.append(middle)
        number_of += len(middle)
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return np.unique(np.concatenate(found))


class Chords:
    """Values of an expression on straight lines between places, given by those of its symbols at both ends."""

    def __init__(self, values: Values) -> None:
        """List the nodes of the expression whose ``values`` they are."""
        self.values, self._nodes = values, list(unique_post_traversal(values.expression))

    def leave(self, a: Places, b: Places, beyond: np.ndarray, ends: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Whether on a line a value is not between those at its ends, by more than is allowed: (lines,).

        Parameters
        ----------
        a, b
            Values of all symbols at both ends of the lines.
        beyond
            Distance from the values at the ends that counts, by line.
        ends
            Values of the expression at ``a`` and ``b``.
        """
        lowest, highest = np.minimum(*ends) - beyond, np.maximum(*ends) + beyond
        way = {symbol: b[symbol] - a[symbol] for symbol in self.values.symbols}
        low, high, line = np.zeros(len(beyond)), np.ones(len(beyond)), np.arange(len(beyond))
        number_of, found = 0, np.zeros(len(beyond), dtype=bool)
        while len(line) and number_of < MOST:
            middle = low + SPLIT * (high - low)
            y = self.values({symbol: a[symbol][line] + middle * d[line] for symbol, d in way.items()})
            found[line[(y < lowest[line]) | (y > highest[line])]] = True
            known = {}
            for symbol, d in way.items():
                p, q = (a[symbol][line] + t * d[line] for t in (low, high))
                known[symbol] = Jet(Interval(np.minimum(p, q), np.maximum(p, q)), Interval(d[line], d[line]))
            try:
                value, slope = _jet(self._nodes, known, line.shape)
            except NotImplementedError:
                return found
            length = high - low  # from the middle it is farther to one end
            least = y - length * np.maximum(-slope.low, slope.high)
            most = y + length * np.maximum(-slope.low, slope.high)
            told = (np.fmax(least, value.low) >= lowest[line]) & (np.fmin(most, value.high) <= highest[line])
            open_ = ~told & ~found[line] & (length > NARROWEST)
            low, high, middle, line = low[open_], high[open_], middle[open_], line[open_]
            low, high, line = np.append(low, middle), np.append(middle, high), np.append(line, line)
            number_of += len(line)
        return found


def _jet(nodes: list[Any], known: dict[Any, Any], shape: tuple[int, ...]) -> Jet:
    """Bounds of the last of some ``nodes`` on pieces by those of the symbols that are ``known``; of that ``shape``."""
    with np.errstate(all="ignore"):
        for node in nodes:
            if node not in known:
                known[node] = _bounded(node, [known[x] for x in node.ufl_operands])
    jet: Jet = known[nodes[-1]]
    return Jet(*(Interval(np.broadcast_to(x.low, shape), np.broadcast_to(x.high, shape)) for x in jet))


def _bounded(node: Any, of: list[Any]) -> Any:
    """Jet or answer of a ``node`` by those of its operands."""
    kind = type(node)
    if isinstance(node, classes.ScalarValue | classes.Zero):
        return Jet(number(float(node)), number(0.0))
    if isinstance(node, classes.Variable):
        return of[0]
    if isinstance(node, classes.Label):
        return None
    if kind is classes.Power and isinstance(exponent := node.ufl_operands[1], classes.ScalarValue):
        return _power(of[0], float(exponent))
    if kind in RULES:
        return RULES[kind](*of)
    if isinstance(node, classes.MathFunction) and node._name in FUNCTIONS:
        (x,), (function, slope) = of, FUNCTIONS[node._name]
        value = function(x.value)
        return Jet(value, slope(x.value, value) * x.slope)
    raise NotImplementedError(kind.__name__)


def _product(x: Jet, y: Jet) -> Jet:
    return Jet(x.value * y.value, x.slope * y.value + x.value * y.slope)


def _quotient(x: Jet, y: Jet) -> Jet:
    value = x.value / y.value
    return Jet(value, (x.slope + -(value * y.slope)) / y.value)


def _power(x: Jet, exponent: float) -> Jet:
    return Jet(x.value.power(exponent), number(exponent) * x.value.power(exponent - 1) * x.slope)


def _general_power(x: Jet, y: Jet) -> Jet:
    logarithm = x.value.monotone(np.log)
    value = (y.value * logarithm).monotone(np.exp)
    return Jet(value, value * (y.slope * logarithm + y.value * x.slope / x.value))


def _larger(x: Jet, y: Jet) -> Jet:
    value = Interval(np.maximum(x.value.low, y.value.low), np.maximum(x.value.high, y.value.high))
    slope = chosen(y.value.high < x.value.low, x.slope, hull(x.slope, y.slope))
    return Jet(value, chosen(x.value.high < y.value.low, y.slope, slope))


def _angle(y: Jet, x: Jet) -> Jet:
    """Angle of a direction in the plane, which jumps where it points backwards."""
    slope = (x.value * y.slope + -(y.value * x.slope)) / (x.value.power(2.0) + y.value.power(2.0))
    backwards = (x.value.low <= 0) & (y.value.low <= 0) & (y.value.high >= 0)
    return Jet(Interval(np.asarray(-pi), np.asarray(pi)), chosen(backwards, ANY, slope))


def _negative(x: Jet) -> Jet:
    return Jet(-x.value, -x.slope)


def _conditional(if_: Answer, x: Jet, y: Jet) -> Jet:
    """Either, where the answer is sure; elsewhere there may be a jump between them."""
    open_ = if_.possibly & ~if_.surely
    value = chosen(open_, hull(x.value, y.value), chosen(if_.surely, x.value, y.value))
    return Jet(value, chosen(open_, ANY, chosen(if_.surely, x.slope, y.slope)))


def _less(x: Jet, y: Jet) -> Answer:
    return Answer(x.value.high < y.value.low, x.value.low < y.value.high)


def _not_greater(x: Jet, y: Jet) -> Answer:
    return Answer(x.value.high <= y.value.low, x.value.low <= y.value.high)


def _equal(x: Jet, y: Jet) -> Answer:
    possibly = (x.value.low <= y.value.high) & (y.value.low <= x.value.high)
    alike = (x.value.low == x.value.high) & (y.value.low == y.value.high)
    return Answer(possibly & alike, possibly)


def _not(x: Answer) -> Answer:
    return Answer(~np.asarray(x.possibly), ~np.asarray(x.surely))


RULES: dict[Any, Callable[..., Any]] = {
    classes.Sum: lambda x, y: Jet(x.value + y.value, x.slope + y.slope),
    classes.Product: _product,
    classes.Division: _quotient,
    classes.Power: _general_power,
    classes.Abs: lambda x: Jet(x.value.size(), x.value.sign() * x.slope),
    classes.Atan2: _angle,
    classes.MaxValue: _larger,
    classes.MinValue: lambda x, y: _negative(_larger(_negative(x), _negative(y))),
    classes.Conditional: _conditional,
    classes.LT: _less,
    classes.GT: lambda x, y: _less(y, x),
    classes.LE: _not_greater,
    classes.GE: lambda x, y: _not_greater(y, x),
    classes.EQ: _equal,
    classes.NE: lambda x, y: _not(_equal(x, y)),
    classes.AndCondition: lambda x, y: Answer(x.surely & y.surely, x.possibly & y.possibly),
    classes.OrCondition: lambda x, y: Answer(x.surely | y.surely, x.possibly | y.possibly),
    classes.NotCondition: _not,
}
"""Bounds of what UFL makes of others."""


def _shifted(x: Interval) -> Interval:
    return x + number(pi / 2)


def _bell(x: Interval) -> Interval:
    return (-x.power(2.0)).monotone(np.exp)


Function = Callable[[Interval], Interval]
FUNCTIONS: dict[str, tuple[Function, Callable[[Interval, Interval], Interval]]] = {
    "sqrt": (lambda x: x.monotone(np.sqrt), lambda x, y: number(0.5) / y),
    "exp": (lambda x: x.monotone(np.exp), lambda x, y: y),
    "ln": (lambda x: x.monotone(np.log), lambda x, y: ONE / x),
    "sin": (Interval.sine, lambda x, y: _shifted(x).sine()),
    "cos": (lambda x: _shifted(x).sine(), lambda x, y: -x.sine()),
    "tan": (Interval.tangent, lambda x, y: ONE + y.power(2.0)),
    "sinh": (lambda x: x.monotone(np.sinh), lambda x, y: x.even(np.cosh)),
    "cosh": (lambda x: x.even(np.cosh), lambda x, y: x.monotone(np.sinh)),
    "tanh": (lambda x: x.monotone(np.tanh), lambda x, y: ONE + -y.power(2.0)),
    "asin": (lambda x: x.monotone(np.arcsin), lambda x, y: (ONE + -x.power(2.0)).power(-0.5)),
    "acos": (lambda x: number(pi / 2) + -x.monotone(np.arcsin), lambda x, y: -(ONE + -x.power(2.0)).power(-0.5)),
    "atan": (lambda x: x.monotone(np.arctan), lambda x, y: ONE / (ONE + x.power(2.0))),
    "erf": (lambda x: x.monotone(OTHER_NAMES["erf"]), lambda x, y: number(2 / sqrt(pi)) * _bell(x)),
}
"""Bounds of functions, and of their slopes by those of the argument and of the value."""

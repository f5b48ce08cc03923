"""Values of expressions of UFL at many places at once.

UFL evaluates an expression at one place, node by node.  Here the nodes that a scalar expression is made of are listed
once, without indices, and each is evaluated for an array of places.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import erf, inf, nan
from typing import Any

import numpy as np
import ufl
from ufl import classes
from ufl.algorithms import expand_derivatives, expand_indices
from ufl.corealg.traversal import unique_post_traversal
from ufl.utils.stacks import StackDict

from rodfem.problem.kinds import plain
from rodfem.problem.roles import LOG_OF_UFL

OTHER_NAMES: dict[str, Any] = {
    "ln": np.log,
    "acos": np.arccos,
    "asin": np.arcsin,
    "atan": np.arctan,
    "erf": np.vectorize(erf, [float]),
}
"""Functions that numpy knows by another name than UFL, or not."""
OPERATIONS: dict[Any, Callable[..., Any]] = {
    classes.Sum: np.add,
    classes.Product: np.multiply,
    classes.Division: np.divide,
    classes.Power: np.power,
    classes.Abs: np.abs,
    classes.MinValue: np.minimum,
    classes.MaxValue: np.maximum,
    classes.Conditional: np.where,
    classes.LT: np.less,
    classes.GT: np.greater,
    classes.LE: np.less_equal,
    classes.GE: np.greater_equal,
    classes.EQ: np.equal,
    classes.NE: np.not_equal,
    classes.AndCondition: np.logical_and,
    classes.OrCondition: np.logical_or,
    classes.NotCondition: np.logical_not,
    classes.Atan2: np.arctan2,
}


class Values:
    """A scalar ``expression`` of symbols as a function of their values; what is no scalar has none."""

    def __init__(self, expression: Any) -> None:
        """List the nodes of the expression."""
        expression = ufl.as_ufl(expression)
        self.expression = expression if expression.ufl_shape else expand_indices(expand_derivatives(expression))
        self._nodes = list(unique_post_traversal(self.expression))

    def __call__(self, places: dict[Any, np.ndarray]) -> np.ndarray:
        """Values at places, each given by the arrays of its symbols: all of one length; nan where there is none."""
        size, known = len(next(iter(places.values()))), dict[Any, Any](places)
        try:
            with np.errstate(all="ignore"):
                for node in self._nodes:
                    if node not in known:
                        known[node] = _value(node, known)
            return np.broadcast_to(np.asarray(known[self.expression], dtype=float), (size,))
        except NotImplementedError:  # a function that is evaluated at one place at a time
            return np.array([self.at({symbol: float(x[i]) for symbol, x in places.items()}) for i in range(size)])

    def at(self, place: Mapping[Any, float] | None = None) -> float:
        """Value with the symbols of a ``place``, inf where it is undefined, nan where UFL does not evaluate it."""
        for symbol, value in (place or {}).items():
            symbol.value = value
        silent, LOG_OF_UFL.disabled = LOG_OF_UFL.disabled, True
        try:
            return plain(self.expression.evaluate((), {}, (), StackDict()))
        except (ArithmeticError, ValueError):
            return inf
        except Exception:  # of UFL's own, too, for a function that it does not evaluate
            return nan
        finally:
            LOG_OF_UFL.disabled = silent


def _value(node: Any, known: dict[Any, Any]) -> Any:
    kind = type(node)
    if kind in OPERATIONS:
        return OPERATIONS[kind](*(known[x] for x in node.ufl_operands))
    if isinstance(node, classes.MathFunction):
        name = node._name
        function = OTHER_NAMES[name] if name in OTHER_NAMES else getattr(np, name)
        return function(known[node.ufl_operands[0]])
    if isinstance(node, classes.ScalarValue):
        return float(node)
    if isinstance(node, classes.Zero):
        return 0.0
    if isinstance(node, classes.Variable):
        return known[node.ufl_operands[0]]
    if isinstance(node, classes.Label):
        return None
    raise NotImplementedError(kind.__name__)

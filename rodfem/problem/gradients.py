"""Resultants and stiffnesses of the energies of a scene: first and second derivatives by the state at a place."""

from __future__ import annotations

from collections.abc import Container
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Any

import numpy as np
import ufl
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.remove_complex_nodes import remove_complex_nodes
from ufl.classes import Division, Power, Product, ScalarValue, Sum, Variable, Zero
from ufl.corealg.traversal import unique_pre_traversal

from rodfem.problem.pointwise import LocalState, Places, pointwise
from rodfem.problem.values import Symbol, Values, scalar

if TYPE_CHECKING:
    from rodfem.problem.scene import Scene


class Gradient:
    """Derivatives of a ``function`` of a place, in words ``what``, with respect to a state of these ``units``.

    Of first and second order: equilibria know the first ones, and where they lose their stability the second ones.
    """

    def __init__(self, what: str, function: Any, units: dict[Symbol, float]) -> None:
        """Differentiate."""
        self.what = what
        symbols = [symbol for symbol in units if symbol in unique_pre_traversal(function)]
        first = {symbol: scalar(derivative(function, symbol)) for symbol in symbols}
        self._parts = [(units[symbol], Values(part)) for symbol, part in first.items()]
        for x, y in combinations_with_replacement(symbols, 2):
            if y in unique_pre_traversal(first[x]):
                self._parts.append((units[x] * units[y], Values(derivative(first[x], y))))

    def __call__(self, places: Places) -> np.ndarray:
        """Derivatives times the units of what they are with respect to, all in those of the function: (n, places)."""
        return np.array([unit * of(places) for unit, of in self._parts])


def gradients(scene: Scene) -> tuple[LocalState, list[Gradient]]:
    """Resultants along the rod, of the energies, potentials and constraints of a ``scene`` that are no polynomials.

    A polynomial in the state, as a quadratic energy, changes as slowly as the state does.
    """
    at, found = LocalState(scene), []
    for place in pointwise(scene, at):
        whole = scalar(place.function)
        if place.s is None and not is_polynomial(whole, at.units):
            found.append(Gradient(place.what, whole, at.units))
    return at, found


def derivative(function: Any, symbol: Symbol) -> Any:
    """Derivative of a ``function`` of a place with respect to one ``symbol`` of it."""
    return remove_complex_nodes(apply_derivatives(apply_algebra_lowering(ufl.diff(function, symbol))))


def is_polynomial(function: Any, symbols: Container[Any]) -> bool:
    """Whether a ``function`` is a polynomial in some ``symbols``, by the nodes of UFL between them and it."""
    asking: dict[Any, bool] = {}

    def asks(node: Any) -> bool:
        if node not in asking:
            asking[node] = node in symbols or any(asks(x) for x in node.ufl_operands)
        return asking[node]

    def keeps(node: Any) -> bool:
        if isinstance(node, Power):
            return _exponent(node.ufl_operands[1])
        return isinstance(node, Sum | Product | Variable) or (
            isinstance(node, Division) and not asks(node.ufl_operands[1])
        )

    return all(keeps(node) for node in unique_pre_traversal(function) if asks(node))


def _exponent(power: Any) -> bool:
    """Whether a power is that of a polynomial."""
    return isinstance(power, ScalarValue | Zero) and float(power) >= 0 and float(power).is_integer()

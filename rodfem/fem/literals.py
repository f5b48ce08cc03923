"""Numbers that a scene's functions have in them, as constants of the compiled forms.

A number in Python is part of the text of a form, ``0.617 * k1**2``, and each other number would be compiled anew.  As a
constant it is a value that the compiled form reads.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import ufl
from dolfinx import fem
from ufl.algorithms.map_integrands import map_integrand_dags
from ufl.constantvalue import FloatValue
from ufl.corealg.multifunction import MultiFunction
from ufl.corealg.traversal import traverse_unique_terminals

KEPT = {sign * value for sign in (-1.0, 1.0) for value in (0.25, 0.5, 1.0, 2.0, 3.0, 4.0)}
"""Numbers that belong to formulas, as the half of an energy."""


def with_constants(form: Any, mesh: Any) -> Any:
    """Return a form, or an expression, with constants on ``mesh`` in the place of its numbers, but integers and powers.

    What is none, as a sum without terms, is returned as it is.
    """
    if not isinstance(form, (ufl.Form, ufl.core.expr.Expr)):
        return form
    if not any(number not in KEPT for number in _numbers(form)):
        return form
    constants = _Constants(mesh)
    mapped = map_integrand_dags(constants, form, compress=False)
    return mapped if constants.of else form


def _numbers(form: Any) -> Iterator[float]:
    """Numbers in a form, or in an expression: to look for them takes a third of the time of a map."""
    for whole in [x.integrand() for x in form.integrals()] if isinstance(form, ufl.Form) else [form]:
        yield from (float(x) for x in traverse_unique_terminals(whole) if isinstance(x, FloatValue))


class _Constants(MultiFunction):
    """Maps numbers to the constants that stand for them: ``of`` has these by value."""

    expr = MultiFunction.reuse_if_untouched

    def __init__(self, mesh: Any) -> None:
        super().__init__()
        self.mesh = mesh
        self.of: dict[float, Any] = {}

    def float_value(self, number: Any) -> Any:
        value = float(number)
        if value in KEPT:
            return number
        if value not in self.of:
            self.of[value] = fem.Constant(self.mesh, value)
        return self.of[value]

    def power(self, o: Any, base: Any, exponent: Any) -> Any:
        """Keep an exponent, by which UFL differentiates, as it is."""
        given = o.ufl_operands[1]
        return self.reuse_if_untouched(o, base, given if isinstance(given, FloatValue) else exponent)

    def bessel_function(self, o: Any, order: Any, argument: Any) -> Any:
        """Keep the order, too."""
        return self.reuse_if_untouched(o, o.ufl_operands[0], argument)

"""All that rodfem takes of UFL beyond its documented names: classes of expressions, and what walks through them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import ufl
from ufl.algorithms.analysis import extract_coefficients, extract_type
from ufl.algorithms.apply_algebra_lowering import apply_algebra_lowering
from ufl.algorithms.apply_derivatives import apply_derivatives
from ufl.algorithms.map_integrands import map_integrand_dags
from ufl.classes import Condition, Indexed, Label, PositiveRestricted, Sum, Variable
from ufl.constantvalue import FloatValue
from ufl.core.expr import Expr
from ufl.corealg.multifunction import MultiFunction
from ufl.corealg.traversal import unique_pre_traversal
from ufl.utils.stacks import StackDict

import rodfem.forms  # noqa: F401, before UFL: see rodfem.forms.importing

__all__ = ["Condition", "Expr", "FloatValue", "Indexed", "Label", "MultiFunction"]
__all__ += ["PositiveRestricted", "Sum", "Symbol", "Variable", "apply_algebra_lowering", "differentiated"]
__all__ += ["evaluated", "extract_coefficients", "extract_type", "map_integrand_dags", "parts"]


def differentiated(expression: Any) -> Any:
    """An expression, or a form, without derivatives that are left to take."""
    return apply_derivatives(apply_algebra_lowering(expression))


def evaluated(expression: Any, component: tuple[int, ...] = ()) -> Any:
    """Value of a component of an expression without unknowns; unlike a call of it this does not differentiate first."""
    return expression.evaluate((), {}, component, StackDict())


def parts(expression: Any) -> Iterator[Any]:
    """All expressions that an expression is made of, itself among them, each once."""
    return unique_pre_traversal(ufl.as_ufl(expression))


class Symbol(Variable):  # type: ignore[misc]
    """An expression that stands for no number until it has a ``value``: ``math.cos`` refuses it."""

    __slots__ = ("name", "value")

    @classmethod
    def named(cls, name: str, value: float | None = None) -> Symbol:
        """Return what a person's function knows by this ``name``."""
        symbol = cls(ufl.as_ufl(0.0))
        symbol.name, symbol.value = name, value
        return symbol

    def evaluate(self, *_: Any, **__: Any) -> float:
        """Return the value; raises :class:`TypeError` if there is none."""
        if self.value is None:
            raise TypeError("a constant is an expression of UFL")
        return float(self.value)

    def __repr__(self) -> str:
        """Name, as a dictionary has it in its words on a key that it lacks."""
        return self.name

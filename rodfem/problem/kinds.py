"""Validation of arguments, numbers, vectors, scalars: the kind, or one sentence with the kind expected."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Set
from math import isfinite, nan
from numbers import Integral, Real
from typing import Any

import numpy as np
import ufl
from ufl.classes import Condition
from ufl.core.expr import Expr

from rodfem.errors import InputError, SceneError

UNORDERED = str, bytes, Set, Mapping
"""Kinds that can be iterated over and are no lists of numbers."""


def whole(name: str, value: Any, example: int) -> int:
    """Return ``value`` as an int; raises :class:`InputError` unless it is a whole number (no bool, no float)."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise InputError(f"{name} is {value!r}: give a whole number, as in {name}={example}.")
    return int(value)


def real(name: str, value: Any, example: float) -> float:
    """Return ``value`` as a float; raises :class:`InputError` unless it is a number (no bool, no string)."""
    if not isinstance(value, Real) or isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}: give a number, as in {name}={example:g}.")
    try:
        return float(value)
    except OverflowError:
        raise InputError(f"{name} is an integer too large for a float: give a smaller one.") from None


def finite(name: str, value: Any, example: float) -> float:
    """Return ``value`` as a float; raises :class:`InputError` unless it is a finite number."""
    number = real(name, value, example)
    if not isfinite(number):
        raise InputError(f"{name} is {number:g}: give a finite number, as in {name}={example:g}.")
    return number


def flag(name: str, value: Any) -> bool:
    """Return ``value``; raises :class:`InputError` unless it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}: give True or False.")
    return bool(value)


def text(name: str, value: Any, example: str) -> str:
    """Return ``value``; raises :class:`InputError` unless it is a string."""
    if not isinstance(value, str):
        raise InputError(f"{name} is {value!r}: give a text, as in {name}={example!r}.")
    return value


def function(name: str, value: Any, arguments: int, example: str) -> Any:
    """Return ``value``; raises :class:`InputError` unless it is a function that takes so many ``arguments``.

    ``name`` and ``example`` are for the sentence of the error.
    """
    try:
        inspect.signature(value).bind(*range(arguments))
    except (TypeError, ValueError):  # no function, another number of arguments, or a class without a signature
        raise InputError(
            f"{name} is {value!r}: give a function of {arguments} argument(s), as in {name}={example}."
        ) from None
    return value


def reals(name: str, values: Any, example: tuple[float, ...], count: int | None = None) -> tuple[float, ...]:
    """Return ``values`` as a tuple of floats; raises :class:`InputError` unless they are ``count`` (any) numbers.

    ``name`` and ``example`` are for the sentence of the error.
    """
    listed = isinstance(values, Iterable) and not isinstance(values, UNORDERED)
    given = tuple(values) if listed else None
    if given is None or (count is not None and len(given) != count):
        raise InputError(f"{name} is {values!r}: give {count or 'a tuple of'} numbers, as in {name}={example}.")
    return tuple(real(f"{name}[{i}]", value, example[0]) for i, value in enumerate(given))


def check_vector(what: str, values: Any, size: int) -> None:
    """Raise :class:`SceneError` unless ``values`` has ``size`` components."""
    try:
        count = len(values)
        if isinstance(values, UNORDERED):
            raise SceneError(f"The {what} is {values!r}: give {size} components in a tuple.")
    except TypeError:
        raise SceneError(f"The {what} is a single value: give {size} components.") from None
    if count != size:
        raise SceneError(f"The {what} has {count} components: give {size}.")


def check_scalar(what: str, value: Any) -> None:
    """Raise :class:`SceneError` unless ``value`` is a scalar, a number or an expression."""
    try:
        shape = ufl.as_ufl(value).ufl_shape
    except Exception:  # of UFL's own, which differ from release to release
        raise SceneError(f"The {what} is {value!r}: return a number or a UFL expression.") from None
    if shape != ():
        raise SceneError(f"The {what} has the shape {shape}: return a scalar.")
    if isinstance(value, (bool, np.bool_, Condition)):
        raise SceneError(f"The {what} is true or false, {value}: return a number, or ufl.conditional(...).")


def plain(value: Any) -> float:
    """Return a number, or a constant expression, as a float; raises :class:`TypeError` for what is none."""
    if isinstance(value, (str, bytes, bool, np.bool_)) or (isinstance(value, np.ndarray) and value.ndim):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def number_of(value: Any) -> float:
    """Number that an expression without unknowns stands for; nan where it has none, or a complex one."""
    try:
        return plain(value(()) if isinstance(value, Expr) else value)
    except Exception:  # of UFL's own, too, which differ from release to release
        return nan

"""Validation of arguments, numbers, vectors, scalars: the kind, or one sentence with the kind expected."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np
import ufl

from rodfem.errors import InputError, SceneError


def whole(name: str, value: Any, example: int) -> int:
    """Return ``value`` as an int; raises :class:`InputError` unless it is a whole number (no bool, no float)."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise InputError(f"{name} is {value!r}: give a whole number, as in {name}={example}.")
    return int(value)


def real(name: str, value: Any, example: float) -> float:
    """Return ``value`` as a float; raises :class:`InputError` unless it is a number (no bool, no string)."""
    if not isinstance(value, Real) or isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}: give a number, as in {name}={example:g}.")
    return float(value)


def reals(name: str, values: Any, example: tuple[float, ...], count: int | None = None) -> tuple[float, ...]:
    """Return ``values`` as a tuple of floats; raises :class:`InputError` unless they are ``count`` (any) numbers.

    ``name`` and ``example`` are for the sentence of the error.
    """
    given = tuple(values) if isinstance(values, Iterable) and not isinstance(values, str) else None
    if given is None or (count is not None and len(given) != count):
        raise InputError(f"{name} is {values!r}: give {count or 'a tuple of'} numbers, as in {name}={example}.")
    return tuple(real(f"{name}[{i}]", value, example[0]) for i, value in enumerate(given))


def check_vector(what: str, values: Any, size: int) -> None:
    """Raise :class:`SceneError` unless ``values`` has ``size`` components."""
    try:
        count = len(values)
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

"""Validation of numbers given by the user: the kind, or one sentence with the kind expected."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Integral, Real
from typing import Any

import numpy as np

from rodfem.errors import InputError


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
    """Return ``values`` as a tuple of floats; raises :class:`InputError` unless they are ``count`` (any) numbers."""
    given = tuple(values) if isinstance(values, Iterable) and not isinstance(values, str) else None
    if given is None or (count is not None and len(given) != count):
        raise InputError(f"{name} is {values!r}: give {count or 'a tuple of'} numbers, as in {name}={example}.")
    return tuple(real(f"{name}[{i}]", value, example[0]) for i, value in enumerate(given))

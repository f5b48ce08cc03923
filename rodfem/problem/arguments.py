"""Checks of arguments: each returns the value to go on with, or raises one sentence with an example.

A check takes the argument's name and its value.  :func:`checked` declares those of a public function at its head; a
dataclass calls them for its fields.  The sentences are :class:`InputError`; those on the functions of a scene, whose
names are words (``force on the left end``), are :class:`SceneError`.

Public functions work in one thread at a time, as neither PETSc nor FFCx can be used by two: others wait.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Set
from functools import wraps
from math import isfinite, nan
from numbers import Integral, Real
from pathlib import Path
from reprlib import Repr
from threading import RLock
from typing import Any, ParamSpec, TypeVar

import numpy as np
import ufl

from rodfem.errors import InputError, SceneError, many
from rodfem.expressions import Condition, Expr

P = ParamSpec("P")
T = TypeVar("T")
Check = Callable[[str, Any], Any]
ONE_THREAD = RLock()
"""Held while a public function works."""
SHORT = Repr()
SHORT.maxother = SHORT.maxstring = 60
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
    value = real(name, value, example)
    if not isfinite(value):
        raise InputError(f"{name} is {value:g}: give a finite number, as in {name}={example:g}.")
    return float(value)


def reals(name: str, values: Any, example: tuple[float, ...], size: int | None = None) -> tuple[float, ...]:
    """Return ``values`` as a tuple of floats; raises :class:`InputError` unless they are ``size`` (any) numbers.

    ``name`` and ``example`` are for the sentence of the error.
    """
    listed = isinstance(values, Iterable) and not isinstance(values, UNORDERED)
    given = tuple(values) if listed else None
    if given is None or (size is not None and len(given) != size):
        raise InputError(f"{name} is {values!r}: give {size or 'a tuple of'} numbers, as in {name}={example}.")
    return tuple(real(f"{name}[{i}]", value, example[0]) for i, value in enumerate(given))


def yes_or_no(name: str, value: Any) -> bool:
    """Return ``value``; raises :class:`InputError` unless it is True or False."""
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} is {value!r}: give True or False.")
    return bool(value)


def takes(function: Any, arguments: int) -> bool:
    """Whether this is a function of so many arguments."""
    try:
        inspect.signature(function).bind(*range(arguments))
    except (TypeError, ValueError):  # no function, another number of arguments, or a class without a signature
        return False
    return True


def encodes(name: str) -> bool:
    """Whether a name can be that of a file: no zero byte, no half of a surrogate pair."""
    return "\0" not in name and not any("\ud800" <= c <= "\udc7f" for c in name)


def checked(**checks: Check) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator of a function whose arguments are checked, and converted, before anything else is done.

    A default is not checked.  The function raises :class:`TypeError`, with the names of its arguments, if one is
    missing or unknown.
    """

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)
        defaults = {name: parameter.default for name, parameter in signature.parameters.items()}

        @wraps(function)
        def call(*arguments: P.args, **named: P.kwargs) -> T:
            try:
                given = signature.bind(*arguments, **named)
            except TypeError as trouble:  # Python's own words lack the function and what it takes
                names = [name for name in signature.parameters if name != "self"]
                words = f"{function.__name__}() {trouble}: its arguments are {', '.join(names)}"
                raise TypeError(words) from None
            for name, check in checks.items():
                if name in given.arguments and given.arguments[name] is not defaults[name]:
                    given.arguments[name] = check(name, given.arguments[name])
            with ONE_THREAD:
                return function(*given.args, **given.kwargs)

        return call

    return decorate


def a(kind: type | tuple[type, ...], example: str) -> Check:
    """Check for an object of a class, or of one of some; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, kind):
            raise InputError(f"{name} is {SHORT.repr(value)}: give {example}.")
        return value

    return check


def text(example: str) -> Check:
    """Check for a string."""
    return a(str, f"a text, as in {example!r}")


def count(example: int, least: int = 0) -> Check:
    """Check for a whole number, ``least`` or more; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> int:
        value = whole(name, value, example)
        if value < least:
            raise InputError(f"{name} is {value}: give {least} or more, as in {name}={example}.")
        return int(value)

    return check


def number(example: float) -> Check:
    """Check for a finite real number."""
    return lambda name, value: finite(name, value, example)


def interval(low: float, high: float) -> Check:
    """Check for two finite numbers, as in ``(low, high)``; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> tuple[float, ...]:
        found = reals(name, value, (low, high), 2)
        if not all(map(isfinite, found)):
            raise InputError(f"{name} is {found}: give two finite numbers, as in {name}={(low, high)}.")
        return found

    return check


def each(one: Check) -> Check:
    """Check for a sequence each of whose items passes a check; raises :class:`InputError` for anything else."""

    def check(name: str, values: Any) -> list[Any]:
        if not isinstance(values, Iterable) or isinstance(values, (str, bytes)):
            raise InputError(f"{name} is {SHORT.repr(values)}: give a list.")
        return [one(f"{name}[{i}]", value) for i, value in enumerate(values)]

    return check


def path(example: str) -> Check:
    """Check for a path, or the name of one; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> Path:
        if not isinstance(value, (str, os.PathLike)) or not str(value) or not encodes(str(value)):
            raise InputError(f"{name} is {SHORT.repr(value)}: give a path, as in {name}={example!r}.")
        return Path(value)

    return check


def function(example: str, arguments: int = 1) -> Check:
    """Check for a function of so many arguments; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> Any:
        if not takes(value, arguments):
            raise InputError(
                f"{name} is {value!r}: give a function of {many(arguments, 'argument')}, as in {name}={example}."
            )
        return value

    return check


def check_vector(what: str, values: Any, size: int) -> None:
    """Raise :class:`SceneError` unless ``values`` has ``size`` components."""
    if isinstance(values, UNORDERED):
        raise SceneError(f"The {what} is {values!r}: give {size} components in a tuple.")
    try:
        given = len(values)
    except TypeError:
        raise SceneError(f"The {what} is a single value: give {size} components.") from None
    if given != size:
        raise SceneError(f"The {what} has {given} components: give {size}.")


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
    """Return a number, or a constant expression, as a float; raises :class:`TypeError` for anything else."""
    if isinstance(value, (str, bytes, bool, np.bool_)) or (isinstance(value, np.ndarray) and value.ndim):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def number_of(value: Any) -> float:
    """Number that an expression without unknowns stands for; nan if it has none, or a complex one."""
    try:
        return plain(value(()) if isinstance(value, Expr) else value)
    except Exception:  # of UFL's own, too, which differ from release to release
        return nan

"""Checks of arguments: each takes a name and a value, and returns the value to go on with, or raises one sentence.

:func:`checked` declares those of a public function at its head, :func:`convert` applies them to a dataclass's fields.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Set
from contextlib import suppress
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
ONE_THREAD = RLock()  # held while a public function works: neither PETSc nor FFCx can be used by two threads
SHORT = Repr()
SHORT.maxother = SHORT.maxstring = 60
UNORDERED = str, bytes, Set, Mapping  # kinds that can be iterated over and are no lists of numbers


def refused(name: str, value: Any, wanted: str) -> InputError:
    """Error of an argument that has a ``value`` in the place of what is ``wanted``, in which ``@`` is its name."""
    return InputError(f"{name} is {SHORT.repr(value)}: give {wanted.replace('@', name)}.")


def whole(example: int, least: int | None = None) -> Check:
    """Check for a whole number, no bool and no float, ``least`` or more unless that is None."""

    def check(name: str, value: Any) -> int:
        if not isinstance(value, Integral) or isinstance(value, bool):
            raise refused(name, value, f"a whole number, as in @={example}")
        if least is not None and value < least:
            raise refused(name, value, f"{least} or more, as in @={example}")
        return int(value)

    return check


def real(example: float) -> Check:
    """Check for a number, no bool and no string."""

    def check(name: str, value: Any) -> float:
        if isinstance(value, Real) and not isinstance(value, (bool, np.bool_)):
            with suppress(OverflowError):  # of an integer
                return float(value)
        raise refused(name, value, f"a number, as in @={example:g}")

    return check


def finite(example: float) -> Check:
    """Check for a finite number."""

    def check(name: str, value: Any) -> float:
        number = real(example)(name, value)
        if not isfinite(number):
            raise refused(name, number, f"a finite number, as in @={example:g}")
        return float(number)

    return check


def reals(
    name: str, values: Any, example: tuple[float, ...], size: int | None = None, one: Callable[[float], Check] = real
) -> tuple[float, ...]:
    """Tuple of numbers, ``size`` of them unless that is None, each of which passes the check ``one``."""
    given = tuple(values) if isinstance(values, Iterable) and not isinstance(values, UNORDERED) else None
    if given is None or (size is not None and len(given) != size):
        raise refused(name, values, f"{size or 'a tuple of'} numbers, as in @={example}")
    return tuple(one(example[0])(f"{name}[{i}]", value) for i, value in enumerate(given))


def takes(function: Any, arguments: int) -> bool:
    """Whether this is a function of so many arguments."""
    try:
        inspect.signature(function).bind(*range(arguments))
    except (TypeError, ValueError):  # no function, another number of arguments, or a class without a signature
        return False
    return True


def checked(**checks: Check) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator of a function whose arguments are checked, and converted; a default is not."""

    def decorate(function: Callable[P, T]) -> Callable[P, T]:
        signature = inspect.signature(function)

        @wraps(function)
        def call(*arguments: P.args, **named: P.kwargs) -> T:
            try:
                given = signature.bind(*arguments, **named)
            except TypeError as trouble:  # Python's own words lack the function and what it takes
                names = [name for name in signature.parameters if name != "self"]
                words = f"{function.__name__}() {trouble}: its arguments are {', '.join(names)}"
                raise TypeError(words) from None
            for name, check in checks.items():
                if name in given.arguments and given.arguments[name] is not signature.parameters[name].default:
                    given.arguments[name] = check(name, given.arguments[name])
            with ONE_THREAD:
                return function(*given.args, **given.kwargs)

        return call

    return decorate


def convert(owner: Any, **checks: Check) -> None:
    """Check and convert fields of a frozen dataclass, in its ``__post_init__``."""
    for name, check in checks.items():
        object.__setattr__(owner, name, check(name, getattr(owner, name)))


def a(kind: type | tuple[type, ...], example: str) -> Check:
    """Check for an object of a class, or of one of some."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, kind):
            raise refused(name, value, example)
        return value

    return check


yes_or_no = a(bool, "True or False")


def text(example: str) -> Check:
    """Check for a string."""
    return a(str, f"a text, as in {example!r}")


def interval(low: float, high: float, one: Callable[[float], Check] = finite) -> Check:
    """Check for two finite numbers, as in ``(low, high)``, or two that pass the check ``one``."""
    return lambda name, value: reals(name, value, (low, high), 2, one)


def optional(check: Check) -> Check:
    """Check that lets None pass."""
    return lambda name, value: None if value is None else check(name, value)


def each(one: Check) -> Check:
    """Check for a sequence each of whose items passes a check."""

    def check(name: str, values: Any) -> list[Any]:
        if not isinstance(values, Iterable) or isinstance(values, (str, bytes)):
            raise refused(name, values, "a list")
        return [one(f"{name}[{i}]", value) for i, value in enumerate(values)]

    return check


def path(example: str) -> Check:
    """Check for a path, or the name of one."""

    def check(name: str, value: Any) -> Path:
        if not isinstance(value, (str, os.PathLike)) or not str(value) or "\0" in str(value):
            raise refused(name, value, f"a path, as in @={example!r}")
        return Path(value)

    return check


def function(example: str, arguments: int = 1) -> Check:
    """Check for a function of so many arguments."""

    def check(name: str, value: Any) -> Any:
        if not takes(value, arguments):
            raise refused(name, value, f"a function of {many(arguments, 'argument')}, as in @={example}")
        return value

    return check


def check_vector(what: str, values: Any, size: int) -> None:
    """Raise :class:`SceneError` unless ``values`` has ``size`` components."""
    try:
        given = None if isinstance(values, UNORDERED) else len(values)
    except TypeError:
        given = None
    if given != size:
        raise SceneError(f"The {what} {f'is {values!r}' if given is None else f'has {given} components'}: give {size}.")


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
    """Float of a number, or of a constant expression; raises :class:`TypeError` for anything else."""
    if isinstance(value, (str, bytes, bool, np.bool_)) or (isinstance(value, np.ndarray) and value.ndim):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def number_of(value: Any) -> float:
    """Number that an expression without unknowns stands for; nan if it has none, or a complex one."""
    try:
        return plain(value(()) if isinstance(value, Expr) else value)
    except Exception:  # of UFL's own, too, which differ from release to release
        return nan

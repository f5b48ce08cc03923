"""Checks of the arguments of public functions, declared once for each at its head.

:func:`checked` takes a check for each argument by name: a function of the argument's name and value that returns the
value to go on with, or raises :class:`InputError` in one sentence that names the value, what was expected and an
example.  A default is not checked.

These functions work in one thread at a time, as neither PETSc nor FFCx can be used by two: others wait.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable
from dataclasses import fields, is_dataclass
from functools import wraps
from math import isfinite
from pathlib import Path
from reprlib import Repr
from threading import RLock
from typing import Any, ParamSpec, TypeVar

from rodfem.errors import InputError
from rodfem.problem import kinds
from rodfem.problem.kinds import finite, reals, whole

P = ParamSpec("P")
T = TypeVar("T")
Check = Callable[[str, Any], Any]
ONE_THREAD = RLock()
"""Held while a public function works."""
SHORT = Repr()
SHORT.maxother = SHORT.maxstring = 60


def checked(**checks: Check) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator of a function whose arguments are checked, and converted, before anything else is done.

    The function raises :class:`TypeError`, with the names of its arguments, where one is missing or is none of them.
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
                raise TypeError(f"{words}{_belongs(named, checks)}") from None
            for name, check in checks.items():
                if name in given.arguments and given.arguments[name] is not defaults[name]:
                    given.arguments[name] = check(name, given.arguments[name])
            with ONE_THREAD:
                return function(*given.args, **given.kwargs)

        return call

    return decorate


def _belongs(named: Iterable[str], checks: dict[str, Check]) -> str:
    """Say which of the last arguments is of a dataclass that has one of some names as a field; empty where none is."""
    for name in named:
        for argument, check in reversed(checks.items()):
            kind = getattr(check, "kind", None)
            if not isinstance(kind, type) or not is_dataclass(kind) or name in checks:
                continue
            if name in {f.name for f in fields(kind)}:
                return f"; give {argument}={kind.__name__}({name}=...)"
    return ""


def a(kind: type | tuple[type, ...], example: str) -> Check:
    """Check for an object of a class, or of one of some; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, kind):
            raise InputError(f"{name} is {SHORT.repr(value)}: give {example}.")
        return value

    check.kind = kind  # type: ignore[attr-defined]
    return check


def count(example: int, least: int = 0) -> Check:
    """Check for a whole number, ``least`` or more; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> int:
        number = whole(name, value, example)
        if number < least:
            raise InputError(f"{name} is {number}: give {least} or more, as in {name}={example}.")
        return number

    return check


def number(example: float) -> Check:
    """Check for a finite real number; raises :class:`InputError` for anything else."""

    def check(name: str, value: Any) -> float:
        return finite(name, value, example)

    return check


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


def encodes(name: str) -> bool:
    """Whether a name can be that of a file: no zero byte, no half of a surrogate pair."""
    return "\0" not in name and not any("\ud800" <= c <= "\udc7f" for c in name)


def text(example: str) -> Check:
    """Check for a string."""
    return a(str, f"a text, as in {example!r}")


def function(example: str, arguments: int = 1) -> Check:
    """Check for a function of so many arguments; raises :class:`InputError` for anything else."""
    return lambda name, value: kinds.function(name, value, arguments, example)


def yes_or_no(name: str, value: Any) -> bool:
    """Check for True or False; raises :class:`InputError` for anything else."""
    return kinds.flag(name, value)

"""A digest of functions by what they do: their code, constants, and the functions that they call.

Files that are used again tell by it whether an energy, or the work on a rod, has changed since.  Another version of
Python compiles to other code: then what could be used is computed anew.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from inspect import unwrap
from types import CodeType, FunctionType, MethodType
from typing import Any

import numpy as np

VALUES = (bool, int, float, complex, str, bytes, type(None))
"""Types of values that are part of what a function does; objects of others may change while it runs."""


def digest(functions: Iterable[Callable[..., Any]]) -> str:
    """Sixteen hexadecimal digits that are equal for functions of the same code, defaults and constants."""
    seen: set[int] = set()
    parts = [part for function in functions for part in _of(function, seen)]
    return hashlib.sha1("\n".join(parts).encode()).hexdigest()[:16]


def _of(value: Any, seen: set[int]) -> Iterator[str]:
    """Parts of a function, each once, or of a value."""
    if isinstance(value, VALUES):
        yield repr(value)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif isinstance(value, (tuple, frozenset)):
        for x in sorted(value, key=repr) if isinstance(value, frozenset) else value:
            yield from _of(x, seen)
    elif isinstance(value, partial):
        for x in (value.func, *value.args, *value.keywords.items()):
            yield from _of(x, seen)
    elif isinstance(value, MethodType):
        yield from _of(value.__func__, seen)
    elif isinstance(value, CodeType):
        yield value.co_code.hex() + " ".join(value.co_names)
        for constant in value.co_consts[bool(value.co_consts and isinstance(value.co_consts[0], str)) :]:
            yield from _of(constant, seen)
    elif isinstance(function := unwrap(value) if callable(value) else value, FunctionType):
        if id(function) not in seen:
            seen.add(id(function))
            yield from _of_function(function, seen)


def _of_function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    """Code, defaults, closure, and the functions and constants of its module that a function names."""
    yield from _of(function.__code__, seen)
    yield from _of(function.__defaults__, seen)
    for cell in function.__closure__ or ():
        yield from _of(cell.cell_contents, seen)
    known = (function.__globals__.get(name) for name in function.__code__.co_names)
    for value in known:
        if isinstance(value, (*VALUES, np.ndarray)) or (
            isinstance(value, FunctionType) and value.__module__ == function.__module__
        ):
            yield from _of(value, seen)
